"""How a vehicle gets to its share of the free space, and home: legs through water that others survey.

A vehicle whose start lies elsewhere enters its share at a *gate* and leaves it there. This module chooses gates
and the middle lines that lead to them. Stage `path` draws the legs beside these (`oxbow.geometry.lanes`), once it
knows the path between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from oxbow.arrays import FloatArray, Place
from oxbow.contracts import Approach, MiddleLine, Share, Vehicle
from oxbow.contracts.budget import too_short
from oxbow.errors import Infeasible
from oxbow.geometry.conformance import SHORE_TOLERANCE_M
from oxbow.geometry.lanes import lane, legs_length_m
from oxbow.geometry.route import Landing, RouteMethod, Router, Routes, leg_routes, make_router, way_to
from oxbow.tolerances import ON_SHORE_M, ROUNDING_M

__all__ = ["Harbour"]

APART = 0.1
"""Distance of the way out from the way home at first, as a share of the nominal spacing."""
HALVINGS = 8
"""How often that distance may be halved until both ways fit."""
GATES = 48
"""At most this many places on the rim of a share are tried as its gate."""
NEAR_GATES = 10.0
"""The gates of the way out and home become one where they are within this many leg distances (`apart_m`)."""
BESIDE = 0.15
"""Between a place and the free space, legs may run as far from the way as this share of it."""


class Harbour:
    """Finds the approaches of a team in one free space.

    Parameters
    ----------
    free
        All of the free space.
    water
        What legs to and from the free space may cross.
    spacing_m
        The nominal spacing of the paths.
    """

    def __init__(self, free: Polygon, water: Polygon, spacing_m: float) -> None:
        self.free = free
        self.water = water
        self._shore = leg_routes(free, water)
        inner = Routes(free)
        # From wide to narrow; the router of each is made only when it is asked.
        self._lanes = [
            _Lanes(free, water, self._shore, inner, APART * spacing_m * 0.5**step) for step in range(HALVINGS)
        ]

    def share(self, area: Polygon, vehicle: Vehicle) -> Share:
        """The share of a vehicle, with the approach to it.

        Parameters
        ----------
        area
            The vehicle's part of the free space.
        vehicle
            Where it starts and is recovered, and how far it goes.

        Returns
        -------
        Share
            Its gates are vertices of its area. Without legs where the way from either place enters the free space
            in it.

        Raises
        ------
        Infeasible
            No way through the free space leads there, or the way takes all of the vehicle's length.
        """
        # Where a vehicle comes back to its start, errors call the place that.
        names = {vehicle.recovery: vehicle.field("recovery"), vehicle.start: vehicle.field("start")}
        ways = {
            place: self._to_gate(area, place, name)
            for place, name in names.items()
            if self._is_remote(area, place, name)
        }
        start, recovery = ways.get(vehicle.start), ways.get(vehicle.recovery)
        if start is None and recovery is None:
            approach = Approach(launch=vehicle.start, recovery=vehicle.recovery)
            return Share(vehicle=vehicle.name, area=area, approach=approach)
        if start is not None and recovery is not None and start is not recovery:
            recovery = _to_one_gate(start, recovery, vehicle.recovery)
        used = {place: way for place, way in ((vehicle.start, start), (vehicle.recovery, recovery)) if way}
        # The gates become vertices: no path in the share passes between them and the rim.
        for way in used.values():
            area = shapely.snap(area, Point(way.gate), ROUNDING_M)
        out = None if start is None else self._middle_line(start.line, vehicle.start)
        home = None if recovery is None else self._middle_line(recovery.line, vehicle.recovery)
        apart_m = min(way.lanes.apart_m for way in used.values())
        legs_m = legs_length_m(out, home, apart_m)
        if legs_m >= vehicle.length_m:
            way_there = "the way to the vehicle's share and home"
            raise too_short(vehicle.length_m, legs_m, what=way_there, where=vehicle.field("length_m"))
        strips = [way.lanes.beside_entry(place) for place, way in used.items()]
        approach = Approach(
            launch=vehicle.start if start is None else start.gate,
            recovery=vehicle.recovery if recovery is None else recovery.gate,
            out=out,
            home=home,
            apart_m=apart_m,
            water=_polygons(shapely.union_all([self.free, *strips])),
            legs_m=legs_m,
        )
        return Share(vehicle=vehicle.name, area=area, approach=approach)

    def _middle_line(self, points: FloatArray, place: Place) -> MiddleLine:
        way = way_to(self.free, self._shore, place)
        entry = len(way) - 1 if LineString(way).length > ROUNDING_M else 0
        is_ashore = Landing.of(place, self.water).is_ashore
        return MiddleLine(line=LineString(points), is_ashore=is_ashore, entry=entry)

    def _is_remote(self, share: Polygon, place: Place, where: str) -> bool:
        """Whether the way from a place comes to other free water before the share."""
        entry = Point(way_to(self.free, self._shore, place, where=where)[-1])
        return not shapely.dwithin(share, entry, ROUNDING_M)

    def _to_gate(self, share: Polygon, place: Place, where: str) -> _Way:
        """The middle line of a leg from a place to a share, in lanes as wide as the water allows.

        Lanes too wide for the water between a place on the shore and a share right beside it begin in the share,
        and would lead through the path there. Others are too wide for narrow water on the way from the place to
        where they begin. Narrower ones are taken, where there are any.
        """
        last: _Way | None = None
        # Legs that keep clear of the share, but for which some water is too narrow at their full distance.
        close: _Way | None = None
        for lanes in self._lanes:
            line = lanes.to_gate(share, place)
            if line is None:
                continue
            last = _Way(lanes, line)
            if LineString(line).intersection(share).length > ROUNDING_M:
                continue
            if self._has_room(last, place):
                return last
            close = close or last
        if last is None:
            raise Infeasible("lies in water from which no route leads to the vehicle's share", where)
        return close or last

    def _has_room(self, way: _Way, place: Place) -> bool:
        """Whether legs as far from a middle line as its lanes ask for keep to where they may run, on either side.

        Where they do not, stage `path` brings them nearer to it; but along a rim no distance is small enough.
        """
        middle = self._middle_line(way.line, place)
        sides = [np.vstack([lane(middle, side * way.lanes.apart_m), way.gate]) for side in (1.0, -1.0)]
        stray = shapely.union_all([LineString(leg) for leg in sides]).difference(self._free_and_tolerance)
        return bool(stray.difference(way.lanes.beside_entry(place).buffer(SHORE_TOLERANCE_M)).is_empty)

    @cached_property
    def _free_and_tolerance(self) -> BaseGeometry:
        return self.free.buffer(SHORE_TOLERANCE_M)


@dataclass(frozen=True)
class _Lanes:
    """The middle of the free space: far enough from its rim for a leg on either side."""

    free: Polygon
    water: Polygon
    shore: Routes
    inner: Routes
    apart_m: float

    @cached_property
    def _middle(self) -> BaseGeometry:
        return self.free.buffer(-2.0 * self.apart_m, quad_segs=2)

    @cached_property
    def _inside(self) -> Polygon | MultiPolygon:
        # Wider than the middle, whose rim then lies well inside: the router need not decide places on its border.
        return self.free.buffer(-1.5 * self.apart_m, quad_segs=2)

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
        landing = Landing.of(place, self.water)
        way = LineString(way_to(self.free, self.shore, place))
        strip = way.buffer(BESIDE * way.length + ROUNDING_M)
        return (strip & self.water) | LineString([landing.place, landing.berth]).buffer(ON_SHORE_M)

    def _entry(self, place: Place) -> FloatArray:
        """The way (n, 2) from a place, ashore or not, to the middle of the free space.

        It is through free space that it leads on, once it is there: not by the shortest water.
        """
        way = way_to(self.free, self.shore, place)
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


def _polygons(area: BaseGeometry) -> tuple[Polygon, ...]:
    return tuple(part for part in shapely.get_parts(area) if isinstance(part, Polygon))
