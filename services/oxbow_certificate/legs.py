"""The MaxMin criterion of a path: the least distance between its parallel legs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices, Place
from oxbow_certificate.axes import coordinates_along, main_direction
from oxbow_certificate.distance import segments_of

__all__ = ["about_ends", "least_leg_distance"]

PARALLEL_RAD = math.radians(30.0)
"""Stretches whose directions differ by no more than this are parallel."""

NEIGHBOURS = 2.0
"""Places within this many spacings of each other along the path are neighbours on one leg or its turn."""

REACH = 4.0
"""Legs are searched for within this many spacings."""

_MOST_PIECES = 5_000
_CHUNK = 1024


def least_leg_distance(path: LineString, spacing_m: float, excused: BaseGeometry) -> float | None:
    """Least distance between parallel legs of a path, in metres (Rendas and Li 2016, section 1.2.1, MaxMin).

    The report takes the least distance between sampled points, which along a path is just the sampling step. This
    takes places on two legs instead: stretches that are parallel to within 30 degrees, face each other (the
    shortest way between them is perpendicular to one of them), and are not neighbours along the path. Two straight
    stretches are nearest at an end of one of them, so that no leg is missed between samples.

    Parameters
    ----------
    path
        The path; if it is closed, its end is a neighbour of its start.
    spacing_m
        Nominal spacing of legs: the scale by which places are neighbours.
    excused
        Where legs may meet: about the launch and recovery points; see `about_ends`.

    Returns
    -------
    float or None
        None if no two legs face each other within four spacings.
    """
    along = main_direction(path)
    excused = shapely.transform(excused, lambda xy: coordinates_along(xy, along))
    path = LineString(coordinates_along(shapely.get_coordinates(path), along))
    pieces = _Pieces.of(path, max(spacing_m, path.length / _MOST_PIECES))
    # Excused ends are not measured from; from any other end, the distance to an excused piece still counts.
    asked = np.flatnonzero(~shapely.intersects_xy(excused, pieces.ends))
    # Most paths have legs within one spacing, and a wider search, which takes longer, would find the same.
    for reach in (1.0, REACH):
        least_m = pieces.least_distance(asked, reach * spacing_m, NEIGHBOURS * spacing_m)
        if least_m < math.inf:
            return least_m
    return None


def about_ends(free: BaseGeometry, ends: Sequence[Place], margin_m: float) -> BaseGeometry:
    """Where legs may meet: about the launch and recovery points.

    Discs reach one and a half times as far as the free space, and a margin farther: all the way there is excused.

    Parameters
    ----------
    free
        The free space.
    ends
        The launch and recovery points, maybe outside the free space.
    margin_m
        Added to the radius of each disc.

    Returns
    -------
    shapely geometry
        One disc around each end, united.
    """
    points = shapely.points(ends)
    radius_m = margin_m + 1.5 * shapely.distance(points, free)
    return shapely.union_all(shapely.buffer(points, radius_m, quad_segs=16))


@dataclass(frozen=True)
class _Pieces:
    """A path cut into n straight pieces, and their 2n ends: all the starts, then all the ends.

    `along` (n, 2) are unit vectors, `at_m` (2n,) the positions of the ends along the path, and `ring_m` is the
    length of a closed path, infinite for an open one.
    """

    tree: STRtree
    ends: FloatArray
    along: FloatArray
    length_m: FloatArray
    at_m: FloatArray
    ring_m: float

    @classmethod
    def of(cls, path: LineString, longest_m: float) -> _Pieces:
        lines = segments_of(path.segmentize(longest_m))
        start, end = shapely.get_coordinates(lines).reshape(-1, 2, 2).transpose(1, 0, 2)
        length_m = np.hypot(*(end - start).T)
        end_m = np.cumsum(length_m)
        return cls(
            tree=STRtree(lines),
            ends=np.concatenate([start, end]),
            along=(end - start) / length_m[:, None],
            length_m=length_m,
            at_m=np.concatenate([end_m - length_m, end_m]),
            ring_m=path.length if path.is_closed else math.inf,
        )

    def least_distance(self, asked: Indices, within_m: float, neighbours_m: float) -> float:
        """Least distance from the ends `asked` to a piece of another leg that they face; infinite if none."""
        points = np.asarray(shapely.points(self.ends[asked]))
        least_m = math.inf
        # In chunks, since the pairs of a tangled path grow as the square of its length, and with them the memory.
        for first in range(0, len(asked), _CHUNK):
            part = slice(first, first + _CHUNK)
            found, piece = self.tree.query(points[part], predicate="dwithin", distance=within_m)
            across_m = self._facing_distances(asked[part][found], piece, neighbours_m)
            least_m = min(least_m, float(across_m.min(initial=math.inf)))
        return least_m

    def _facing_distances(self, end: Indices, piece: Indices, neighbours_m: float) -> FloatArray:
        """Distances of pairs of an end and a piece that are parallel, face each other and are not neighbours."""
        along = self.along[piece]
        way = self.ends[end] - self.ends[piece]
        ahead_m = np.vecdot(way, along)
        between_m = np.abs(self.at_m[end] - self.at_m[piece] - ahead_m)
        legs = (
            (np.abs(np.vecdot(self.along[end % len(self.along)], along)) >= math.cos(PARALLEL_RAD))
            & (ahead_m >= 0)
            & (ahead_m <= self.length_m[piece])
            # Around a closed path the shorter way counts; for an open one `ring_m` is infinite.
            & (np.minimum(between_m, self.ring_m - between_m) > neighbours_m)
        )
        return np.asarray(np.abs(way[legs, 0] * along[legs, 1] - way[legs, 1] * along[legs, 0]))
