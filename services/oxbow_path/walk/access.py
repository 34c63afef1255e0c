"""How a launch or recovery point is reached: the leg between it and the free space, through the water."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from shapely import LineString, Point, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from oxbow.arrays import FloatArray, Place
from oxbow.geometry.route import Landing, way_to
from oxbow.geometry.route.gate_routes import Routes, taut
from oxbow.tolerances import HAIR_M, ON_SHORE_M, ROUNDING_M

__all__ = ["BESIDE_LEG", "Access", "access"]

BESIDE_LEG = 0.1
"""How far the way back may run beside a leg, and so how wide the ring's opening may be, as a share of the leg."""


@dataclass(frozen=True)
class Access:
    """How a launch or recovery point is reached: `leg` runs from it to the free space, through the water.

    Parameters
    ----------
    leg : array, shape (n, 2)
        From the point to the free space, in metres; two equal vertices where the point lies inside it.
    land_m
        How far the leg runs straight over land first, to its second vertex; 0 for a point in the water.
    beside
        Where the way back may run: up to a tenth of the leg's length to either side, in the water.
    """

    leg: FloatArray
    land_m: float = 0.0
    beside: BaseGeometry = field(default_factory=Polygon)

    @property
    def place(self) -> Place:
        """The point itself."""
        return float(self.leg[0, 0]), float(self.leg[0, 1])

    @property
    def entry(self) -> Point:
        """Where the leg meets the free space."""
        return Point(self.leg[-1])

    @property
    def line(self) -> LineString:
        """The leg as a line."""
        return LineString(self.leg)

    def along(self, other: Access) -> Access:
        """The same, on along another leg from where it first meets it; unless the other one meets it earlier."""
        mine, its = self._first_meeting_m(other), other._first_meeting_m(self)
        if mine > its:
            return self
        rest = substring(other.line, other.line.project(self.line.interpolate(mine)), other.line.length)
        points = np.vstack([shapely.get_coordinates(substring(self.line, 0.0, mine)), rest.coords])
        apart = np.hypot(*np.diff(points, axis=0).T) > HAIR_M
        return replace(self, leg=points[np.concatenate([[True], apart])])

    def _first_meeting_m(self, other: Access) -> float:
        common = shapely.get_coordinates(self.line.intersection(other.line.buffer(ROUNDING_M)))
        return float(shapely.line_locate_point(self.line, shapely.points(common)).min(initial=math.inf))

    @property
    def ashore(self) -> bool:
        """Whether the leg begins over land."""
        return self.land_m > 0.0

    @property
    def winds(self) -> bool:
        """Whether the free space cannot be seen from where the leg takes to the water."""
        return len(self.leg) - self.ashore > 2


def access(place: Place, free: Polygon, water: Routes, *, where: str) -> Access:
    """The leg from a launch or recovery point to the free space.

    From ashore, straight to the nearest place of the water. From there the shortest line, where the water allows
    it; else along the middle of the water, pulled tight wherever that keeps half the safety distance from the
    shore.

    Parameters
    ----------
    place
        The point, (x, y) in metres.
    free
        The free space.
    water
        Ways through the water that the free space lies in.
    where
        What errors call the point.

    Returns
    -------
    Access
        Without a leg where the free space covers the point.

    Raises
    ------
    Infeasible
        The point's water is not connected to the free space.
    """
    if free.covers(Point(place)):
        return Access(np.array([place, place]))
    landing = Landing.of(place, water.water)
    way = way_to(free, water, landing.berth, where=where)
    if len(way) > 2:
        way = _pulled_tight(way, free, water.water)
    leg = landing.onward(way)
    return Access(leg, landing.land_m, _beside_leg(leg, landing, water.water))


def _pulled_tight(way: FloatArray, free: Polygon, water: BaseGeometry) -> FloatArray:
    # The way ends where the free space begins: at the safety distance.
    clearance_m = shapely.distance(Point(way[-1]), water.boundary) / 2
    line = LineString(way)
    # Only the water around the way is eroded: a whole lake would take long.
    around = water.intersection(box(*line.bounds).buffer(5 * clearance_m))
    # The start may lie on the shore, where erosion leaves no water.
    roomy = around.buffer(-clearance_m).union(Point(way[0]).buffer(4 * clearance_m).intersection(around))
    return np.asarray(shapely.get_coordinates(shapely.get_parts(taut(line, roomy).difference(free))[0]))


def _beside_leg(leg: FloatArray, landing: Landing, water: BaseGeometry) -> BaseGeometry:
    """Where a leg may run: near itself in the water, and over land on its straight way."""
    line = LineString(leg)
    near = line.buffer(BESIDE_LEG * line.length + ROUNDING_M)
    # A place on the shore may be millimetres off the water in fact; from ashore, the way back runs a hair aside.
    graze_m = (HAIR_M if landing.is_ashore else landing.off_shore_m) + ROUNDING_M
    afloat = water.intersection(box(*near.bounds)).buffer(graze_m).intersection(near)
    if not landing.is_ashore:
        return afloat
    return afloat.union(LineString([landing.place, landing.berth]).buffer(ON_SHORE_M))
