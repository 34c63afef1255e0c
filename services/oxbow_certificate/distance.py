"""Distance to a path."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import LineString, STRtree

from oxbow.contracts import FloatArray
from oxbow_certificate.axes import main_direction, turned

__all__ = ["PathDistance", "segments_of"]


def segments_of(path: LineString) -> npt.NDArray[Any]:
    """The segments of `path` as lines, in order, without those of no length."""
    xy = shapely.get_coordinates(path)
    ends = np.stack([xy[:-1], xy[1:]], axis=1)
    return np.asarray(shapely.linestrings(ends[(ends[:, 0] != ends[:, 1]).any(axis=1)]))


_PIECES = 2_000
"""A path is cut into some so many pieces at least: the box of a long oblique segment is mostly empty."""


class PathDistance:
    """Exact distance from places to a path, by an R-tree of its segments (STR, Leutenegger et al. 1997).

    The axes lie along the path, so that the boxes of parallel legs are narrow.
    """

    def __init__(self, path: LineString) -> None:
        self._along = main_direction(path)
        upright = LineString(turned(shapely.get_coordinates(path), self._along))
        self._tree = STRtree(segments_of(upright.segmentize(path.length / _PIECES)))

    def __call__(self, places: FloatArray) -> FloatArray:
        """Distances (n,) in metres from `places` (n, 2) to the path."""
        points = shapely.points(turned(places, self._along))
        _, distances = self._tree.query_nearest(points, return_distance=True, all_matches=False)
        return np.asarray(distances)
