"""Which water is planned on: the one where the first vehicle starts, and all of them are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import ContourRequest
from oxbow.errors import Infeasible, InvalidMission
from oxbow.tolerances import ON_SHORE_M, ROUNDING_M
from oxbow_contour.verification import inscribed_radius_m

__all__ = ["home_water"]

PRECISION = 1e-3
"""Of the radius of the circle that fits into water, as a share of the safety distance."""


def home_water(waters: Sequence[Polygon], request: ContourRequest, narrows: BaseGeometry) -> Polygon:
    """The connected water that is planned on.

    It is the nearest to where the first vehicle starts that has room for the safety distance; the largest, where
    nobody starts. Water without such room is as good as land: a place in it is reached from the nearest water
    that has.

    Parameters
    ----------
    waters
        At least one; apart from one another, the largest first.
    request
        Its places, each at most its shore tolerance from where a vehicle may go.
    narrows
        Water that is none of these, as it is too narrow.

    Raises
    ------
    InvalidMission
        A place lies too far from water that is wide enough, or behind other land; `where` names it as `places[i]`.
    Infeasible
        A place lies in other water than the first.
    """
    if not request.places:
        return waters[0]
    nearest = [_nearest(waters, request, index) for index in range(len(request.places))]
    for index, water in enumerate(nearest):
        _require_no_land_between(water, request, index, narrows)
    home = nearest[0]
    for index, water in enumerate(nearest):
        if water is not home:
            raise Infeasible(
                f"lies in water of {water.area:.0f} m2 that is not connected to that of the first start,"
                f" {home.area:.0f} m2: land, forbidden zones or water narrower than Least_width are between;"
                " expected one water for all starts and recoveries",
                where=f"places[{index}]",
            )
    return home


def _nearest(waters: Sequence[Polygon], request: ContourRequest, index: int) -> Polygon:
    """The nearest water to a place that has room; without any, the nearest."""
    distance_m = shapely.distance(np.array(waters, dtype=object), Point(request.places[index]))
    if distance_m.min() > request.shore_tolerance_m:
        raise InvalidMission(
            f"lies {distance_m.min():.3g} m from water wider than Least_width = {request.least_width_m:g} m;"
            f" expected at most Shore_tolerance = {request.shore_tolerance_m:g} m",
            where=f"places[{index}]",
        )
    nearest_first = np.argsort(distance_m, kind="stable").tolist()
    near: list[Polygon] = [
        waters[number] for number in nearest_first if distance_m[number] <= request.shore_tolerance_m
    ]
    if len(waters) == 1:
        return near[0]
    return next((water for water in near if _has_room(water, request.safety_m)), near[0])


def _require_no_land_between(water: Polygon, request: ContourRequest, index: int, narrows: BaseGeometry) -> None:
    """Check that no forbidden zone and no other land lies between a place ashore and its water.

    A vehicle may be carried from its place to the water. Beyond a seam of water, however narrow, begins another
    shore.

    Raises
    ------
    InvalidMission
        The way passes such a seam.
    """
    way = shapely.shortest_line(Point(request.places[index]), water)
    # A little larger, since the ends of an intersection need not lie on the line.
    land = shapely.get_parts(way.difference(narrows.intersection(way.envelope.buffer(1.0)).buffer(ROUNDING_M)))
    behind = land[shapely.distance(land, shapely.get_point(way, 0)) > ROUNDING_M]
    if shapely.length(behind).sum() > ON_SHORE_M:
        raise InvalidMission(
            f"lies {way.length:.3g} m from water wider than Least_width = {request.least_width_m:g} m, and behind"
            " a forbidden zone or other land; expected a place by that water, or less for Least_width",
            where=f"places[{index}]",
        )


def _has_room(water: Polygon, safety_m: float) -> bool:
    """Whether a circle with the radius of the safety distance fits into a water."""
    if safety_m == 0.0:
        return True
    return inscribed_radius_m([water], PRECISION * safety_m) > safety_m
