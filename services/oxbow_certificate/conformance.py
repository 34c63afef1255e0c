"""Whether a path keeps the rules: never across itself, inside the water, clear of the shore."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import LineString, MultiLineString, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import Place
from oxbow_certificate.distance import segments_of
from oxbow_certificate.erosion import eroded
from oxbow_certificate.region import JudgedSpace

__all__ = ["about_ends", "count_crossings", "outside_length", "unsafe_length"]

SHORE_TOLERANCE_M = 0.01
"""A path this near to the shore is on it: degrees of seven decimals are a centimetre."""

SAFETY_SHARE = 0.99
"""The share of the safety distance that must be kept: eroded contours are polygons, not arcs."""

_CHUNK = 512


def count_crossings(path: LineString) -> int:
    """Number of pairs of segments of `path` that meet, neighbours along the path aside.

    The first and the last segment of a closed path are neighbours. A path that only folds back upon its end has
    no such pair, and counts as one crossing: the count is 0 if and only if the path is simple.
    """
    if shapely.is_simple(path):
        return 0
    segments = segments_of(path)
    last = len(segments) - 1
    tree = STRtree(segments)
    pairs = 0
    # In pieces, since a path that is one tangle has pairs by the square of its length.
    for start in range(0, len(segments), _CHUNK):
        i, j = tree.query(segments[start : start + _CHUNK], predicate="intersects")
        i += start
        neighbours = (j <= i + 1) | (path.is_closed & (i == 0) & (j == last))
        pairs += int(np.count_nonzero(~neighbours))
    return max(pairs, 1)


def outside_length(path: LineString, space: JudgedSpace) -> float:
    """Metres of `path` outside the outline or inside a forbidden zone."""
    outside = _beyond(path, space.water)
    return float(_beyond(outside, space.water.buffer(SHORE_TOLERANCE_M)).length) if outside.length else 0.0


def unsafe_length(path: LineString, space: JudgedSpace, safety_m: float, ends: Sequence[Place]) -> float:
    """Metres of `path` nearer to the shore or a zone than the safety distance, `about_ends` excused."""
    if safety_m == 0:
        return 0.0
    unexcused = _beyond(path, shapely.union_all([space.free, about_ends(space, ends, 2.0 * safety_m)]))
    if unexcused.length == 0:
        return 0.0
    return float(_beyond(unexcused, eroded(space.water, SAFETY_SHARE * safety_m, space.detail_m)).length)


def about_ends(space: JudgedSpace, ends: Sequence[Place], margin_m: float) -> BaseGeometry:
    """Where a path may do as it must to reach `ends`, the launch and recovery points.

    A point ashore can only be reached through unsafe water. A leg may wander, within one and a half times its
    least length and a margin.
    """
    points = shapely.points(ends)
    radius_m = margin_m + 1.5 * shapely.distance(points, space.free)
    return shapely.union_all(shapely.buffer(points, radius_m, quad_segs=16))


def _beyond(lines: BaseGeometry, region: BaseGeometry) -> BaseGeometry:
    """The parts of `lines` outside `region`; only segments that leave it are overlaid."""
    shapely.prepare(region)
    segments = np.concatenate([segments_of(line) for line in shapely.get_parts(lines)])
    leaving = segments[~shapely.covers(region, segments)]
    return shapely.difference(MultiLineString(list(leaving)), region)
