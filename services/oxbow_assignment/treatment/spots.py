"""Hot spots as they are given: checked against one another, and cut to the free space."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import HotSpot
from oxbow.errors import InvalidRequest
from oxbow.site.hot_spots import first_overlap

__all__ = ["require_treatable", "waters"]

LEAST = 1e-6
"""A smaller fraction of a hot spot in the free space counts as none."""


def require_treatable(spots: Sequence[HotSpot]) -> None:
    """Check that no two hot spots share a name or overlap, and that all have a value.

    Raises
    ------
    InvalidRequest
        Names the hot spots, and the value, or the area in which they overlap.
    """
    for name, count in Counter(spot.name for spot in spots).items():
        if count > 1:
            raise InvalidRequest(f"has {name!r} {count} times; expected once", where="hot_spots")
    for spot in spots:
        if spot.value <= 0.0:
            raise InvalidRequest(
                f"of hot spot {spot.name!r} is {spot.value:g}; expected > 0: where not all can be treated, value"
                " per metre comes first",
                where="value",
            )
    if overlap := first_overlap(spots):
        raise InvalidRequest(
            f"hot spots {overlap.one.name!r} and {overlap.other.name!r} overlap in {overlap.area_m2:.4g} m2;"
            " expected separate areas",
            where="hot_spots",
        )


def waters(spots: Sequence[HotSpot], free: Polygon) -> list[BaseGeometry]:
    """The part of each hot spot in the free space.

    Parameters
    ----------
    spots
        Hot spots.
    free
        The free space.

    Returns
    -------
    list of geometries
        Polygonal, one per hot spot; empty where there is next to no water.
    """
    cut = [shapely.intersection(spot.area, free) for spot in spots]
    areal = [_areal(geometry) for geometry in cut]
    return [
        water if water.area > LEAST * spot.area.area else Polygon()
        for spot, water in zip(spots, areal, strict=True)
    ]


def _areal(geometry: BaseGeometry) -> BaseGeometry:
    """The polygons of a geometry, without points and lines where shapes merely touch."""
    parts = shapely.get_parts(geometry)
    return MultiPolygon(parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON].tolist())
