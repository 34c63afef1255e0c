"""How a vehicle gets to its share of the free space, and home: legs through water that others survey.

A share is planned as a lake of its own. A vehicle whose start lies elsewhere enters it at a *gate* and leaves it
there: its legs keep to the free space, and, like ships, to one side, so that the way home runs beside the way out
and the whole path stays simple.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from msgspec import structs
from shapely import LineString, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from oxbow.arrays import FloatArray, Place
from oxbow.contracts import FreeSpace, Vehicle
from oxbow.contracts.budget import too_short
from oxbow.errors import Infeasible
from oxbow.geometry.route import Landing, RouteMethod, Router, Routes, leg_routes, make_router, way_to
from oxbow.tolerances import HAIR_M, ON_SHORE_M, ROUNDING_M

__all__ = ["Approach", "Harbour"]

APART = 0.1
"""Distance of the way out from the way home at first, as a share of the nominal spacing."""
HALVINGS = 8
"""How often that distance may be halved until both ways fit."""
GATES = 48
"""At most this many places on the rim of a share are tried as its gate."""
NEAR_GATES = 10.0
"""The gates of the way out and home become one where they are within this many leg distances (`apart_m`)."""
OFF_M = 1e-2
"""A leg that strays from the water by no more than this stays in it, as in the certificate."""
OPENING, BESIDE = 0.05, 0.15
"""To each side, the ways out and home open by the first share of the way to the free space, and may run as far
from it as the second: in a corner of the free space, where they part is outside of it."""
FAR = 0.25
"""Legs that take more than this share of a range are warned about: that length is missing from the survey."""
SPARE = 1.001
"""Legs are at most this many times as long as was computed: where they bend, they are drawn in steps."""


@dataclass(frozen=True)
class Approach:
    """What is to be planned in a share, and the legs that the plan is joined to.

    Parameters
    ----------
    space
        The share, as a space of its own.
    launch, recovery
        Where the path in the share begins and ends: the vehicle's own places, or the gate.
    out, home
        Middle lines of the legs, from the start and from the recovery to the gate; None where the place is reached
        without crossing other shares.
    apart_m
        How far legs may run beside their middle lines.
    water
        What legs keep to: the free space, and what lies between it and the vehicle's own places.
    """

    space: FreeSpace
    launch: Place
    recovery: Place
    out: MiddleLine | None = None
    home: MiddleLine | None = None
    apart_m: float = 0.0
    water: BaseGeometry = field(default_factory=Polygon)

    def length_m(self, range_m: float) -> float:
        """The part of a range, in metres, that the legs leave for the share.

        Raises
        ------
        Infeasible
            The legs alone are as long as the range, or longer.
        """
        if self._legs_m >= range_m:
            raise too_short(range_m, self._legs_m, what="the way to the vehicle's share and home")
        return range_m - self._legs_m

    def warnings(self, range_m: float) -> tuple[str, ...]:
        """Warnings about long legs, which leave little length for the survey."""
        if self._legs_m <= FAR * range_m:
            return ()
        return (
            f"the way to its share and home takes {self._legs_m / range_m:.0%} of its {range_m:.0f} m: start it"
            " nearer, or give it more length",
        )

    @cached_property
    def _legs_m(self) -> float:
        """How long the legs may become, with the steps from and to the gate.

        On either side, as far from their middle lines as they may be: nearer to these, their length is between.
        A path between two legs is cut by the width of both, which is what the steps are longer by.
        """
        if self.out is None or self.home is None:
            return sum(leg.length_m for leg in (self.out, self.home) if leg is not None)
        beside_m = (
            self.out.length_beside_m(side * self.apart_m) + self.home.length_beside_m(-side * self.apart_m)
            for side in (1.0, -1.0)
        )
        return SPARE * max(self.out.length_m + self.home.length_m, *beside_m)

    def with_legs(self, path: LineString) -> LineString:
        """A path in the share, with its legs: from the vehicle's start to its recovery.

        Raises
        ------
        Infeasible
            The water is too narrow for both legs.
        """
        if self.out is None and self.home is None:
            return path
        for candidate in self._candidates(shapely.get_coordinates(path)):
            line = candidate.line
            if line.is_simple and all(map(self._keeps_to_water, candidate.legs)):
                return line
        raise Infeasible(
            "can be reached only through water too narrow for a way back beside the way out", "LaunchPoint"
        )

    def _candidates(self, path: FloatArray) -> Iterator[_Candidate]:
        """Legs on either side, with the path either way round, ever nearer to each other."""
        if self.out is None or self.home is None:
            out = None if self.out is None else self.out.points
            home = None if self.home is None else self.home.points[::-1]
            yield _Candidate(out, path, home)
            return
        if self.launch != self.recovery:
            # Two gates: the middle lines themselves may be clear of each other.
            yield _Candidate(self.out.points, path, self.home.points[::-1])
        line = LineString(path)
        # From wide to narrow: `with_legs` takes the first that fits, and legs far apart are the easiest to follow.
        for apart_m in self.apart_m * 0.5 ** np.arange(HALVINGS):
            for side, way in itertools.product((1.0, -1.0), self._ways_round(line, apart_m)):
                yield _Candidate(self.out.beside(side * apart_m), way, self.home.beside(-side * apart_m)[::-1])

    def _ways_round(self, line: LineString, apart_m: float) -> list[FloatArray]:
        """The path between the gates; either way round, and open by the width of both legs, where they are one."""
        if self.launch != self.recovery:
            return [shapely.get_coordinates(line)]
        inner = shapely.get_coordinates(substring(line, 2.0 * apart_m, line.length - 2.0 * apart_m))
        return [inner, inner[::-1]]

    def _keeps_to_water(self, leg: LineString) -> bool:
        return bool(leg.difference(self.water.buffer(OFF_M)).length == 0.0)


@dataclass(frozen=True)
class MiddleLine:
    """The middle line (n, 2) of a leg, from a place to a gate; from ashore its second point is the berth.

    `entry` is the number of the point where the line comes to the free space.
    """

    points: FloatArray
    is_ashore: bool
    entry: int = 0

    @property
    def length_m(self) -> float:
        """From the place to the gate."""
        return LineString(self.points).length

    def length_beside_m(self, apart_m: float) -> float:
        """That of the leg to the right, and straight on to the gate."""
        return LineString(np.vstack([self.beside(apart_m), self.points[-1:]])).length

    def beside(self, apart_m: float) -> FloatArray:
        """The leg to the right of its middle line, without the gate.

        Over land it is moved by a hair, from there to the free space by ever more, and then by a distance: were it
        by the distance at once, the leg from a place on an open shore would run along that shore.
        """
        first = 1 if self.is_ashore else 0
        narrow = _ever_more_beside(self.points[first : self.entry + 1], apart_m)
        afloat = np.vstack([narrow, _beside(self.points[max(first, self.entry) : -1], apart_m)[1:]])
        if not self.is_ashore:
            return np.vstack([self.points[:1], afloat])
        place, berth = self.points[:2]
        along = (berth - place) / np.hypot(*(berth - place))
        hair = np.copysign(HAIR_M, apart_m) * np.array([along[1], -along[0]])
        return np.vstack([place, berth + hair, afloat])


@dataclass(frozen=True)
class _Candidate:
    """A path in a share, and its legs where it has them."""

    out: FloatArray | None
    way: FloatArray
    home: FloatArray | None

    @property
    def line(self) -> LineString:
        return LineString(np.vstack([part for part in (self.out, self.way, self.home) if part is not None]))

    @property
    def legs(self) -> list[LineString]:
        """Each with the step from or to the path."""
        legs = [] if self.out is None else [np.vstack([self.out, self.way[:1]])]
        legs += [] if self.home is None else [np.vstack([self.way[-1:], self.home])]
        return [LineString(leg) for leg in legs]


class Harbour:
    """Finds the approaches of a team in one free space.

    Parameters
    ----------
    space
        All of the free space.
    spacing_m
        The nominal spacing of the paths.
    """

    def __init__(self, space: FreeSpace, spacing_m: float) -> None:
        self.space = space
        self._shore = leg_routes(space.free, space.water)
        inner = Routes(space.free)
        # From wide to narrow; the router of each is made only when it is asked.
        self._lanes = [
            _Lanes(space, self._shore, inner, APART * spacing_m * 0.5**step) for step in range(HALVINGS)
        ]

    def approach(self, share: Polygon, vehicle: Vehicle) -> Approach:
        """The approach of a vehicle to its share.

        Parameters
        ----------
        share
            The vehicle's part of the free space.
        vehicle
            Where it starts and is recovered.

        Returns
        -------
        Approach
            Without legs where the way from either place enters the free space in the share.

        Raises
        ------
        Infeasible
            No way through the free space leads there.
        """
        start, recovery = vehicle.start, vehicle.recovery
        remote = [place for place in dict.fromkeys((start, recovery)) if self._is_remote(share, place)]
        # Both ways come to the free space in the share itself: the path method makes the legs.
        if not remote:
            return Approach(structs.replace(self.space, free=share), start, recovery)
        ways = {place: self._to_gate(share, place) for place in remote}
        # One gate for both, where the two are side by side: the path in the share is then closed.
        if len(ways) == 2:
            ways[recovery] = _to_one_gate(ways[start], ways[recovery], recovery)
        # The gates become vertices: no path in the share passes between them and the rim.
        for way in ways.values():
            share = shapely.snap(share, Point(way.gate), ROUNDING_M)
        # A path from gate to gate has no legs of its own, and no business in water beyond its share.
        water = share if start in ways and recovery in ways else self.space.water
        return Approach(
            space=structs.replace(self.space, free=share, water=water),
            launch=ways[start].gate if start in ways else start,
            recovery=ways[recovery].gate if recovery in ways else recovery,
            water=shapely.union_all(
                [self.space.free, *(way.lanes.beside_entry(place) for place, way in ways.items())]
            ),
            out=self._middle_line(ways[start].line, start) if start in ways else None,
            home=self._middle_line(ways[recovery].line, recovery) if recovery in ways else None,
            apart_m=min(way.lanes.apart_m for way in ways.values()),
        )

    def _middle_line(self, points: FloatArray, place: Place) -> MiddleLine:
        way = way_to(self.space.free, self._shore, place)
        entry = len(way) - 1 if LineString(way).length > ROUNDING_M else 0
        return MiddleLine(points, Landing.of(place, self.space.water).is_ashore, entry)

    def _is_remote(self, share: Polygon, place: Place) -> bool:
        """Whether the way from a place comes to other free water before the share."""
        entry = Point(way_to(self.space.free, self._shore, place)[-1])
        return not shapely.dwithin(share, entry, ROUNDING_M)

    def _to_gate(self, share: Polygon, place: Place) -> _Way:
        """The middle line of a leg from a place to a share, in lanes as wide as the water allows.

        Lanes too wide for the water between a place on the shore and a share right beside it begin in the share,
        and would lead through the path there: narrower ones are taken, where there are any.
        """
        last: _Way | None = None
        for lanes in self._lanes:
            line = lanes.to_gate(share, place)
            if line is None:
                continue
            last = _Way(lanes, line)
            if LineString(line).intersection(share).length <= ROUNDING_M:
                return last
        if last is None:
            raise Infeasible("lies in water from which no route leads to the vehicle's share", "LaunchPoint")
        return last


@dataclass(frozen=True)
class _Lanes:
    """The middle of the free space: far enough from its rim for a leg on either side."""

    space: FreeSpace
    shore: Routes
    inner: Routes
    apart_m: float

    @cached_property
    def _middle(self) -> BaseGeometry:
        return self.space.free.buffer(-2.0 * self.apart_m, quad_segs=2)

    @cached_property
    def _inside(self) -> Polygon | MultiPolygon:
        # Wider than the middle, whose rim then lies well inside: the router need not decide places on its border.
        return self.space.free.buffer(-1.5 * self.apart_m, quad_segs=2)

    @cached_property
    def _router(self) -> Router:
        return make_router(RouteMethod.VISIBILITY, self._inside)

    def way(self, place: Place, goal: Place | FloatArray) -> FloatArray:
        """The middle line from a place, ashore or not, to another in the middle of the free space."""
        entry = self._entry(place)
        return np.vstack([entry[:-1], self._router.route(entry[-1], goal).polyline])

    def to_gate(self, share: Polygon, place: Place) -> FloatArray | None:
        """The middle line from a place to the nearest gate of a share; None where no way leads there."""
        gates = _edge_middles(share.intersection(self._middle), GATES)
        if self._middle.is_empty or not len(gates):
            return None
        entry = self._entry(place)
        distances = self._router.distances(np.vstack([entry[-1:], gates]))[0, 1:]
        if not np.isfinite(distances).any():
            return None
        line = LineString(self._router.route(entry[-1], gates[np.argmin(distances)]).polyline)
        # From where it is near, straight on: one side of a leg that met the rim at a slant would lie in the share.
        rim = share.boundary.intersection(self._inside)
        near = shapely.get_coordinates(line.intersection(rim.buffer(2.0 * self.apart_m)))
        if not len(near):
            return None
        first_m = shapely.line_locate_point(line, shapely.points(near)).min()
        far = shapely.get_coordinates(substring(line, 0.0, float(first_m)))
        gate = shapely.get_coordinates(shapely.shortest_line(rim, Point(far[-1])))[0]
        return np.vstack([entry[:-1], far, gate])

    def beside_entry(self, place: Place) -> BaseGeometry:
        """Where legs may run from a place to the middle of the free space; over land to the berth alone."""
        landing = Landing.of(place, self.space.water)
        way = LineString(way_to(self.space.free, self.shore, place))
        strip = way.buffer(BESIDE * way.length + ROUNDING_M)
        return (strip & self.space.water) | LineString([landing.place, landing.berth]).buffer(ON_SHORE_M)

    def _entry(self, place: Place) -> FloatArray:
        """The way (n, 2) from a place, ashore or not, to the middle of the free space.

        It is through free space that it leads on, once it is there: not by the shortest water.
        """
        way = way_to(self.space.free, self.shore, place)
        onward = way_to(self._middle, self.inner, (float(way[-1, 0]), float(way[-1, 1])))
        return np.vstack([way[:-1], onward]) if len(way) > 1 else onward


@dataclass(frozen=True)
class _Way:
    """A middle line (n, 2) from a place to a gate, and the lanes that it runs in."""

    lanes: _Lanes
    line: FloatArray

    @property
    def gate(self) -> Place:
        """Where it ends."""
        return float(self.line[-1, 0]), float(self.line[-1, 1])


def _to_one_gate(out: _Way, home: _Way, recovery: Place) -> _Way:
    """The way home, by the gate of the way out where its own is right beside it."""
    if math.dist(out.gate, home.gate) > NEAR_GATES * out.lanes.apart_m:
        return home
    return _Way(out.lanes, np.vstack([out.lanes.way(recovery, out.line[-2]), out.gate]))


def _edge_middles(area: BaseGeometry, most: int) -> FloatArray:
    """Places (n, 2) in the middle of an area's longest edges: a path may begin, end and run along them."""
    xy, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(area)), return_index=True)
    # The last point of one ring and the first of the next are neighbours in this array, but no edge.
    edges = np.stack([xy[:-1], xy[1:]], axis=1)[ring[:-1] == ring[1:]]
    # Stable, so that edges of one length are tried in the same order on every machine.
    longest = np.argsort(-np.hypot(*(edges[:, 1] - edges[:, 0]).T), kind="stable")[:most]
    return np.asarray(edges[longest].mean(axis=1))


def _ever_more_beside(leg: FloatArray, apart_m: float) -> FloatArray:
    """A leg without its first point, moved to its right by a share of the way so far, at most by a distance."""
    steps = np.diff(leg, axis=0)
    if len(steps) == 0:
        return leg[:0]
    along_m = np.cumsum(np.hypot(*steps.T))
    tangents = np.vstack([leg[2:] - leg[:-2], steps[-1:]])
    right = np.column_stack([tangents[:, 1], -tangents[:, 0]]) / np.hypot(*tangents.T)[:, None]
    aside_m = np.copysign(np.minimum(abs(apart_m), OPENING * along_m), apart_m)
    return np.asarray(leg[1:] + aside_m[:, None] * right)


def _beside(leg: FloatArray, apart_m: float) -> FloatArray:
    """A leg moved to its right; nothing, where it is a place only."""
    if len(leg) < 2:
        return leg[:0]
    # GEOS offsets to the left where the distance is positive.
    return np.asarray(shapely.get_coordinates(shapely.offset_curve(LineString(leg), -apart_m, quad_segs=2)))
