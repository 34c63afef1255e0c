"""The coordinates of GeoJSON (RFC 7946): longitudes and latitudes in WGS84 degrees, checked where they come in."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any

import msgspec
import numpy as np

from oxbow.arrays import FloatArray
from oxbow.errors import InvalidMission

__all__ = ["GivenPoint", "GivenPolygon", "lonlat_of", "require_wgs84"]

WGS84_CODES = frozenset(
    {("EPSG", "4326"), ("EPSG", "4979"), ("OGC", "CRS84"), ("OGC", "CRS84H"), ("OGC", "84"), ("", "WGS84")}
)
"""WGS84 in degrees, with heights and without: authority and code, in capital letters.

By its definition, EPSG:4326 has latitudes first; GeoJSON has longitudes first under every name (GeoJSON 2008).
"""

_SYSTEM = re.compile(
    r"(?:urn:(?:x-)?ogc:def:crs:)?(?:(?P<authority>EPSG|OGC):)?(?:[\d.]*:)?(?P<code>\w+)"
    r"|https?://www\.opengis\.net/def/crs/(?P<uri_authority>EPSG|OGC)/[\d.]+/(?P<uri_code>\w+)",
    re.IGNORECASE,
)

GivenPoint = Annotated[list[float], msgspec.Meta(min_length=2)]
"""A position as GeoJSON has it: longitude, latitude, and perhaps a height."""

GivenPolygon = Annotated[list[list[GivenPoint]], msgspec.Meta(min_length=1)]
"""A polygon as GeoJSON has it: the exterior ring, then the holes."""


def lonlat_of(points: Sequence[Sequence[float]], place: str) -> FloatArray:
    """Positions in degrees, shape (n, 2), without their heights.

    Parameters
    ----------
    points
        Longitude and latitude of each, perhaps with a height.
    place
        What errors call the list.

    Returns
    -------
    ndarray, shape (n, 2)
        Longitudes and latitudes in degrees.

    Raises
    ------
    InvalidMission
        A longitude or a latitude is out of range; the error has the position's index.
    """
    degrees = np.array([point[:2] for point in points], dtype=np.float64).reshape(-1, 2)
    # A whole turn: longitudes may be counted from -180 or from 0.
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
    """GeoJSON is WGS84; files older than RFC 7946 may say otherwise in a `crs` member.

    Parameters
    ----------
    crs
        The member; None where there is none. Accepted are the names of WGS84, in full: as a URN, as a URI, as
        ``EPSG:4326`` or ``CRS84``.
    place
        What errors call the member.

    Raises
    ------
    InvalidMission
        It is another system, or cannot be read.
    """
    if crs is None:
        return
    name = _system_name(crs)
    if name is None or _system_code(name) not in WGS84_CODES:
        raise InvalidMission(
            f"is {crs if name is None else name}; expected WGS84 degrees (no crs, or CRS84)", place
        )


def _system_name(crs: Any) -> str | None:
    """What a `crs` member calls the system, where it names one."""
    if isinstance(crs, str):
        return crs
    properties = crs.get("properties") if isinstance(crs, dict) else None
    if not isinstance(properties, dict):
        return None
    if "code" in properties:  # {"type": "EPSG", "properties": {"code": 4326}}, before 2008
        return f"EPSG:{properties['code']}"
    # As the GeoJSON of 2008 has it: {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}.
    name = properties.get("name")
    return name if isinstance(name, str) else None


def _system_code(name: str) -> tuple[str, str]:
    """Authority and code of a system's name; those of CRS84 are written in several ways."""
    match = _SYSTEM.fullmatch(name.strip().replace("CRS:84", "CRS84").replace("WGS 84", "WGS84"))
    if match is None:
        return "", name
    code = (match["code"] or match["uri_code"]).upper()
    authority = (match["authority"] or match["uri_authority"] or "").upper()
    return ("OGC" if not authority and code.startswith("CRS84") else authority), code
