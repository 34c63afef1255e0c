"""The water that a path is judged on: the mission's own, before any simplification by the planner."""

from __future__ import annotations

from dataclasses import dataclass

import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import CertifyRequest
from oxbow.errors import Infeasible

__all__ = ["QUAD_SEGS", "JudgedSpace"]

QUAD_SEGS = 16
"""Segments for a quarter circle of an eroded contour: its chords come 0.12 % of the safety distance nearer."""


@dataclass(frozen=True)
class JudgedSpace:
    """Water, free space, and the part of the free space that the distances are taken over.

    Attributes
    ----------
    water
        The outline less the forbidden zones.
    free
        The water eroded by the safety distance, as its connected parts.
    judged
        The parts of `free` that the path enters; all of them where it enters none.
    judged_area
        The share of the free area that the path enters, 0 to 1.
    """

    water: Polygon | MultiPolygon
    free: MultiPolygon
    judged: MultiPolygon
    judged_area: float

    @classmethod
    def of(cls, request: CertifyRequest) -> JudgedSpace:
        """The space that a request's path is judged on.

        Raises
        ------
        Infeasible
            The zones or the safety distance leave no water.
        """
        water = request.outline.difference(shapely.union_all(request.zones))
        if not water.area > 0:
            raise Infeasible("cover the whole outline; expected some water between them", where="zones")
        parts = _polygons(water.buffer(-request.safety_m, quad_segs=QUAD_SEGS) if request.safety_m else water)
        if not parts:
            raise Infeasible(
                f"is {request.safety_m:g} m, which leaves no water; expected less than {_inradius(water):g} m",
                where="safety_m",
            )
        free = MultiPolygon(parts)
        entered = [part for part in parts if shapely.intersects(part, request.path)]
        judged = MultiPolygon(entered or parts)
        return cls(water, free, judged, sum(part.area for part in entered) / free.area)


def _polygons(geometry: BaseGeometry) -> list[Polygon]:
    return [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon) and part.area > 0]


def _inradius(water: BaseGeometry) -> float:
    """Radius of the largest disc that fits in the water, in metres."""
    return max(shapely.maximum_inscribed_circle(part).length for part in _polygons(water))
