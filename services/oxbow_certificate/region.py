"""The water on which paths are judged: the mission's own, not the planner's simplified one."""

from __future__ import annotations

from dataclasses import dataclass

import shapely
from shapely import MultiLineString, MultiPolygon, Polygon

from oxbow.contracts import CertifyRequest
from oxbow.errors import Infeasible
from oxbow.geometry.narrows import without_narrows
from oxbow_certificate.cover import least_radius
from oxbow_certificate.erosion import eroded_water, polygons

__all__ = ["JudgedSpace"]

DETAIL_SHARE = 1e-3
"""How far the judged shore may lie from the true one, as a fraction of what is measured: see `_detail`."""


@dataclass(frozen=True)
class JudgedSpace:
    """Water, free space, and the part of the free space over which distances are taken.

    Attributes
    ----------
    water
        The outline less the forbidden zones.
    free
        The water without narrows, eroded by the safety distance: its connected parts.
    asked
        What is to be covered: all of `free`, or those of the request's areas that lie in it.
    judged
        The parts of `asked` that a path enters; all of them if none is entered.
    judged_area
        The fraction of the area of `asked` that is entered, 0 to 1.
    detail_m
        Detail of the shore finer than this is not followed in `free`.
    """

    water: Polygon | MultiPolygon
    free: MultiPolygon
    asked: MultiPolygon
    judged: MultiPolygon
    judged_area: float
    detail_m: float

    @classmethod
    def of(cls, request: CertifyRequest) -> JudgedSpace:
        """The space that a request's path is judged on.

        Raises
        ------
        Infeasible
            The zones or the safety distance leave no water, or none of what is to be covered.
        """
        water = MultiPolygon(polygons(request.outline.difference(shapely.union_all(request.zones))))
        if water.is_empty:
            raise Infeasible("cover the whole outline; expected some water between them", where="zones")
        detail_m = _detail(water, request)
        # Erosion by the safety distance removes what is narrower than twice that distance anyway.
        width_m = request.least_width_m if 2 * request.safety_m < request.least_width_m else 0.0
        parts = polygons(eroded_water(without_narrows(water, width_m), request.safety_m, detail_m))
        if not parts:
            raise Infeasible(
                f"is {request.safety_m:g} m, which leaves no water; expected less than {_inradius(water):g} m",
                where="safety_m",
            )
        free = MultiPolygon(parts)
        asked = _asked(free, request)
        paths = MultiLineString([track.path for track in request.tracks])
        # Water that cannot be reached would dominate every distance: its share is reported instead, by
        # `judged_area`.
        entered = [part for part in asked.geoms if part.intersects(paths)]
        entered_area = sum(part.area for part in entered)
        return cls(water, free, asked, MultiPolygon(entered or asked), entered_area / asked.area, detail_m)


def _asked(free: MultiPolygon, request: CertifyRequest) -> MultiPolygon:
    if not request.areas:
        return free
    asked = polygons(shapely.union_all(request.areas).intersection(free))
    if not asked:
        raise Infeasible(
            f"lie nowhere farther from the shore than `safety_m` = {request.safety_m:g} m; expected some water"
            " that a vehicle may enter",
            where="areas",
        )
    return MultiPolygon(asked)


def _detail(water: MultiPolygon, request: CertifyRequest) -> float:
    """A tolerance that changes area, distances and erosion by at most 0.1 %: a million vertices need one."""
    length_m = sum(track.path.length for track in request.tracks)
    scales = [water.area / water.length, least_radius(water.area, length_m)]
    if request.safety_m:
        scales.append(request.safety_m)
    return DETAIL_SHARE * min(scales)


def _inradius(water: MultiPolygon) -> float:
    """The radius of the largest disc that fits in the water, in metres."""
    return max(float(shapely.maximum_inscribed_circle(part).length) for part in water.geoms)
