"""Distance to a path, or to the nearest of several."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree
from shapely import STRtree

from oxbow.arrays import FloatArray, Indices
from oxbow_certificate.axes import Paths, coordinates_along, main_direction, segment_ends

__all__ = ["PathDistance", "segments_of"]


def segments_of(paths: Paths) -> npt.NDArray[Any]:
    """The segments of paths as lines, in order, without those of length 0; shape (n,)."""
    return np.asarray(shapely.linestrings(segment_ends(paths)))


_MOST_PIECES = 200_000
"""A path is cut into at most about so many pieces, besides its own segments."""

_LOOKS = (6, 12, 24, 48)
"""How many pieces a place is compared with, from round to round, before the R-tree is asked."""

_CHUNK = 50_000


class PathDistance:
    """Exact distance from places to paths, which are cut into pieces no longer than that mostly is.

    A place is compared with the pieces whose middles are the nearest, by a k-d tree (Bentley 1975), until even
    half the longest piece could not bring the next one nearer. Where waypoints are dense, or the whole path is
    equally far, that would take too many pieces: such places ask an R-tree (STR, Leutenegger et al. 1997).

    Parameters
    ----------
    paths
        To which distances are taken.
    about_m
        How far places mostly are, to a factor of a few: a few pieces so long are near any place. It decides how
        long distances take, not what they are.
    """

    def __init__(self, paths: Paths, about_m: float) -> None:
        self._paths = paths.segmentize(max(about_m, paths.length / _MOST_PIECES))
        ends = segment_ends(self._paths)
        steps = ends[:, 1] - ends[:, 0]
        self._middle = ends.mean(axis=1)
        self._half_m = np.hypot(*steps.T) / 2
        self._along = steps / (2.0 * self._half_m[:, None])
        self._middles = cKDTree(self._middle)

    def __call__(self, places: FloatArray) -> FloatArray:
        """Distances (n,) in metres from `places` (n, 2) to the nearest path."""
        chunks = np.split(places, range(_CHUNK, len(places), _CHUNK))
        return np.concatenate([self._distances(chunk) for chunk in chunks])

    def bounds(self, places: FloatArray) -> FloatArray:
        """Upper bounds (n,) of the same, in less than half the time: mostly no more than the distance itself."""
        return self._to_pieces(places, np.asarray(self._middles.query(places)[1]))

    def _distances(self, places: FloatArray) -> FloatArray:
        nearest_m = np.full(len(places), np.inf)
        left = np.arange(len(places))
        done = 0
        for looks in np.minimum(_LOOKS, len(self._middle)).tolist():
            middle_m, piece = map(np.asarray, self._middles.query(places[left], k=np.arange(done, looks) + 1))
            # No place of a piece is nearer than its middle by more than this, whichever piece it is.
            least_m = middle_m - self._half_m.max()
            row = np.arange(len(left))
            for look in range(looks - done):
                row = row[least_m[row, look] < nearest_m[left[row]]]
                place = left[row]
                nearest_m[place] = np.minimum(nearest_m[place], self._to_pieces(places[place], piece[row, look]))
            left = left[row]
            done = looks
            if len(left) == 0 or done == len(self._middle):
                return nearest_m
        nearest_m[left] = self._rtree(places[left])
        return nearest_m

    def _to_pieces(self, places: FloatArray, piece: Indices) -> FloatArray:
        """Distances (n,) from each place to one piece."""
        way, along, half_m = places - self._middle[piece], self._along[piece], self._half_m[piece]
        ahead_m = np.clip(np.vecdot(way, along), -half_m, half_m)
        return np.asarray(np.hypot(*(way - ahead_m[:, None] * along).T))

    @cached_property
    def _rtree(self) -> _SegmentTree:
        return _SegmentTree(self._paths)


class _SegmentTree:
    """The same distance by an R-tree: slower, but no slower where waypoints are dense.

    The axes lie along the paths, so that the boxes of parallel legs are narrow. They are cut already: the box of a
    long oblique segment is mostly empty.
    """

    def __init__(self, paths: Paths) -> None:
        self._along = main_direction(paths)
        self._tree = STRtree(segments_of(shapely.transform(paths, lambda xy: coordinates_along(xy, self._along))))

    def __call__(self, places: FloatArray) -> FloatArray:
        points = shapely.points(coordinates_along(places, self._along))
        _, distances = self._tree.query_nearest(points, return_distance=True, all_matches=False)
        return np.asarray(distances)
