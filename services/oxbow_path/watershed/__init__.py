"""Coverage from the border to the core (Balampanis, Maza and Ollero 2016, sections V and VI)."""

from oxbow_path.watershed.cells import CellPath, coverage_depth, shortest_path, watershed_path
from oxbow_path.watershed.planner import plan_watershed, watershed

__all__ = [
    "CellPath",
    "coverage_depth",
    "plan_watershed",
    "shortest_path",
    "watershed",
    "watershed_path",
]
