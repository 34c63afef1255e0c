"""The MaxMin criterion of a path: how near its parallel legs come to one another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices, Place
from oxbow_certificate.axes import main_direction, turned
from oxbow_certificate.distance import segments_of

__all__ = ["about_ends", "least_leg_distance"]

PARALLEL_RAD = math.radians(30.0)
"""Stretches whose directions differ by no more than this are parallel."""

NEIGHBOURS = 2.0
"""Places nearer to each other along the path than so many spacings are neighbours on one leg or its turn."""

REACH = 4.0
"""Legs are looked for within so many spacings."""

_MOST_PIECES = 5_000
_CHUNK = 1024


def least_leg_distance(path: LineString, spacing_m: float, excused: BaseGeometry) -> float | None:
    """Least distance between parallel legs of a path, in metres (Rendas and Li 2016, section 1.2.1, MaxMin).

    The report takes the least distance between sampled points, which along a path is the sampling step. Here the
    points are places on two legs: stretches that are parallel to within 30 degrees, face each other (the shortest
    way between them is perpendicular to one of them), and are no neighbours along the path. Two straight stretches
    are nearest at an end of one of them, so that no leg is missed between samples.

    Parameters
    ----------
    path
        The path; where it is closed, its end is a neighbour of its start.
    spacing_m
        Nominal spacing of legs, the scale of what is a neighbour.
    excused
        Where legs may meet: about the launch and recovery points.

    Returns
    -------
    float or None
        None where no two legs face each other within four spacings.
    """
    along = main_direction(path)
    excused = shapely.transform(excused, lambda xy: turned(xy, along))
    path = LineString(turned(shapely.get_coordinates(path), along))
    pieces = _Pieces.of(path, max(spacing_m, path.length / _MOST_PIECES))
    asked = np.flatnonzero(~shapely.intersects_xy(excused, pieces.ends))
    # Most paths have legs within a spacing: a wider search would find the same.
    for reach in (1.0, REACH):
        least_m = pieces.least_distance(asked, reach * spacing_m, NEIGHBOURS * spacing_m)
        if least_m < math.inf:
            return least_m
    return None


def about_ends(free: BaseGeometry, ends: Sequence[Place], margin_m: float) -> BaseGeometry:
    """Where legs may meet: about `ends`, the launch and recovery points, within one and a half times the distance
    to the free space and a margin.
    """
    points = shapely.points(ends)
    radius_m = margin_m + 1.5 * shapely.distance(points, free)
    return shapely.union_all(shapely.buffer(points, radius_m, quad_segs=16))


@dataclass(frozen=True)
class _Pieces:
    """A path cut into n straight pieces, and their 2n ends: all the starts, then all the ends.

    `along` (n, 2) are unit vectors, `at_m` (2n,) how far along the path each of the ends lies.
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
        """Least distance from the ends `asked` to a piece of another leg that one faces; infinite without any."""
        points = np.asarray(shapely.points(self.ends[asked]))
        least_m = math.inf
        # In parts, since a path that is one tangle has pairs by the square of its length.
        for first in range(0, len(asked), _CHUNK):
            part = slice(first, first + _CHUNK)
            found, piece = self.tree.query(points[part], predicate="dwithin", distance=within_m)
            across_m = self._facing_distances(asked[part][found], piece, neighbours_m)
            least_m = min(least_m, float(across_m.min(initial=math.inf)))
        return least_m

    def _facing_distances(self, end: Indices, piece: Indices, neighbours_m: float) -> FloatArray:
        """Distances of the pairs of an end and a piece that are parallel, face each other, are no neighbours."""
        along = self.along[piece]
        way = self.ends[end] - self.ends[piece]
        ahead_m = np.vecdot(way, along)
        between_m = np.abs(self.at_m[end] - self.at_m[piece] - ahead_m)
        legs = (
            (np.abs(np.vecdot(self.along[end % len(self.along)], along)) >= math.cos(PARALLEL_RAD))
            & (ahead_m >= 0)
            & (ahead_m <= self.length_m[piece])
            & (np.minimum(between_m, self.ring_m - between_m) > neighbours_m)
        )
        return np.asarray(np.abs(way[legs, 0] * along[legs, 1] - way[legs, 1] * along[legs, 0]))
