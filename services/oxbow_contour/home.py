"""Which water is planned on: that of the first vehicle's start, where all other places have to be too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import ContourRequest
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.tolerances import ON_SHORE_M, ROUNDING_M
from oxbow_contour.verification import inscribed_radius_m

__all__ = ["home_water"]

PRECISION = 1e-3
"""Of the radius of the circle that fits into water, as a share of the safety distance."""


def home_water(waters: Sequence[Polygon], request: ContourRequest, narrows: BaseGeometry) -> Polygon:
    """The connected water that is planned on.

    It is the nearest to where the first vehicle starts, or the largest where no vehicle starts. A vehicle may be
    carried to the nearest water, and no farther: from water without room for the safety distance no way leads on.

    Parameters
    ----------
    waters
        At least one; apart from one another, the largest first.
    request
        Its places, each at most its shore tolerance from where a vehicle may go.
    narrows
        The rest of the water, which is too narrow.

    Returns
    -------
    Polygon
        One of `waters`, the same object.

    Raises
    ------
    InvalidRequest
        A place lies too far from water that is wide enough, or behind other land; `where` names it as `places[i]`.
    Infeasible
        A place lies in or by other water than the first, or by water without room for the safety distance.
    """
    if not request.places:
        return waters[0]
    # All places before any comparison: the first error is then about a place, not about a pair of them.
    nearest = [_nearest(waters, request, index, narrows) for index in range(len(request.places))]
    for index, water in enumerate(nearest):
        _require_no_land_between(water, request, index, narrows)
    home = nearest[0]
    for index, water in enumerate(nearest):
        if water is not home:
            raise Infeasible(
                f"lies in water of {water.area:.0f} m2 that is not connected to that of the first start,"
                f" {home.area:.0f} m2: land, forbidden zones or water narrower than `least_width_m` are between;"
                " expected one water for all starts and recoveries",
                where=f"places[{index}]",
            )
    return home


def _nearest(waters: Sequence[Polygon], request: ContourRequest, index: int, narrows: BaseGeometry) -> Polygon:
    """The nearest water to a place; of several on whose shore it lies, one that has room.

    Raises
    ------
    InvalidRequest
        It is too far away.
    Infeasible
        It has no room, and other water has.
    """
    distance_m = shapely.distance(np.array(waters, dtype=object), Point(request.places[index]))
    least_m = float(distance_m.min())
    if least_m > request.shore_tolerance_m:
        raise InvalidRequest(
            f"lies {least_m:.3g} m from water wider than `least_width_m` = {request.least_width_m:g} m;"
            f" expected at most `shore_tolerance_m` = {request.shore_tolerance_m:g} m",
            where=f"places[{index}]",
        )
    nearest_first: list[int] = np.argsort(distance_m, kind="stable").tolist()
    nearest = waters[nearest_first[0]]
    if len(waters) == 1:
        return nearest
    # From the nearest on, and lazily: each test for room takes an inscribed circle, and mostly the first has it.
    roomy = next((number for number in nearest_first if _has_room(waters[number], request.safety_m)), None)
    if roomy is None:
        return nearest
    # On the shore of both: a place on a pinch between a pocket and the lake belongs to the lake.
    if distance_m[roomy] > least_m + ON_SHORE_M:
        raise _in_a_pocket(nearest, waters[roomy], request, index, narrows)
    return waters[roomy]


def _in_a_pocket(
    pocket: Polygon, roomy: Polygon, request: ContourRequest, index: int, narrows: BaseGeometry
) -> Infeasible:
    """The refusal of a place in or by water without room: what parts it from the nearest water that has."""
    way = shapely.shortest_line(Point(request.places[index]), roomy)
    distance_m = pocket.distance(Point(request.places[index]))
    lies = "in" if distance_m <= ON_SHORE_M else f"{distance_m:.3g} m from"
    barrier = _Barrier.on(way.difference(pocket), request, narrows)
    return Infeasible(
        f"lies {lies} water of {pocket.area:.2g} m2 that has no room for `safety_m` = {request.safety_m:g} m, and"
        f" the straight way to the nearest that has, {way.length:.3g} m, leads over {barrier.described}; expected"
        f" a place in or by that water{barrier.remedy}",
        where=f"places[{index}]",
    )


@dataclass(frozen=True)
class _Barrier:
    """What a straight way leads over other than water wide enough: how many metres of each.

    `zones_m` lie in forbidden zones, `land_m` off the outline, `narrows_m` in water that is too narrow.
    """

    zones_m: float
    land_m: float
    narrows_m: float
    least_width_m: float

    @classmethod
    def on(cls, way: BaseGeometry, request: ContourRequest, narrows: BaseGeometry) -> _Barrier:
        """What a way leads over."""
        afloat = way.intersection(request.outline)
        return cls(
            zones_m=afloat.intersection(shapely.union_all(list(request.zones))).length,
            land_m=way.length - afloat.length,
            narrows_m=way.intersection(narrows).length,
            least_width_m=request.least_width_m,
        )

    @property
    def described(self) -> str:
        """All that is longer than rounding."""
        parts = (
            (self.zones_m, "forbidden zone"),
            (self.land_m, "land"),
            (self.narrows_m, f"water narrower than `least_width_m` = {self.least_width_m:g} m"),
        )
        named = [f"{metres:.2g} m of {what}" for metres, what in parts if metres > ROUNDING_M]
        return " and ".join(named) or "a place where land or forbidden zones meet"

    @property
    def remedy(self) -> str:
        """What would help, other than another place."""
        zones = ", or forbidden zones that leave a way there" if self.zones_m > ROUNDING_M else ""
        return zones + (", or a smaller `least_width_m`" if self.narrows_m > ROUNDING_M else "")


def _require_no_land_between(water: Polygon, request: ContourRequest, index: int, narrows: BaseGeometry) -> None:
    """Check that no forbidden zone and no other land lies between a place ashore and its water.

    A vehicle may be carried from its place to the water. Beyond a seam of water, however narrow, begins another
    shore.

    Raises
    ------
    InvalidRequest
        The way passes such a seam.
    """
    way = shapely.shortest_line(Point(request.places[index]), water)
    # A little larger, since the ends of an intersection need not lie on the line.
    seams = narrows.intersection(way.envelope.buffer(1.0))
    land = shapely.get_parts(way.difference(seams.buffer(ROUNDING_M)))
    behind = shapely.union_all(land[shapely.distance(land, shapely.get_point(way, 0)) > ROUNDING_M])
    if behind.length > ON_SHORE_M:
        barrier = _Barrier.on(behind, request, seams)
        raise InvalidRequest(
            f"lies {way.length:.3g} m from water wider than `least_width_m` = {request.least_width_m:g} m, and"
            f" behind a forbidden zone or other land, {barrier.described}; expected a place by that water, or a"
            " smaller `least_width_m`",
            where=f"places[{index}]",
        )


def _has_room(water: Polygon, safety_m: float) -> bool:
    """Whether a circle with the radius of the safety distance fits into a water."""
    if safety_m == 0.0:
        return True
    # The area first, which rules out most pockets without an inscribed circle.
    is_large = water.area > np.pi * safety_m**2
    return is_large and inscribed_radius_m([water], PRECISION * safety_m) > safety_m
