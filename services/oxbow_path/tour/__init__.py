"""The method `Tour`: a closed tour through points spread evenly over the water.

Rendas and Li 2016, section 1.2.1.3, describe the idea and drop it, for tours left the water. Here the tour is
measured along shortest ways inside the water, and the path is the outline of what the tour encloses.
"""

from oxbow_path.tour.method import tour

__all__ = ["tour"]
