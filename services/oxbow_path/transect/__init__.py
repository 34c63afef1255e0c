"""The Transect method: parallel legs over the cells of the decomposition."""

from oxbow_path.transect.pattern import try_transects
from oxbow_path.transect.planner import transects

__all__ = ["transects", "try_transects"]
