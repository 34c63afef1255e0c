"""Hot spots: what a prior model says is to be treated, from degrees to areas in a site's planar metres."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import HotSpot
from oxbow.errors import InvalidMission
from oxbow.frame import Frame
from oxbow.prior import PriorFeature
from oxbow.weights import planar

__all__ = ["HotSpots", "hot_spots"]

OVERLAP = 1e-3
"""Hot spots overlap where they share more than this part of the smaller one: less is rounding."""


@dataclass(frozen=True)
class HotSpots:
    """The hot spots of a site, and what its mission's author should know."""

    spots: tuple[HotSpot, ...] = ()
    warnings: tuple[str, ...] = ()


def hot_spots(
    features: Sequence[tuple[int, PriorFeature]],
    frame: Frame,
    outline: Polygon,
    water: BaseGeometry,
    swath_m: float,
) -> HotSpots:
    """The hot spots that features with a value stand for.

    Parameters
    ----------
    features
        What is to be treated, with its index in the prior model. Each polygon of one is a hot spot; a point is a
        disc whose radius is the swath, and the discs of one MultiPoint that overlap are one hot spot.
    frame
        The site's plane.
    outline, water
        The site's contour in that plane, and what of it is not forbidden.
    swath_m
        The width that one pass treats.

    Raises
    ------
    InvalidMission
        A hot spot lies within the outline but not in the water, or two overlap; the error names the feature.
    """
    spots: list[HotSpot] = []
    warnings: list[str] = []
    shapely.prepare([outline, water])
    for index, feature in features:
        where = f"PriorModel.features[{index}]"
        geometry = planar(feature.geometry, frame, outline)
        if not outline.intersects(geometry):
            warnings.append(f"{where} lies outside the water: it is not treated")
            continue
        _require_water(geometry, water, where)
        spots += _spots(geometry, f"features[{index}]", float(feature.value or 0.0), swath_m)
    in_water = [spot for spot in spots if spot.area.intersects(water)]
    _require_apart(in_water)
    return HotSpots(tuple(in_water), tuple(warnings))


def _require_water(geometry: BaseGeometry, water: BaseGeometry, where: str) -> None:
    wet = geometry.intersection(water)
    if wet.is_empty or wet.area < OVERLAP * geometry.area:
        place = geometry.representative_point()
        raise InvalidMission(
            f"is a hot spot on land or in a forbidden zone, at ({place.x:.0f}, {place.y:.0f}) m from the middle of"
            " the site; expected one in the water",
            where=where,
        )


def _spots(geometry: BaseGeometry, name: str, value: float, swath_m: float) -> Iterator[HotSpot]:
    areas = geometry if geometry.area > 0 else geometry.buffer(swath_m)
    parts = [part for part in shapely.get_parts(areas) if part.area > 0]
    for number, area in enumerate(parts):
        own_name = name if len(parts) == 1 else f"{name}[{number}]"
        yield HotSpot(name=own_name, area=area, value=value)


def _require_apart(spots: Sequence[HotSpot]) -> None:
    areas = np.array([spot.area for spot in spots], dtype=object)
    one, other = STRtree(areas).query(areas, predicate="intersects")
    one, other = one[one < other], other[one < other]
    shared_m2 = shapely.area(shapely.intersection(areas[one], areas[other]))
    smaller_m2 = np.minimum(shapely.area(areas[one]), shapely.area(areas[other]))
    overlapping = np.flatnonzero(shared_m2 > OVERLAP * smaller_m2)
    if len(overlapping):
        first = overlapping[0]
        raise InvalidMission(
            f"overlaps {spots[int(one[first])].name} by {shared_m2[first]:.0f} m2; expected hot spots apart from"
            " one another, and none inside another",
            where=f"PriorModel.{spots[int(other[first])].name}",
        )
