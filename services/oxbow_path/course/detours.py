"""Detours: out from a path to the water that it leaves far away, and back beside the way out.

A walk round a tree grows its region; a course from one place to another has none. A detour needs the path alone:
where a narrow strip of water is crossed by the path once, the path may go round the strip's end as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import LineString, Point, Polygon

from oxbow.arrays import FloatArray, Indices
from oxbow.geometry.route.gate_routes import Inward
from oxbow.tolerances import ROUNDING_M
from oxbow_path.walk.legs import is_plainly_simple
from oxbow_path.walk.region import largest
from oxbow_path.walk.stretch import stretch
from oxbow_path.walk.trial import Waters

__all__ = ["with_detour", "with_detours"]

HALF_WIDTH = 0.12
"""Half width of a detour at first, in spacings: narrow, so that it parts the water that it runs into."""

GAP = 0.02
"""How far a strip keeps from the rest of the path, in half widths."""

SHORT_OF = 0.25
"""How far a detour ends from the place that it is made for, in spacings."""

NARROWINGS = 4
"""How often a strip's width is halved until the path crosses it once."""

ROUNDS = 3

MOST_AT_ONCE = 100
"""At most this many of the places far from the path are looked at in one round."""

LEAST_SHARE = 0.002
"""A length left that is less than this share of the spacing is not worth a detour."""

QUAD_SEGS = 2
"""Strips have ends of few corners: every corner is a waypoint."""


def with_detours(path: LineString, waters: Waters, most_m: float, *, reach_m: float) -> LineString:
    """The path with detours to the places farthest from it, as far as the length goes.

    Parameters
    ----------
    path
        Simple, and inside the free space except for its legs.
    waters
        The water and its probe.
    most_m
        How long the path may become.
    reach_m
        Places nearer than this are near enough.

    Returns
    -------
    LineString
        No longer than `most_m`, unless the given path is; the path itself where no detour fits.
    """
    for _ in range(ROUNDS):
        before_m = path.length
        # Of the path as the round begins: the search costs more than all detours, and serves the whole round.
        ways = _Ways(path, waters)
        for gap in _gaps(path, waters, most_m - before_m, reach_m):
            left_m = most_m - path.length
            if left_m < LEAST_SHARE * waters.spacing_m:
                return path
            path = _detoured(path, ways, gap, left_m) or path
        if path.length - before_m < LEAST_SHARE * waters.spacing_m:
            break
    return path


def _gaps(path: LineString, waters: Waters, left_m: float, reach_m: float) -> Iterator[FloatArray]:
    """Places farther from the path than the reach: as many, evenly apart, as the length left serves."""
    points, distance_m = waters.probe.points, waters.probe.distances(path)
    far = np.flatnonzero(distance_m > reach_m)
    apart_m = waters.spacing_m
    while True:
        chosen = _spread(points[far], distance_m[far], apart_m)
        # A detour goes there and back.
        if len(chosen) < 2 or 2.0 * distance_m[far][chosen].sum() <= max(left_m, 0.0):
            break
        apart_m *= 1.5
    return iter(points[far][chosen][:MOST_AT_ONCE])


def _spread(points: FloatArray, distance_m: FloatArray, apart_m: float) -> Indices:
    """Indices of points at least `apart_m` from one another, those farthest from the path first."""
    taken, chosen = np.zeros(len(points), dtype=bool), []
    index = cKDTree(points) if len(points) else None
    for number in np.argsort(-distance_m, kind="stable").tolist():
        if index is not None and not taken[number]:
            # Places near a chosen one are served by its detour.
            taken[index.query_ball_point(points[number], apart_m)] = True
            chosen.append(number)
    return np.array(chosen, dtype=np.intp)


class _Ways:
    """Ways to a path: searched once, when the first is asked for, and still used once the path has detours."""

    def __init__(self, path: LineString, waters: Waters) -> None:
        self._path = path
        self.waters = waters

    @cached_property
    def inward(self) -> Inward:
        routes = self.waters.routes
        return routes.into(self._path, routes.goals_near(self._path, HALF_WIDTH * self.waters.spacing_m))


def with_detour(path: LineString, waters: Waters, gap: FloatArray, left_m: float) -> LineString | None:
    """The path with one detour all the way to a place; None where none fits.

    Parameters
    ----------
    path
        Simple, and inside the free space except for its legs.
    waters
        The water and its routes.
    gap
        The place, shape (2,), in metres.
    left_m
        How much longer the path may become.

    Returns
    -------
    LineString or None
        Longer than the path by no more than `left_m`.
    """
    return _detoured(path, _Ways(path, waters), gap, left_m, short_of=0.0)


def _detoured(
    path: LineString, ways: _Ways, gap: FloatArray, left_m: float, *, short_of: float = SHORT_OF
) -> LineString | None:
    waters = ways.waters
    out = _way_out(path, ways, gap)
    half_width_m = HALF_WIDTH * waters.spacing_m
    for _ in range(NARROWINGS):
        length_m = min(out.length - short_of * waters.spacing_m, (left_m - 2 * half_width_m) / 2)
        if length_m > half_width_m:
            longer = _round(path, _end_of(out, length_m), waters, half_width_m)
            if longer is not None and longer.length - path.length <= left_m:
                return longer
        # A narrower strip touches less of the path: one that was crossed twice may be crossed once.
        half_width_m /= 2
    return None


def _way_out(path: LineString, ways: _Ways, gap: FloatArray) -> LineString:
    """From the path to a place: straight where the water allows it, else along the middle of the water."""
    waters = ways.waters
    straight = LineString(shapely.get_coordinates(shapely.shortest_line(path, Point(gap))))
    if shapely.covers(waters.passable.free_and_rounding, straight):
        return straight
    way = ways.inward.route(gap)
    if way is None:
        return straight
    # The path may have been led along this very way since: what is beside it is no way to it.
    points = shapely.get_coordinates(way)
    met = np.flatnonzero(shapely.dwithin(shapely.points(points), path, HALF_WIDTH * waters.spacing_m))
    # At 0 the place itself is that near, and the way there is all there is.
    if len(met) and met[0] > 0:
        way = LineString(points[: met[0] + 1])
    crossed = shapely.get_coordinates(way.intersection(path))
    end_m = min((way.project(Point(place)) for place in crossed), default=way.length)
    way = _part(way, 0.0, end_m) if end_m > ROUNDING_M else way
    onto = shapely.get_coordinates(shapely.shortest_line(Point(way.coords[-1]), path))[1]
    return LineString(np.vstack([onto, shapely.get_coordinates(way)[::-1]]))


def _end_of(out: LineString, length_m: float) -> LineString:
    return _part(out, 0.0, length_m)


def _part(line: LineString, start_m: float, end_m: float) -> LineString:
    """A line from one distance along it to another; the whole line where these are one place."""
    points = stretch(line, start_m, end_m)
    return LineString(points) if len(points) > 1 else line


def _round(path: LineString, out: LineString, waters: Waters, half_width_m: float) -> LineString | None:
    """The path led round a strip along a line that starts on it; None where it crosses the strip repeatedly."""
    strip = _strip(out, waters, half_width_m)
    held = [shapely.covers(strip, end) for end in shapely.points([path.coords[0], path.coords[-1]])]
    if held == [True, False] and not _is_leg(path, waters):
        longer = _from_end(path, out, waters, half_width_m)
    elif held == [False, True] and not _is_leg(path.reverse(), waters):
        longer = _from_end(path.reverse(), out, waters, half_width_m)
        longer = None if longer is None else longer.reverse()
    else:
        longer = _past(path, strip, waters, GAP * half_width_m)
    # Simple by rounding alone, a path would not stay so.
    return longer if longer is not None and is_plainly_simple(longer) else None


def _strip(out: LineString, waters: Waters, half_width_m: float) -> Polygon:
    return largest(out.buffer(half_width_m, quad_segs=QUAD_SEGS).intersection(waters.free))


def _is_leg(path: LineString, waters: Waters) -> bool:
    """Whether a path begins outside the free space."""
    first = LineString(path.coords[:2])
    return not shapely.covers(waters.passable.free_and_rounding, first)


def _crossing(path: LineString, strip: Polygon, gap_m: float) -> LineString | None:
    """Where a path crosses a strip or is nearer to it than a gap; None unless it does so once.

    Strips in narrow water end at its rim, where the path may run already: it touches them there, or by rounding
    crosses them many times.
    """
    if strip.is_empty or strip.interiors:
        return None
    crossed = shapely.line_merge(path.intersection(strip.buffer(gap_m, quad_segs=QUAD_SEGS)))
    return crossed if isinstance(crossed, LineString) and crossed.length >= ROUNDING_M else None


def _past(path: LineString, strip: Polygon, waters: Waters, gap_m: float) -> LineString | None:
    """A path led round a strip that it crosses."""
    crossed = _crossing(path, strip, gap_m)
    if crossed is None:
        return None
    start_m, end_m = sorted(path.project(shapely.points(crossed.coords[i])) for i in (0, -1))
    if end_m - start_m > crossed.length + ROUNDING_M:
        # The strip holds the path's two ends, which are one place.
        return None
    head, tail = (shapely.get_coordinates(_part(path, *ends)) for ends in ((0.0, start_m), (end_m, path.length)))
    way = np.vstack([head[-1:], _way_round(strip, head[-1], tail[0]), tail[:1]])
    if not shapely.covers(waters.passable.free_and_rounding, LineString(way)):
        return None
    # The ends of `head` and `tail` are in the way already.
    longer = LineString(np.vstack([head[:-1], way, tail[1:]]))
    return LineString(shapely.remove_repeated_points(longer, ROUNDING_M).coords)


def _from_end(path: LineString, out: LineString, waters: Waters, half_width_m: float) -> LineString | None:
    """A path that begins in a strip, led out along its middle first, and back along its border."""
    start = Point(path.coords[0])
    onward = shapely.get_coordinates(_part(out, out.project(start), out.length))
    out = LineString(shapely.remove_repeated_points(LineString(np.vstack([path.coords[0], onward])), ROUNDING_M))
    strip = _strip(out, waters, half_width_m)
    crossed = _crossing(path, strip, GAP * half_width_m)
    if crossed is None or not shapely.covers(strip, out):
        return None
    leaves_m = max(path.project(shapely.points(crossed.coords[i])) for i in (0, -1))
    if leaves_m > crossed.length + ROUNDING_M:
        return None
    tail = shapely.get_coordinates(_part(path, leaves_m, path.length))
    ring = LineString(strip.exterior)
    turn = shapely.get_coordinates(shapely.shortest_line(Point(out.coords[-1]), ring))[1]
    back = np.vstack([turn, _way_along(strip, turn, tail[0], longer=False), tail[:1]])
    if not shapely.covers(waters.passable.free_and_rounding, LineString(back)):
        return None
    longer = LineString(np.vstack([shapely.get_coordinates(out), back, tail[1:]]))
    return LineString(shapely.remove_repeated_points(longer, ROUNDING_M).coords)


def _way_round(strip: Polygon, start: FloatArray, end: FloatArray) -> FloatArray:
    """The longer way along a strip's border from one of its places to another, without the two."""
    return _way_along(strip, start, end, longer=True)


def _way_along(strip: Polygon, start: FloatArray, end: FloatArray, *, longer: bool) -> FloatArray:
    """The longer or shorter way along a strip's border from one of its places to another, without the two."""
    ring = LineString(strip.exterior)
    first_m, last_m = sorted(ring.project(Point(place)) for place in (start, end))
    between = shapely.get_coordinates(_part(ring, first_m, last_m))
    around = np.vstack(
        [
            shapely.get_coordinates(_part(ring, last_m, ring.length)),
            shapely.get_coordinates(_part(ring, 0.0, first_m)) if first_m > 0.0 else between[:0],
        ]
    )
    # The border is closed: its two ways between the places are the stretch between them and the rest.
    way = between if (last_m - first_m >= ring.length / 2) == longer else around
    is_forward = np.hypot(*(way[0] - start)) <= np.hypot(*(way[-1] - start))
    return way if is_forward else way[::-1]
