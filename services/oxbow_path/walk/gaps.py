"""Gaps: water farther from the path than it may be, and the branches that reach it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import LineString, Point, Polygon
from shapely.ops import substring

from oxbow.arrays import FloatArray, Indices
from oxbow.geometry.route.gate_routes import Inward, Routes
from oxbow_path.walk.probe import Probe
from oxbow_path.walk.region import Brush, Walk, largest, simply_connected

__all__ = ["branch_to", "reach_gaps"]

ROUNDS = 6


def reach_gaps(
    walk: Walk, brush: Brush, probe: Probe, routes: Routes, *, reach_m: float, cut_width_m: float
) -> Walk:
    """Grow branches into the gaps, worst first, until none is deeper than `reach_m` (or `ROUNDS` are over).

    Outside the region, a gap is reached by a branch, which is walked on both sides: it costs twice its length.
    Inside it, where bands have merged, the gap is opened by a slit from the boundary.

    Parameters
    ----------
    walk
        The region so far.
    brush
        Makes branches into bands.
    probe
        The places that have to be within reach.
    routes
        Ways through the free space.
    reach_m
        How far water may be from the path.
    cut_width_m
        Width of slits, and of the cuts that open holes.

    Returns
    -------
    Walk
        A simply connected region; gaps are left in it where `ROUNDS` did not suffice.
    """
    for _ in range(ROUNDS):
        distance = probe.distances(walk.ring)
        # Worst first: a branch into a deep gap passes and serves shallower ones on its way.
        worst_first = np.argsort(-distance)
        gaps = probe.points[worst_first[: np.count_nonzero(distance > reach_m)]]
        if len(gaps) == 0:
            break
        inside = shapely.contains_xy(walk.region, gaps[:, 0], gaps[:, 1])
        apart_m = reach_m + brush.half_width_m
        # Longer than to the ring, so that a slit breaks through it.
        slits = [
            shapely.buffer(_lengthened(shapely.shortest_line(Point(gap), walk.ring), cut_width_m), cut_width_m / 2)
            for gap in _spread(gaps[inside], apart_m)
        ]
        branches = list(_branches(gaps[~inside], walk.region, brush, routes, apart_m))
        grown = walk.region.union(brush.bands(branches))
        region = largest(grown.difference(shapely.union_all(slits)))
        walk = simply_connected(region, brush.free, probe, cut_width_m=cut_width_m, reach_m=reach_m)
    return walk


def _spread(points: FloatArray, apart_m: float) -> Iterator[FloatArray]:
    """The first point, and each later one that is at least `apart_m` from those before."""
    index = cKDTree(points)
    taken = np.zeros(len(points), dtype=bool)
    for number, point in enumerate(points):
        if not taken[number]:
            taken[index.query_ball_point(point, apart_m)] = True
            yield point


def _branches(
    gaps: FloatArray, region: Polygon, brush: Brush, routes: Routes, apart_m: float
) -> Iterator[LineString]:
    """A branch for each gap that no earlier branch of this round has come near, to the region or such a branch."""
    reached = np.zeros(len(gaps), dtype=bool)
    inward: Inward | None = None
    for number, gap in enumerate(gaps):
        if reached[number]:
            continue
        branch = _straight(gap, region, routes, brush.half_width_m)
        if branch is None:
            # One search from the region serves all gaps of the round that are out of sight; most rounds need none.
            inward = inward or routes.into(region, routes.goals_in(region))
            branch = inward.route(gap, brush.margin_m) or shapely.shortest_line(Point(gap), region)
        yield _shortened(branch, min(brush.margin_m, branch.length / 2))
        steps = shapely.get_coordinates(shapely.segmentize(branch, apart_m / 4)) if branch.length else gap[None]
        # A long branch in fine samples has far more pairs of a step and a gap than either.
        left = np.flatnonzero(~reached)
        distance_m, _ = cKDTree(steps).query(gaps[left], distance_upper_bound=apart_m)
        reached[left[np.isfinite(distance_m)]] = True
        reached[number] = True


def branch_to(gap: FloatArray, region: Polygon, routes: Routes, goals: Indices, overlap_m: float) -> LineString:
    """From a gap straight to the region where the water allows, else along the middle of the water.

    Parameters
    ----------
    gap
        A place, shape (2,), in metres.
    region
        Where the branch ends.
    routes
        Ways through the free space.
    goals
        Where these ways may enter the region: `routes.goals_in(region)`.
    overlap_m
        How far a straight branch runs on into the region.

    Returns
    -------
    LineString
        From the gap to the region; straight over land where no way leads there.
    """
    straight = _straight(gap, region, routes, overlap_m)
    if straight is not None:
        return straight
    return routes.to_area(gap, region, goals) or shapely.shortest_line(Point(gap), region)


def _straight(gap: FloatArray, region: Polygon, routes: Routes, overlap_m: float) -> LineString | None:
    """Straight to the region and into it; None where the water does not allow that."""
    straight = shapely.shortest_line(Point(gap), region)
    return _lengthened(straight, overlap_m) if shapely.covers(routes.water, straight) else None


def _shortened(line: LineString, by_m: float) -> LineString:
    """The line without its first `by_m` metres: what they would reach is covered from where it now ends."""
    rest = substring(line, by_m, line.length)
    return rest if isinstance(rest, LineString) else line


def _lengthened(line: LineString, extra_m: float) -> LineString:
    """A segment whose second end is moved on by `extra_m`."""
    (start, end) = shapely.get_coordinates(line)
    length = np.hypot(*(end - start))
    return line if length == 0 else LineString([start, end + (end - start) * (extra_m / length)])
