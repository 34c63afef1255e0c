"""The weights of a prior model, from polygons in degrees to areas in a site's planar metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon, STRtree, box
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray, Indices, Mask
from oxbow.contracts import WeightedArea
from oxbow.geometry.frame import Frame
from oxbow.mission.prior import PriorModel

__all__ = ["planar", "weighted_areas"]

EDGE_DEG = 0.01
"""Edges are straight in degrees (RFC 7946, section 3.1.1); this short, they are straight in the plane to 2 cm."""
MARGIN_DEG = 1e-3
INTERIORS_MEET = "T********"


def weighted_areas(prior: PriorModel, frame: Frame, outline: Polygon) -> tuple[WeightedArea, ...]:
    """Where sampling a site is more or less important than elsewhere.

    Parameters
    ----------
    prior
        Polygons with weights; where they overlap, the last one counts.
    frame
        The site's plane.
    outline
        The site's contour in that plane.

    Returns
    -------
    tuple of WeightedArea
        Areas of weights other than 1. They meet the outline, though they may reach beyond it, and do not overlap.
    """
    weighted = [feature for feature in prior.features if feature.weight is not None]
    given = _Weighted(
        np.array([feature.geometry for feature in weighted]), np.array([feature.weight for feature in weighted])
    )
    in_degrees = given.parts().clipped(_surroundings(frame, outline)).painted()
    in_plane = shapely.transform(shapely.segmentize(in_degrees.areas, EDGE_DEG), frame.to_planar)
    # Rounding may turn a needle inside out.
    planar = _Weighted(shapely.make_valid(in_plane), in_degrees.weights).parts()
    shapely.prepare(outline)
    chosen = planar.where(shapely.intersects(outline, planar.areas) & (planar.weights != 1.0))
    pairs = zip(chosen.areas, chosen.weights.tolist(), strict=True)
    return tuple(WeightedArea(area=area, weight=weight) for area, weight in pairs)


def planar(geometry: BaseGeometry, frame: Frame, outline: Polygon) -> BaseGeometry:
    """A geometry, from degrees to the plane of a site; what is far from the site's outline is cut off.

    Parameters
    ----------
    geometry
        In degrees, with longitudes from -180 or from 0.
    frame
        The site's plane.
    outline
        The site's contour in that plane.

    Returns
    -------
    shapely geometry
        Valid, in planar metres; empty where nothing of it is near the site.
    """
    near = geometry.intersection(_surroundings(frame, outline))
    return shapely.make_valid(shapely.transform(shapely.segmentize(near, EDGE_DEG), frame.to_planar))


def _surroundings(frame: Frame, outline: Polygon) -> MultiPolygon:
    """The site's box in degrees, and again a turn of the Earth to the west and to the east.

    Far from a site its plane is of no use, and longitudes may be counted from -180 or from 0.
    """
    # Sides that are straight in the plane bulge in degrees: corners alone would give too small a box.
    rim = shapely.segmentize(shapely.envelope(outline), 0.05 * outline.length)
    long, lat = frame.to_degrees(shapely.get_coordinates(rim)).T
    # Counted from the site's own meridian: one that lies across the antimeridian still has one box.
    long = (long - frame.long + 180.0) % 360.0 - 180.0 + frame.long
    site = box(long.min(), lat.min(), long.max(), lat.max()).buffer(MARGIN_DEG, join_style="mitre")
    return MultiPolygon([translate(site, turn) for turn in (-360.0, 0.0, 360.0)])


@dataclass(frozen=True)
class _Weighted:
    """Geometries (n,) and the weight of each (n,)."""

    areas: npt.NDArray[Any]
    weights: FloatArray

    def where(self, chosen: Mask | Indices) -> _Weighted:
        return _Weighted(self.areas[chosen], self.weights[chosen])

    def parts(self) -> _Weighted:
        """The polygons that the geometries are made of, each on its own."""
        parts, owners = shapely.get_parts(self.areas, return_index=True)
        parts, owner_of_part = shapely.get_parts(parts, return_index=True)
        return _Weighted(parts, self.weights[owners[owner_of_part]]).where(shapely.area(parts) > 0)

    def clipped(self, region: MultiPolygon) -> _Weighted:
        """What of each area lies in a region."""
        shapely.prepare(region)
        meeting = self.where(shapely.intersects(region, self.areas))
        return _Weighted(shapely.intersection(meeting.areas, region), meeting.weights).parts()

    def painted(self) -> _Weighted:
        """What is left of each area once those after it are painted over it, as layers of a map are."""
        pairs = STRtree(self.areas).query(self.areas)
        lower, upper = pairs[:, pairs[1] > pairs[0]]
        # Areas that only touch, as cells of a raster do, leave one another whole: a difference would cost time,
        # and add vertices along their common sides.
        covers = shapely.relate_pattern(self.areas[lower], self.areas[upper], INTERIORS_MEET)
        lower, upper = lower[covers], upper[covers]
        areas = self.areas.copy()
        for index in np.unique(lower):
            areas[index] = areas[index].difference(shapely.union_all(self.areas[upper[lower == index]]))
        return _Weighted(areas, self.weights).parts()
