"""Whether a path keeps the rules: in the water, clear of the shore but for its legs, and never across itself.

Paths are judged against the mission's own water, not a planner's picture of it. The certificate reports these
figures, and the pipeline computes them once more before a plan leaves, so that no single wrong stage can send a
boat ashore.

A *leg* is the stretch of a path next to its launch or recovery point that runs nearer to the shore than the
safety distance. The point itself makes a leg necessary where it lies ashore, in a harbour or up a creek. Whatever
exceeds that is a fault, and so is any breach between the legs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import LineString, MultiLineString, MultiPolygon, Point, Polygon, STRtree
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from oxbow.arrays import FloatArray, Geometries, Place
from oxbow.contracts import Fault, Leg, Rule
from oxbow.geometry.narrows import DETOUR, direct_leg_m, is_basin, without_narrows
from oxbow.geometry.rings import runs_of
from oxbow.geometry.route.gate_routes import Routes
from oxbow.geometry.stretches import PathSegments, clipped_stretches, covered_m, gaps_between, merged_stretches
from oxbow.tolerances import ROUNDING_M

__all__ = ["SHORE_TOLERANCE_M", "Conduct", "Shore", "crossings_of", "strays"]

SHORE_TOLERANCE_M = 0.01
"""A path this close to the shore is on it, and shorter stretches do not count: the seventh decimal of a degree is
a centimetre."""

SAME_PLACE_M = 1.0
"""A path that begins farther than this from its launch point has no leg there that could be excused."""

SAFETY_SHARE = 0.99
"""The share of the safety distance that must be kept: eroded contours are polygons, not arcs."""

OPEN_SHARE = 2.0
"""A safe stretch shorter than this many safety distances does not end a leg, wherever it is."""

BASIN_SHARE = 1.05
"""Water farther from the shore than this many safety distances is free, whatever the planner simplified."""

LOOK_SHARE = 4.0
"""A basin is distinguished from a wide spot of a creek by this many safety distances of a safe stretch."""

RUN = 8
"""Edges of the shore per entry of the index."""

QUAD_SEGS = 16
_CHUNK = 512


@dataclass(frozen=True)
class Conduct:
    """How a path keeps the rules of the water.

    Parameters
    ----------
    outside_m
        Metres outside the water, those of the legs included; the shore itself, to 1 cm, is inside.
    unsafe_m
        Metres nearer to the shore than 99 % of the safety distance, beyond what the legs need.
    legs
        Of the launch and of the recovery.
    faults
        Every broken rule; empty for a path that is fit to follow.
    """

    outside_m: float
    unsafe_m: float
    legs: tuple[Leg, Leg]
    faults: tuple[Fault, ...]

    @property
    def crossings(self) -> int:
        """Pairs of segments that meet."""
        return sum(fault.count for fault in self.faults if fault.rule is Rule.CROSSING)


class Shore:
    """The shore of a mission's water, prepared to judge paths against.

    Time and memory grow with the vertices of the shore and the stretches of path near it, not with the area.

    Parameters
    ----------
    water
        The outline less the forbidden zones.
    safety_m
        The distance that paths keep from its boundary.
    least_width_m
        A vehicle cannot take to the water where it is narrower than this.
    """

    def __init__(self, water: Polygon | MultiPolygon, safety_m: float, least_width_m: float = 0.0) -> None:
        self.water = water
        self.safety_m = safety_m
        self.least_width_m = least_width_m
        shapely.prepare(water)

    @cached_property
    def _runs(self) -> STRtree:
        """The boundary in runs of a few edges."""
        rings = shapely.get_rings(shapely.get_parts(self.water))
        return STRtree(np.concatenate([runs_of(shapely.get_coordinates(ring), RUN) for ring in rings]))

    @cached_property
    def _parts(self) -> Geometries:
        """The parts of the water that a vehicle fits into."""
        return shapely.get_parts(without_narrows(self.water, self.least_width_m))

    def conduct(self, path: LineString, launch: Place, recovery: Place) -> Conduct:
        """How a path from `launch` to `recovery` keeps the rules.

        Parameters
        ----------
        path
            From launch to recovery, in metres; of positive length.
        launch, recovery
            Where the vehicle starts and ends. A path that begins or ends more than 1 m away has no leg there.

        Returns
        -------
        Conduct
            With the launch's leg first; its faults are in the order outside, unsafe, legs, crossings.
        """
        # Where the path leaves the water, and where it comes too near to the shore.
        segments = PathSegments.of(path)
        outside = self._outside(segments)
        unsafe = self._unsafe(segments, outside)
        # How far each leg reaches, and what of both kinds of stretches falls to it.
        total_m = segments.length_m
        # A path that begins elsewhere has no leg: what would excuse one is the place that it leaves.
        off_m = shapely.distance(
            shapely.points([launch, recovery]), shapely.points(segments.ends[[0, -1], [0, 1]])
        )
        out_m, home_m = np.where(off_m > SAME_PLACE_M, 0.0, self._leg_lengths(path, unsafe)).tolist()
        ends = (_End("launch", launch, 0.0, out_m), _End("recovery", recovery, total_m, total_m - home_m))
        legs = [
            self._leg(end, path, clipped_stretches(outside, *end.stretch), clipped_stretches(unsafe, *end.stretch))
            for end in ends
        ]
        # What is left lies between the legs, where nothing excuses it.
        between = ends[0].open_m, ends[1].open_m
        faults = [
            *_stretch_faults(Rule.OUTSIDE, path, clipped_stretches(outside, *between)),
            *_stretch_faults(Rule.UNSAFE, path, clipped_stretches(unsafe, *between)),
            *(fault for end, leg in zip(ends, legs, strict=True) for fault in _leg_faults(end, leg, path)),
            *crossings_of(path),
        ]
        excess_m = sum(fault.metres for fault in faults if fault.rule is Rule.UNSAFE)
        return Conduct(covered_m(outside), excess_m, (legs[0], legs[1]), tuple(faults))

    def _outside(self, segments: PathSegments) -> FloatArray:
        """Stretches that lie in no water: a path changes sides only where it is near to the shore."""
        beyond = gaps_between(self._near(segments, SHORE_TOLERANCE_M), segments.length_m)
        return beyond[~shapely.contains_xy(self.water, segments.at(beyond.mean(axis=1)))]

    def _unsafe(self, segments: PathSegments, outside: FloatArray) -> FloatArray:
        distance_m = SAFETY_SHARE * self.safety_m
        if distance_m <= SHORE_TOLERANCE_M:
            return outside
        # Far inland no shore is near: only together do the two cover a path over land.
        return merged_stretches(np.vstack([outside, self._near(segments, distance_m)]))

    def _near(self, segments: PathSegments, distance_m: float) -> FloatArray:
        """Stretches of a path that are nearer to the shore than a distance."""
        found = [np.empty((0, 2))]
        # In parts: in a path that is one tangle along the shore, pairs grow with the square of its length.
        for first in range(0, len(segments.lines), _CHUNK):
            lines = segments.lines[first : first + _CHUNK]
            segment, run = self._runs.query(lines, predicate="dwithin", distance=distance_m)
            # Each run is buffered once, however many segments come near to it.
            near, back = np.unique(run, return_inverse=True)
            bands = shapely.buffer(self._runs.geometries[near], distance_m, quad_segs=QUAD_SEGS)
            parts, pair = shapely.get_parts(shapely.intersection(lines[segment], bands[back]), return_index=True)
            found.append(segments.stretches(parts, first + segment[pair]))
        return merged_stretches(np.vstack(found))

    def _leg_lengths(self, path: LineString, unsafe: FloatArray) -> tuple[float, float]:
        """How far a path's first and its last leg reach.

        Where a path never comes to open water, its legs are only the unsafe stretches at its very ends.
        """
        out_m = self._reach_m(path, unsafe)
        # Reversed both ways, stretches of the reversed path begin before they end, and are in order again.
        home_m = self._reach_m(path.reverse(), path.length - unsafe[::-1, ::-1])
        if out_m + home_m < path.length:
            return out_m, home_m
        # All of it is near the shore: only what begins or ends with the path itself is a leg.
        begins, ends = unsafe[:, 0] <= ROUNDING_M, unsafe[:, 1] >= path.length - ROUNDING_M
        if (begins & ends).any():
            return 0.0, 0.0
        return float(unsafe[begins, 1].sum()), float((path.length - unsafe[ends, 0]).sum())

    def _reach_m(self, path: LineString, unsafe: FloatArray) -> float:
        """How far the leg at a path's start reaches: to the first safe stretch in a basin."""
        reach_m = 0.0
        open_m = max(OPEN_SHARE * self.safety_m, SHORE_TOLERANCE_M)
        for start_m, end_m in unsafe.tolist():
            if start_m - reach_m > open_m and self._is_basin(path, reach_m, start_m):
                break
            reach_m = end_m
        return reach_m

    def _is_basin(self, path: LineString, start_m: float, end_m: float) -> bool:
        """Whether a safe stretch of a path lies in a basin, as the planner understands it."""
        if self.safety_m == 0.0:
            return True
        stretch = substring(path, start_m, min(end_m, start_m + LOOK_SHARE * self.safety_m))
        # A path along the edge of the eroded water runs beside the certainly free water: as far from it as the two
        # shares differ, and as much again to spare.
        near_m = 2.0 * (BASIN_SHARE - SAFETY_SHARE) * self.safety_m
        return bool(shapely.dwithin(self._basins_beside(stretch), stretch, near_m).any())

    def _basins_beside(self, way: BaseGeometry) -> Geometries:
        """The basins among the parts of the certainly free water near a way."""
        distance_m = BASIN_SHARE * self.safety_m
        beside = way.buffer(OPEN_SHARE * self.safety_m)
        near = self._runs.query(beside, predicate="dwithin", distance=distance_m)
        bands = shapely.buffer(self._runs.geometries[near], distance_m, quad_segs=QUAD_SEGS)
        free = shapely.get_parts(beside.intersection(self.water).difference(shapely.union_all(bands)))
        return free[[is_basin(part, self.safety_m, self.least_width_m) for part in free]]

    def _leg(self, end: _End, path: LineString, outside: FloatArray, unsafe: FloatArray) -> Leg:
        """A leg, and what its place makes necessary."""
        # The water that the leg leads to: the nearest to a place ashore may be a pond behind it.
        water = self._parts[np.argmin(shapely.distance(self._parts, path.interpolate(end.open_m)))]
        unsafe_m, ashore_m = covered_m(unsafe), float(water.distance(Point(end.place)))
        # A leg straight off the shore is always excused; a longer one only by the shortest way that there is.
        direct_m = direct_leg_m(self.safety_m, ashore_m)
        # The shortest way takes a triangulation: computed only where the direct length does not excuse the leg.
        return Leg(
            unsafe_m=unsafe_m,
            ashore_m=covered_m(outside),
            least_ashore_m=self._least_ashore_m(Point(end.place)),
            most_unsafe_m=direct_m if unsafe_m <= direct_m else direct_m + DETOUR * self._shortest_m(end, path),
        )

    def _least_ashore_m(self, place: Point) -> float:
        """How far a vehicle is carried over land: from a place ashore straight to the nearest water, whatever its
        room, and from one in the water, however narrow, not at all.
        """
        nearest = self._parts[np.argmin(shapely.distance(self._parts, place))]
        way = shapely.shortest_line(place, nearest)
        if way.length <= ROUNDING_M:
            return 0.0
        # Only the land next to the place: beyond it may lie water that is too narrow, and more land behind that.
        land = shapely.get_parts(way.difference(self.water))
        return float(shapely.length(land[shapely.distance(land, place) <= ROUNDING_M]).sum())

    def _shortest_m(self, end: _End, path: LineString) -> float:
        """The length of the shortest way from a place to open water, searched for beside a leg, in metres.

        Open water is where the leg ends, and any basin that it passes on its way there.
        """
        way = substring(path, *end.stretch)
        # Only the water beside the leg is triangulated: a whole lake would take long.
        parts = shapely.get_parts(way.buffer(OPEN_SHARE * self.safety_m).intersection(self.water))
        water = parts[np.argmin(shapely.distance(parts, path.interpolate(end.open_m)))]
        start = shapely.get_coordinates(shapely.shortest_line(water, Point(end.place)))[0]
        basins = self._basins_beside(way)
        open_end = path.interpolate(end.open_m).buffer(self.safety_m)
        # The end of the leg counts as open water even where no basin is recognised there.
        goal = shapely.union_all([*basins, open_end]).intersection(water)
        if goal.is_empty or goal.covers(Point(start)):
            return 0.0
        routes = Routes(water, self.safety_m)
        route = routes.to_area(start, goal, routes.goals_in(goal))
        return 0.0 if route is None else float(route.difference(goal).length)


@dataclass(frozen=True)
class _End:
    """An end of a path: its name and place, where along the path it is, and where open water begins."""

    name: str
    place: Place
    at_m: float
    open_m: float

    @property
    def stretch(self) -> tuple[float, float]:
        """The leg, from and to metres along the path."""
        return min(self.at_m, self.open_m), max(self.at_m, self.open_m)


def strays(path: LineString, free: BaseGeometry, launch: Place, recovery: Place) -> list[BaseGeometry]:
    """The stretches of a path outside a free space that are not legs: they touch neither launch nor recovery.

    Parameters
    ----------
    path
        From launch to recovery, in metres.
    free
        Where the path should stay, to within rounding.
    launch, recovery
        What begins or ends at one of these places is a leg.

    Returns
    -------
    list of geometries
        Line strings longer than rounding; empty where the path keeps to the free space but for its legs.
    """
    segments = np.asarray(PathSegments.of(path).lines)
    grown = free.buffer(ROUNDING_M)
    shapely.prepare(grown)
    # Only segments that leave go through the difference, which takes far longer than the test.
    leaving = segments[~shapely.covers(grown, segments)]
    # Merged, since a leg is one stretch of many segments, of which only the first touches its place.
    outside = shapely.get_parts(shapely.line_merge(MultiLineString(list(leaving)).difference(grown)))
    ends = shapely.points([launch, recovery])
    is_leg = shapely.dwithin(outside[:, None], ends, ROUNDING_M).any(axis=1)
    return list(outside[~is_leg & (shapely.length(outside) > ROUNDING_M)])


def crossings_of(path: LineString) -> tuple[Fault, ...]:
    """Where a path meets itself, neighbouring segments aside: empty if and only if the path is simple.

    One fault: its `metres` are 0, and `count` is the number of pairs of segments that meet. The first and the last
    segment of a closed path are neighbours. A path that only folds back upon its end counts as one crossing.
    """
    if shapely.is_simple(path):
        return ()
    lines = PathSegments.of(path).lines
    last = len(lines) - 1
    # It does cross itself: count the pairs, and keep the first for the place to report.
    tree = STRtree(lines)
    count, place = 0, shapely.get_coordinates(path)[-1]
    # In parts: in a path that is one tangle, the number of pairs grows with the square of its length.
    for start in range(0, len(lines), _CHUNK):
        i, j = tree.query(lines[start : start + _CHUNK], predicate="intersects")
        i += start
        # Each pair is met twice, once either way: it counts where the second segment is the later one.
        meets = ~((j <= i + 1) | (path.is_closed & (i == 0) & (j == last)))
        if count == 0 and meets.any():
            first = np.flatnonzero(meets)[0]
            place = shapely.get_coordinates(lines[i[first]].intersection(lines[j[first]]))[0]
        count += int(np.count_nonzero(meets))
    return (Fault(rule=Rule.CROSSING, count=max(count, 1), place=(float(place[0]), float(place[1]))),)


def _stretch_faults(rule: Rule, path: LineString, stretches: FloatArray) -> Iterator[Fault]:
    metres = covered_m(stretches)
    if metres > SHORE_TOLERANCE_M:
        longest = stretches[np.argmax(stretches[:, 1] - stretches[:, 0])]
        place = path.interpolate(longest.mean())
        yield Fault(rule=rule, metres=metres, place=(place.x, place.y))


def _leg_faults(end: _End, leg: Leg, path: LineString) -> Iterator[Fault]:
    middle = path.interpolate(sum(end.stretch) / 2)
    place = (middle.x, middle.y)
    over_land_m = leg.ashore_m - leg.least_ashore_m
    if over_land_m > SHORE_TOLERANCE_M:
        yield Fault(rule=Rule.OUTSIDE, metres=over_land_m, place=place, leg=end.name)
    if leg.unsafe_m > leg.most_unsafe_m:
        yield Fault(rule=Rule.UNSAFE, metres=leg.unsafe_m - leg.most_unsafe_m, place=place, leg=end.name)
