"""Distance to a path, or to the nearest of several."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree
from shapely import STRtree

from oxbow.arrays import FloatArray
from oxbow_certificate.axes import Paths, coordinates_along, main_direction, segment_ends

__all__ = ["DistanceBounds", "PathDistance", "segments_of"]


def segments_of(paths: Paths) -> npt.NDArray[Any]:
    """The segments of paths as lines, in order, without those of length 0; shape (n,)."""
    return np.asarray(shapely.linestrings(segment_ends(paths)))


_PIECES = 2_000
"""A path is cut into at least about this many pieces: the box of a long oblique segment is mostly empty."""

_MOST_PLACES = 200_000
"""Upper bounds use at most about this many places of a path."""


class PathDistance:
    """Exact distance from places to paths, by an R-tree of their segments (STR, Leutenegger et al. 1997).

    The axes lie along the paths, so that the boxes of parallel legs are narrow.
    """

    def __init__(self, paths: Paths) -> None:
        self._along = main_direction(paths)
        upright = shapely.transform(paths, lambda xy: coordinates_along(xy, self._along))
        self._paths = paths
        self._tree = STRtree(segments_of(upright.segmentize(paths.length / _PIECES)))

    def __call__(self, places: FloatArray) -> FloatArray:
        """Distances (n,) in metres from `places` (n, 2) to the nearest path."""
        points = shapely.points(coordinates_along(places, self._along))
        _, distances = self._tree.query_nearest(points, return_distance=True, all_matches=False)
        return np.asarray(distances)

    def bounds(self, detail_m: float) -> DistanceBounds:
        """Upper bounds of the distance, by places of the paths at most about `detail_m` apart."""
        return DistanceBounds(self._paths.segmentize(max(detail_m, self._paths.length / _MOST_PLACES)))


class DistanceBounds:
    """Upper bounds of the distance from places to paths: that to the nearest vertex, which is quick to find."""

    def __init__(self, paths: Paths) -> None:
        self._tree = cKDTree(shapely.get_coordinates(paths))

    def __call__(self, places: FloatArray) -> FloatArray:
        """Bounds (n,) in metres for `places` (n, 2)."""
        return np.asarray(self._tree.query(places)[0])
