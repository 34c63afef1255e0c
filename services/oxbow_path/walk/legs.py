"""Legs: from the launch point to the ring, and from the ring to the recovery point.

Equal points give one closed ring: out at one place, back in beside it. Points apart give an open path that still
travels the whole ring: round one side of the region from launch to recovery, back through its middle, and
round the other side. (The report, Rendas and Li 2016, section 1.2.1.2, treats only equal points.)

`oxbow_path.approach` makes legs of another kind, from gate to gate: both ways run beside a middle line, in
water wide enough for them. Here a leg ends on the ring, and the way back opens from nothing, however narrow the
water.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from shapely import LinearRing, LineString, Point, Polygon
from shapely.affinity import rotate
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray
from oxbow.errors import Infeasible, Internal
from oxbow.geometry.route.gate_routes import Routes
from oxbow.tolerances import HAIR_M, ROUNDING_M
from oxbow_path.walk.access import BESIDE_LEG, Access
from oxbow_path.walk.region import largest
from oxbow_path.walk.stretch import stretch

__all__ = ["Passable", "is_plainly_simple", "path_with_legs"]

OTHER_DETAIL = 0.83
"""Change of the detail from one attempt to the next."""

NEAR = 1.0
"""Places nearer to each other than this, in details of the way through the region, need no way through it."""

SKIPPED = 2.0
"""At most this much of the ring, in the same measure, may lie between them and be left out."""

SIGHTS = 200
"""At most this many places of the ring, the nearest, are tried for one in sight of an entry."""

BESIDE = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Where the opening's middle is tried, in openings from where the leg meets the ring: beside it, where the leg
keeps to one bank, or where the ring has a sharp corner of which one side alone is in sight."""

HALVINGS = 12
"""How often the opening of the ring may be halved until the legs fit."""


@dataclass(frozen=True)
class Passable:
    """Where a path may run except for its legs."""

    free: Polygon

    @cached_property
    def free_and_rounding(self) -> BaseGeometry:
        """The free space, and what rounding adds to it."""
        grown = self.free.buffer(ROUNDING_M)
        shapely.prepare(grown)
        return grown

    def outside(self, path: LineString) -> BaseGeometry:
        """What of a path lies outside the free space."""
        points = shapely.get_coordinates(path)
        segments = np.asarray(shapely.linestrings(np.stack([points[:-1], points[1:]], axis=1)))
        stray = segments[~shapely.covers(self.free_and_rounding, segments)]
        return shapely.union_all(shapely.difference(stray, self.free_and_rounding))


def path_with_legs(
    region: Polygon,
    launch: Access,
    recovery: Access,
    passable: Passable,
    *,
    opening_m: float,
    detail_m: float,
) -> LineString:
    """The path: leg, ring, leg.

    Parameters
    ----------
    region
        The walk's region; both entries lie in it or on its boundary.
    launch, recovery
        How the two points are reached.
    passable
        The free space, which only the legs may leave.
    opening_m
        Width of the ring's opening at most; it is a tenth of the shorter leg, and halved until the legs fit
        through without a crossing.
    detail_m
        How finely the way through the region follows its middle, at first.

    Returns
    -------
    LineString
        Simple, from launch to recovery, and inside the free space but for its legs.

    Raises
    ------
    Infeasible
        A leg has to pass water too narrow for the way back beside the way out.
    Internal
        No opening gives a simple path: a fault of the construction.
    """
    # No wider than the way back may stray from a leg, nor than a small ring can spare.
    lengths = [BESIDE_LEG * leg.line.length for leg in (launch, recovery) if leg.line.length > ROUNDING_M]
    opening_m = min([opening_m, region.exterior.length / 8, *lengths])
    allowed = launch.beside.union(recovery.beside)
    out = _led_to_ring(region, launch, recovery, passable, detail_m)
    for _ in range(HALVINGS):
        for path in _candidates(region, out, recovery, passable, opening_m, detail_m):
            if is_plainly_simple(path) and _are_legs(passable.outside(path), allowed, launch, recovery):
                return path
        # Another detail makes another triangulation, whose way may keep clear of what this one touched.
        opening_m, detail_m = opening_m / 2, detail_m * OTHER_DETAIL
    # Nothing fits. A winding leg is the mission's fault; a straight one leaves room: the construction failed.
    for leg, where in ((launch, "launch"), (recovery, "recovery")):
        if leg.winds:
            raise Infeasible(
                "can be reached only through water too narrow for a way back beside the way out", where
            )
    raise Internal(f"the legs from {launch.place} and to {recovery.place} do not fit the ring", "legs")


def _are_legs(outside: BaseGeometry, allowed: BaseGeometry, launch: Access, recovery: Access) -> bool:
    """Whether what of a path lies outside the free space begins or ends it, and keeps to where legs may run."""
    parts = shapely.get_parts(shapely.line_merge(outside))
    parts = parts[shapely.length(parts) > ROUNDING_M]
    ends = shapely.points([launch.place, recovery.place])
    begins = shapely.dwithin(parts[:, None], ends[None], ROUNDING_M).any(axis=1)
    return bool(begins.all()) and outside.difference(allowed).length < ROUNDING_M


def is_plainly_simple(path: LineString) -> bool:
    """Whether a path is simple, and stays so when turned: not by rounding alone."""
    return bool(path.is_simple and rotate(path, 1.0, use_radians=True).is_simple)


def _candidates(
    region: Polygon, launch: Access, recovery: Access, passable: Passable, opening_m: float, detail_m: float
) -> Iterator[LineString]:
    # From one place: one ring, out and back beside one another.
    if launch.place == recovery.place:
        yield from _closed(region.exterior, launch, launch, passable.free_and_rounding, opening_m)
        return
    # Up one creek: the two legs become one as soon as they meet, and the ring is closed again.
    if _meet(launch, recovery):
        out, home = launch.along(recovery), recovery.along(launch)
        yield from _closed(region.exterior, out, home, passable.free_and_rounding, opening_m)
    # Entries beside each other: nearly the whole ring lies between them the long way round.
    elif shapely.distance(launch.entry, recovery.entry) <= NEAR * detail_m:
        skipped_m = SKIPPED * detail_m
        yield from _round(region.exterior, launch, recovery, passable.free_and_rounding, opening_m, skipped_m)
    # What the region encloses may be land.
    inside = largest(region.intersection(passable.free))
    if _on(region.exterior, recovery) and not _on(region.exterior, launch):
        yield from (path.reverse() for path in _open(inside, recovery, launch, opening_m, detail_m))
    else:
        yield from _open(inside, launch, recovery, opening_m, detail_m)


def _meet(launch: Access, recovery: Access) -> bool:
    """Whether two legs meet before the free space, as those of two places up one creek do."""
    is_long = min(launch.line.length, recovery.line.length) > ROUNDING_M
    return is_long and bool(shapely.dwithin(launch.line, recovery.line, ROUNDING_M))


def _on(ring: LinearRing, access: Access) -> bool:
    return bool(shapely.dwithin(access.entry, ring, ROUNDING_M))


def _led_to_ring(region: Polygon, launch: Access, recovery: Access, passable: Passable, detail_m: float) -> Access:
    """A leg, led on through the region where none of its ring is in sight, as from an islet amid others.

    It keeps off the recovery point, which is reached from the other end of the ring.
    """
    ring, sight = LineString(region.exterior), passable.free_and_rounding
    at = ring.interpolate(_meeting(ring, launch.entry, sight))
    if shapely.covers(sight, LineString([launch.entry, at])):
        return launch
    inside = largest(region.intersection(passable.free))
    if launch.place != recovery.place:
        inside = largest(inside.difference(recovery.entry.buffer(HAIR_M)))
    way = Routes(inside, detail_m).between(launch.leg[-1], shapely.get_coordinates(at)[0])
    return replace(launch, leg=np.vstack([launch.leg[:-1], way]) if launch.line.length > 0 else way)


def _meeting(ring: LineString, entry: Point, free: BaseGeometry) -> float:
    """Where along the ring a leg meets it: at the nearest place that is in sight, or else at the nearest."""
    places = np.vstack(
        [shapely.get_coordinates(ring.interpolate(ring.project(entry))), shapely.get_coordinates(ring)]
    )
    start = shapely.get_coordinates(entry)
    nearest = places[np.argsort(np.hypot(*(places - start).T), kind="stable")[:SIGHTS]]
    nearest_first = np.asarray(
        shapely.linestrings(np.stack([np.broadcast_to(start, nearest.shape), nearest], axis=1))
    )
    seen = nearest_first[shapely.covers(free, nearest_first)]
    sight = seen[0] if len(seen) else nearest_first[0]
    return float(ring.project(Point(sight.coords[-1])))


def _closed(
    ring: LinearRing, launch: Access, recovery: Access, free: BaseGeometry, opening_m: float
) -> Iterator[LineString]:
    """Out to the ring, round it, and back beside the way out: to the same place, or to another on the way."""
    line = LineString(ring)
    at = _meeting(line, launch.entry, free)
    trips = []
    for beside, side in itertools.product(BESIDE, (1.0, -1.0)):
        middle = at + beside * opening_m
        round_trip = _part(line, middle + opening_m / 2, middle - opening_m / 2)
        back = _beside(recovery, opening_m, side)[::-1]
        trips += [(round_trip, side, back), (round_trip[::-1], side, back)]
    for trip, _, back in trips:
        yield _chain(launch.leg[:-1], trip, back)
    if not _on(ring, launch):
        # The ring is farther away than the leg is straight: on from the entry, the ways run beside one another.
        for trip, side, back in trips:
            yield _chain(launch.leg, trip, _aside(launch.leg[-1], trip[-1], side * opening_m / 2), back)


def _round(
    ring: LinearRing,
    launch: Access,
    recovery: Access,
    free: BaseGeometry,
    opening_m: float,
    skipped_m: float,
) -> Iterator[LineString]:
    """Out to the ring, round nearly all of it, and home from where it comes near to the recovery point.

    Places on two banks of a canal are near, too; but between them lies half the ring.
    """
    line = LineString(ring)
    start, end = (_meeting(line, leg.entry, free) for leg in (launch, recovery))
    for side in (0.5, -0.5):
        for onward, back in ((start + side * opening_m, end), (start, end + side * opening_m), (start, end)):
            for trip in (_part(line, onward, back), _part(line, back, onward)[::-1]):
                if LineString(trip).length >= line.length - skipped_m:
                    yield _chain(launch.leg, trip, recovery.leg[::-1])


def _aside(place: FloatArray, towards: FloatArray, offset_m: float) -> FloatArray:
    """A place (1, 2) moved to the left of the way to another."""
    east, north = (towards - place) / np.hypot(*(towards - place))
    return np.asarray(place + offset_m * np.array([[-north, east]]))


def _beside(access: Access, offset_m: float, side: float) -> FloatArray:
    """The way back along a leg, without its entry: moved aside, over land by a hair, then ever farther."""
    leg = access.leg
    # The offset is 0 at the place, where both ways meet, and grows to the whole of it at the ring.
    steps = np.hypot(*np.diff(leg, axis=0).T)
    if len(leg) <= 2 or steps.sum() == 0:
        return leg[:1]
    along_m = np.cumsum(steps)[:-1]
    afloat_m = np.maximum(along_m - access.land_m, 0.0) / max(steps.sum() - access.land_m, ROUNDING_M)
    aside_m = (HAIR_M if access.ashore else 0.0) + offset_m * afloat_m
    # At a vertex, square to the line between its neighbours, so that the way back keeps to one side of every
    # bend.
    tangent = leg[2:] - leg[:-2]
    if access.ashore:
        tangent[0] = leg[1] - leg[0]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]]) / np.hypot(*tangent.T)[:, None]
    return np.vstack([leg[:1], leg[1:-1] + side * aside_m[:, None] * normal])


def _open(
    inside: Polygon, launch: Access, recovery: Access, opening_m: float, detail_m: float
) -> Iterator[LineString]:
    """Round the ring, and through its inside to the recovery point.

    Where the recovery point lies inside, the whole ring is travelled first. Otherwise the way through the inside
    divides the ring: one side, back through the middle, the other side.
    """
    line = LineString(inside.exterior)
    sight = inside.buffer(ROUNDING_M)
    start, end = (_meeting(line, leg.entry, sight) for leg in (launch, recovery))
    inner_leg = LineString([*launch.leg, *line.interpolate(start).coords])
    # The way through must not touch the launch's own leg where that leads across the inside.
    through = Routes(_without(inside, inner_leg, opening_m / 16), detail_m)
    if not _on(inside.exterior, recovery):
        ring = _part(line, start, start - opening_m)
        way = through.between(ring[-1], recovery.leg[-1])
        for out in (launch.leg[:-1], launch.leg):
            yield _chain(out, ring, way, recovery.leg[::-1])
        return
    # One side, and the other one: the gap at the start is for the leg, that at the end for the recovery.
    near = _part(line, start, end - opening_m / 2)
    far = _part(line, end + opening_m / 2, start - opening_m)
    way = through.between(near[-1], far[-1])
    # Straight to the ring and home from it, where the legs end on it or short of it; else by way of their ends.
    for out, home in itertools.product((launch.leg[:-1], launch.leg), (recovery.leg[-2::-1], recovery.leg[::-1])):
        yield _chain(out, near, way, far[::-1], home)


def _without(region: Polygon, line: LineString, half_width_m: float) -> Polygon:
    """The region less a line that runs inside it."""
    return largest(region.difference(line.buffer(half_width_m))) if line.length > ROUNDING_M else region


def _part(ring: LineString, start_m: float, end_m: float) -> FloatArray:
    """The stretch of a closed line from one distance along it onward to another, round the seam where need be."""
    start_m, end_m = start_m % ring.length, end_m % ring.length
    if start_m < end_m:
        return stretch(ring, start_m, end_m)
    return np.vstack([stretch(ring, start_m, ring.length), stretch(ring, 0.0, end_m)])


def _chain(*parts: FloatArray) -> LineString:
    """One line through all parts, its ends exact, without points that rounding alone keeps apart."""
    points = np.vstack(parts)
    apart = np.hypot(*np.diff(points, axis=0).T) > ROUNDING_M
    keep = np.concatenate([[True], apart[:-1], [True]])
    # Of the last two places the end stays, and the one before it goes.
    if not apart[-1]:
        keep[np.flatnonzero(keep[1:-1])[-1] + 1] = False
    return LineString(points[keep])
