"""The coordinates of GeoJSON (RFC 7946): longitudes and latitudes in WGS84 degrees, checked where they come in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import msgspec
import numpy as np

from oxbow.contracts import FloatArray
from oxbow.errors import InvalidMission

__all__ = ["GivenPoint", "GivenPolygon", "lonlat_of", "require_wgs84"]

WGS84_NAMES = ("CRS84", "EPSG:4326", "EPSG::4326")

GivenPoint = Annotated[list[float], msgspec.Meta(min_length=2)]
"""A position as GeoJSON has it: longitude, latitude, and perhaps a height."""

GivenPolygon = Annotated[list[list[GivenPoint]], msgspec.Meta(min_length=1)]
"""A polygon as GeoJSON has it: the exterior ring, then the holes."""


def lonlat_of(points: Sequence[Sequence[float]], place: str) -> FloatArray:
    """Positions in degrees, shape (n, 2), less their heights; `place` is what errors call the list."""
    degrees = np.array([point[:2] for point in points], dtype=np.float64).reshape(-1, 2)
    wrong = (np.abs(degrees) > (360.0, 90.0)).any(axis=1)
    if wrong.any():
        index = int(np.argmax(wrong))
        raise InvalidMission(
            f"is {points[index][:2]}; expected [longitude, latitude] in WGS84 degrees (projected metres, or"
            " latitude before longitude?)",
            where=f"{place}[{index}]",
        )
    return degrees


def require_wgs84(crs: Any, place: str = "crs") -> None:
    """GeoJSON is WGS84; files older than RFC 7946 may say otherwise in a `crs` member."""
    if crs is not None and not any(name in str(crs) for name in WGS84_NAMES):
        raise InvalidMission(f"is {crs}; expected WGS84 degrees (no crs, or CRS84)", where=place)
