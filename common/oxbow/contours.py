"""Contours of a Mission File in planar metres: the polygons of its outline and of its zones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, Polygon

from oxbow.contracts import FloatArray
from oxbow.errors import InvalidMission
from oxbow.frame import Frame, Position, lonlat
from oxbow.mission import Mission

__all__ = ["Contour", "Zone", "danger_zones", "forbidden_zones"]

LEAST_WIDTH_M = 1e-3
"""Points that lie in a strip narrower than this lie on one line."""


@dataclass(frozen=True)
class Contour:
    """A contour without its repeated points: `indices` tell where in the Mission File each point stands."""

    name: str
    degrees: FloatArray
    indices: np.ndarray[tuple[int], np.dtype[np.intp]]

    @classmethod
    def of(cls, name: str, positions: Sequence[Position]) -> Contour:
        degrees = lonlat(positions)
        indices = np.flatnonzero((degrees != np.roll(degrees, 1, axis=0)).any(axis=1))
        if len(indices) < 3:
            raise _too_few(name, degrees)
        return cls(name, degrees[indices], indices)

    def planar(self, frame: Frame) -> Polygon:
        """The contour as a polygon that has an area; it may meet itself."""
        xy = frame.to_planar(self.degrees)
        if not np.isfinite(xy).all():
            raise InvalidMission("reaches to the other side of the Earth", where=self.name)
        hull = shapely.convex_hull(LineString(xy))
        if hull.area < LEAST_WIDTH_M * hull.length:
            if len(np.unique(self.degrees, axis=0)) < 3:
                raise _too_few(self.name, self.degrees)
            raise InvalidMission(
                "has all its points on one line; expected a contour with an area", where=self.name
            )
        return Polygon(xy)


def _too_few(name: str, degrees: FloatArray) -> InvalidMission:
    distinct = len(np.unique(degrees, axis=0))
    return InvalidMission(f"has {distinct} distinct points; expected at least 3", where=name)


@dataclass(frozen=True)
class Zone:
    """What a zone's contour stands for: polygons, none of them where it lies outside, and what is to be known."""

    parts: tuple[Polygon, ...] = ()
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(cls, name: str, what: str, contour: Polygon, site: Polygon, site_name: str) -> Zone:
        """A zone of this name, which is `what`; `site` is the outline, and `site_name` the field that has it."""
        parts = (contour,) if contour.is_valid else _enclosed(contour)
        warnings = () if contour.is_valid else (f"{name} meets itself: all that it encloses is {what}",)
        if not shapely.intersects(site, parts).any():
            return cls(warnings=(*warnings, f"{name} lies outside {site_name}: it changes nothing"))
        return cls(parts, warnings)


def forbidden_zones(mission: Mission, frame: Frame, outline: Polygon) -> list[Zone]:
    """A mission's forbidden zones, one by one."""
    names = [f"ForbiddenZones[{index}]" for index in range(len(mission.forbidden_zones))]
    return [
        Zone.of(name, "forbidden", Contour.of(name, contour).planar(frame), outline, mission.outline_name)
        for name, contour in zip(names, mission.forbidden_zones, strict=True)
    ]


def danger_zones(mission: Mission, frame: Frame, outline: Polygon) -> list[Zone]:
    """A mission's danger zones, one by one."""
    contours = [
        Contour.of(f"DangerZones[{index}].Contour", zone.contour).planar(frame)
        for index, zone in enumerate(mission.danger_zones or ())
    ]
    return [
        Zone.of(f"DangerZones[{index}]", "dangerous", contour, outline, mission.outline_name)
        for index, contour in enumerate(contours)
    ]


def _enclosed(zone: Polygon) -> tuple[Polygon, ...]:
    """All that a contour which meets itself encloses, whichever way it was meant."""
    faces = shapely.polygonize([shapely.node(zone.exterior)])
    whole = shapely.union_all(shapely.get_parts(faces))
    return tuple(Polygon(part.exterior) for part in shapely.get_parts(whole))
