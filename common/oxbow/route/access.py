"""How an area of the water is reached from a place outside it, as from a harbour or up a creek."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Point
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import FloatArray, Place
from oxbow.errors import Infeasible
from oxbow.route.gate_routes import Routes
from oxbow.tolerances import ROUNDING_M

__all__ = ["way_to"]


def way_to(area: BaseGeometry, routes: Routes, place: Place) -> FloatArray:
    """The way from a place to where it first meets an area, shape (n, 2).

    Straight to the nearest place of the area, where that keeps to the water; or where the place is ashore, for
    nobody knows then what lies between. Else along the middle of the water.

    Parameters
    ----------
    area
        Where to, in the water; parts of it may lie apart.
    routes
        Routes through the water.
    place
        Where from, outside the area or in it.

    Raises
    ------
    Infeasible
        No water leads from the place to the area.
    """
    point = Point(place)
    straight = shapely.shortest_line(point, area)
    is_ashore = not shapely.dwithin(routes.water, point, ROUNDING_M)
    if is_ashore or straight.difference(routes.water).length <= ROUNDING_M:
        return np.asarray(shapely.get_coordinates(straight))
    route = routes.to_area(np.array(place), area, routes.goals_in(area))
    if route is None:
        raise Infeasible("lies in water from which no way leads to the free space", "LaunchPoint")
    outside = shapely.get_parts(route.difference(area))
    return np.asarray(shapely.get_coordinates(outside[np.argmin(shapely.distance(outside, point))]))
