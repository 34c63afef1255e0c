"""Basins: parts of one water that only passages narrower than twice the safety distance connect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import MultiPolygon, Point, Polygon

from oxbow.arrays import Place
from oxbow.contracts import ContourRequest
from oxbow.errors import Infeasible
from oxbow.geometry.narrows import direct_leg_m, is_basin
from oxbow.geometry.route import Routes
from oxbow.tolerances import ROUNDING_M

__all__ = ["require_reachable"]


def require_reachable(parts: Sequence[Polygon], water: Polygon, request: ContourRequest) -> None:
    """Check that a way from each of the request's places comes to the planned free space before any other.

    Only the first and the last stretch of a path may be nearer to the shore than the safety distance: from a place
    to the first free water there is. From a basin that the safety distance cuts off, no way leads on. What is no
    basin is a wide spot on the way (`is_basin`).

    Parameters
    ----------
    parts
        The connected parts of the free space; the first is planned on.
    water
        The connected water that they lie in.
    request
        Its places.

    Raises
    ------
    Infeasible
        A place lies by another basin, or there is none, and only narrow water leads from the place to the widest
        spot; `where` names the place as `places[i]`.
    """
    safety_m, width_m = request.safety_m, request.least_width_m
    twice_m = 2 * safety_m
    narrow = f"{twice_m:g} m, twice `safety_m`" if twice_m > width_m else f"{width_m:g} m, `least_width_m`"
    # Without any basin there is nothing to cut off, but the way to the widest spot may still be too long for a
    # leg.
    if not is_basin(parts[0], safety_m, width_m):
        _require_near(parts[0], water, request, narrow)
    basins = [parts[0], *(part for part in parts[1:] if is_basin(part, safety_m, width_m))]
    if len(basins) == 1:
        return
    routes = Routes(water)
    for index, place in enumerate(request.places):
        basin = _first_basin(basins, routes, place)
        if basin is not basins[0]:
            raise Infeasible(
                f"lies by {basin.area:.0f} m2 of free water that only water narrower than {narrow}, connects to"
                f" the largest part, {basins[0].area:.0f} m2; expected a place by the largest part, or a smaller"
                " `safety_m`",
                where=f"places[{index}]",
            )


def _require_near(spot: Polygon, water: Polygon, request: ContourRequest, narrow: str) -> None:
    """Check that the places are beside the only free water there is, a spot too small for a basin.

    Raises
    ------
    Infeasible
        One is not: its leg would be most of the path.
    """
    for index, place in enumerate(request.places):
        way_m = spot.distance(Point(place))
        if way_m > direct_leg_m(request.safety_m, water.distance(Point(place))):
            raise Infeasible(
                f"is {way_m:.0f} m from the only free water, {spot.area:.2g} m2, and everything in between is"
                f" narrower than {narrow}; expected a smaller `safety_m`",
                where=f"places[{index}]",
            )


def _first_basin(basins: Sequence[Polygon], routes: Routes, place: Place) -> Polygon:
    """The basin that is nearest to a place along the water."""
    berth = shapely.shortest_line(routes.water, Point(place)).interpolate(0.0)
    nearest = basins[int(np.argmin(shapely.distance(np.array(basins, dtype=object), berth)))]
    # Mostly the straight line is in the water, and then no way is shorter: the visibility graph is not needed.
    straight = shapely.shortest_line(berth, nearest)
    if straight.difference(routes.water).length <= ROUNDING_M:
        return nearest
    area = MultiPolygon(basins)
    route = routes.to_area(shapely.get_coordinates(berth)[0], area, routes.goals_in(area))
    if route is None:
        return nearest
    end = Point(route.coords[-1])
    return basins[int(np.argmin(shapely.distance(np.array(basins, dtype=object), end)))]
