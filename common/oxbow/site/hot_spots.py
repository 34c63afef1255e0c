"""Hot spots: what a prior model says is to be treated, from degrees to areas in a site's planar metres."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import Geometries
from oxbow.contracts import HotSpot
from oxbow.errors import InvalidMission
from oxbow.geometry.frame import Frame
from oxbow.mission.prior import PriorFeature
from oxbow.site.weights import planar

__all__ = ["HotSpots", "Overlap", "first_overlap", "hot_spots"]

LEAST_PART = 1e-3
"""A smaller share of a hot spot than this is rounding, be it its overlap with another or its part in the water."""


@dataclass(frozen=True)
class HotSpots:
    """The hot spots of a site, and warnings for its mission's author."""

    spots: tuple[HotSpot, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Overlap:
    """Two hot spots that overlap, the earlier one first, and the area that both have in common."""

    one: HotSpot
    other: HotSpot
    area_m2: float


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

    Returns
    -------
    HotSpots
        The hot spots in the water, and a warning about each that lies outside it.

    Raises
    ------
    InvalidMission
        A hot spot within the outline has a value that is not above 0 or does not lie in the water, or two overlap;
        the error names the feature.
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
        # Hot spots are drawn roughly, and may reach ashore; one that is all on land is a mistake.
        _require_water(geometry, water, frame, where)
        given = shapely.transform(shapely.get_parts(feature.geometry), frame.to_planar)
        areas = _in_order(_areas(geometry, swath_m, outline), given)
        for spot in _spots(areas, f"features[{index}]", _worth(feature, where)):
            if spot.area.intersects(water):
                spots.append(spot)
            else:
                warnings.append(f"PriorModel.{spot.name} lies outside the water: it is not treated")
    # Overlaps would be treated, and counted, twice.
    if overlap := first_overlap(spots):
        raise InvalidMission(
            f"overlaps {overlap.one.name} by {overlap.area_m2:.0f} m2; expected separate hot spots,"
            " and none inside another",
            where=f"PriorModel.{overlap.other.name}",
        )
    return HotSpots(tuple(spots), tuple(warnings))


def first_overlap(spots: Sequence[HotSpot]) -> Overlap | None:
    """Two of several hot spots that overlap by more than rounding; None where all are apart."""
    areas = np.array([spot.area for spot in spots], dtype=object)
    one, other = STRtree(areas).query(areas, predicate="intersects")
    one, other = one[one < other], other[one < other]
    shared_m2 = shapely.area(shapely.intersection(areas[one], areas[other]))
    smaller_m2 = np.minimum(shapely.area(areas[one]), shapely.area(areas[other]))
    # The first pair alone: an error names one, and its author mends the file step by step.
    for pair in np.flatnonzero(shared_m2 > LEAST_PART * smaller_m2)[:1].tolist():
        return Overlap(spots[one[pair]], spots[other[pair]], float(shared_m2[pair]))
    return None


def _worth(feature: PriorFeature, where: str) -> float:
    """The value of a feature that is to be treated."""
    if feature.value is None or feature.value <= 0.0:
        raise InvalidMission(
            f"is {feature.value!r}; expected > 0: where not all hot spots can be treated, those of most value per"
            " metre of way come first",
            where=f"{where}.properties.value",
        )
    return feature.value


def _require_water(geometry: BaseGeometry, water: BaseGeometry, frame: Frame, where: str) -> None:
    wet = geometry.intersection(water)
    if wet.is_empty or wet.area < LEAST_PART * geometry.area:
        long, lat = frame.to_degrees(shapely.get_coordinates(geometry.representative_point()))[0]
        raise InvalidMission(
            f"is a hot spot on land or in a forbidden zone, at lat {lat:.6f}, long {long:.6f}; expected one in the"
            " water",
            where=where,
        )


def _areas(geometry: BaseGeometry, swath_m: float, outline: Polygon) -> list[Polygon]:
    """The polygons of a feature, or the discs about its points."""
    # A point stands for water of unknown extent: a disc in which any pass within a swath of it counts.
    areas = geometry if geometry.area > 0 else _near(geometry.buffer(swath_m), outline)
    # Twice: what is made valid may be a collection with a multipolygon among its parts.
    return [part for part in shapely.get_parts(shapely.get_parts(areas)) if part.area > 0]


def _near(discs: BaseGeometry, outline: Polygon) -> BaseGeometry:
    """Discs without what is far from the site: wide ones would reach out of its plane."""
    west, south, east, north = outline.bounds
    surroundings = shapely.envelope(outline).buffer(math.hypot(east - west, north - south), join_style="mitre")
    return discs if discs.within(surroundings) else discs.intersection(surroundings)


def _in_order(areas: list[Polygon], given: Geometries) -> list[Polygon]:
    """Areas in the order of the geometries that they are made of, which clipping and uniting them may change."""
    return sorted(areas, key=lambda area: int(np.nanargmin(shapely.distance(given, area))))


def _spots(areas: Sequence[Polygon], name: str, value: float) -> Iterator[HotSpot]:
    for number, area in enumerate(areas):
        own_name = name if len(areas) == 1 else f"{name}[{number}]"
        yield HotSpot(name=own_name, area=area, value=value)
