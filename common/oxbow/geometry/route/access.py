"""How an area of the water is reached from a place outside it: from ashore, from a harbour or up a creek."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Place
from oxbow.errors import Infeasible
from oxbow.geometry.route.gate_routes import Routes
from oxbow.tolerances import ON_SHORE_M, ROUNDING_M

__all__ = ["Landing", "leg_routes", "way_to"]

DETAIL = 4.0
"""Gates of narrow water are at most this many times the distance from the free space to the shore apart."""

MOST_GATES = 20_000
"""About the most gates along a shore: on a longer one, they are farther apart."""


@dataclass(frozen=True)
class Landing:
    """Where a vehicle takes to the water.

    Parameters
    ----------
    place
        Where it stands: in the water, on its shore or ashore.
    berth
        The nearest place of the water: `place` itself where that is in the water.
    """

    place: Place
    berth: Place

    @classmethod
    def of(cls, place: Place, water: BaseGeometry) -> Landing:
        """Where a vehicle at a place takes to the water.

        Parameters
        ----------
        place
            In the water, on its shore or ashore.
        water
            Polygons, in metres.

        Returns
        -------
        Landing
            Its berth is the place itself where the water covers that, however close to the shore.
        """
        point = Point(place)
        if shapely.dwithin(water, point, 0.0):
            return cls(place, place)
        x, y = shapely.get_coordinates(shapely.shortest_line(water, point))[0].tolist()
        return cls(place, (x, y))

    @property
    def is_ashore(self) -> bool:
        """Whether there is land to cross."""
        return self.land_m > 0.0

    @property
    def land_m(self) -> float:
        """Metres over land, straight to the berth; none for a place on the shore."""
        return 0.0 if self._distance_m <= ON_SHORE_M else self._distance_m

    @property
    def off_shore_m(self) -> float:
        """How far a place counted as on the shore is from the water in fact: a few millimetres, or rounding."""
        return self._distance_m - self.land_m

    @property
    def _distance_m(self) -> float:
        return float(np.hypot(*np.subtract(self.place, self.berth)))

    def onward(self, way: FloatArray) -> FloatArray:
        """A way (n, 2) that begins at the berth, from the place on."""
        return np.vstack([self.place, way if self.is_ashore else way[1:]])


def leg_routes(free: BaseGeometry, water: Polygon) -> Routes:
    """Routes for legs to the free space: fine enough that none begins along a dead end of the creek it leaves.

    Where water is narrower than twice the safety distance, gates are about as close as twice that width.

    Parameters
    ----------
    free
        Where paths run: the water eroded by the safety distance.
    water
        What legs may cross on their way to the free space.

    Returns
    -------
    Routes
        Not triangulated yet: that is done when the first route is asked for.
    """
    clearance_m = float(free.boundary.distance(water.boundary))
    # At a safety distance of 0 the free space is the water: no leg has narrow water to pass.
    if clearance_m <= ROUNDING_M:
        return Routes(water)
    return Routes(water, max(DETAIL * clearance_m, water.length / MOST_GATES))


def way_to(area: BaseGeometry, routes: Routes, place: Place, *, where: str = "place") -> FloatArray:
    """The way from a place to where it first meets an area, shape (n, 2).

    A way from ashore leads straight to the nearest place of the water, and on as from there. In the water it leads
    straight to the nearest place of the area where that line keeps to the water, and along the middle otherwise.

    Parameters
    ----------
    area
        The destination, in the water; parts of it may lie apart.
    routes
        Routes through the water.
    place
        The start, outside the area or in it.
    where
        What errors call the start.

    Returns
    -------
    ndarray, shape (n, 2)
        In metres, from the place to the area, both included; two equal places where the area covers the place.

    Raises
    ------
    Infeasible
        No water leads from the place to the area.
    """
    landing = Landing.of(place, routes.water)
    return landing.onward(_way_afloat(area, routes, landing.berth, where))


def _way_afloat(area: BaseGeometry, routes: Routes, berth: Place, where: str) -> FloatArray:
    point = Point(berth)
    straight = shapely.shortest_line(point, area)
    # By length, not by containment: a line along the shore is on either side of it by rounding.
    if straight.difference(routes.water).length <= ROUNDING_M:
        return np.asarray(shapely.get_coordinates(straight))
    route = routes.to_area(np.array(berth), area, routes.goals_in(area))
    if route is None:
        raise Infeasible("lies in water from which no route leads to the free space", where)
    # A route to a goal may cross the area before: only the stretch up to the first contact counts.
    outside = shapely.get_parts(route.difference(area))
    return np.asarray(shapely.get_coordinates(outside[np.argmin(shapely.distance(outside, point))]))
