"""The Transect method: parallel legs over the cells of the decomposition."""

from oxbow_path.transect.method import transects

__all__ = ["transects"]
