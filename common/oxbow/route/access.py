"""How an area of the water is reached from a place outside it, as from a harbour or up a creek."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import FloatArray, Place
from oxbow.errors import Infeasible
from oxbow.route.methods import make_router
from oxbow.route.route import RouteMethod
from oxbow.tolerances import ROUNDING_M

__all__ = ["way_to"]

GOALS = 200
"""So many places of the area's rim, about, may be the goal."""


def way_to(area: BaseGeometry, water: Polygon | MultiPolygon, place: Place) -> FloatArray:
    """The way from a place to where it first meets an area, shape (n, 2).

    Straight to the nearest place of the area, where that keeps to the water; or where the place is ashore, for
    nobody knows then what lies between. Else by a route through the water, clear of its shores.

    Parameters
    ----------
    area
        Where to, in the water; parts of it may lie apart.
    water
        Where routes may run.
    place
        Where from, outside the area or in it.

    Raises
    ------
    Infeasible
        No water leads from the place to the area.
    """
    point = Point(place)
    straight = shapely.shortest_line(point, area)
    grown = water.buffer(ROUNDING_M)
    if not grown.covers(point) or grown.covers(straight):
        return np.asarray(shapely.get_coordinates(straight))
    router = make_router(RouteMethod.INCENTERS, water)
    boundary = area.boundary
    rim = shapely.get_coordinates(boundary.segmentize(boundary.length / GOALS))
    goals = rim[:: max(1, len(rim) // GOALS)]
    distances = router.distances(np.vstack([place, goals]))[0, 1:]
    if not np.isfinite(distances).any():
        raise Infeasible("lies in water from which no way leads to where it is to go", "LaunchPoint")
    route = router.route(place, goals[np.argmin(distances)]).line
    outside = shapely.get_parts(route.difference(area))
    return np.asarray(shapely.get_coordinates(outside[np.argmin(shapely.distance(outside, point))]))
