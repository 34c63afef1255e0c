"""A Mission File from a GeoJSON polygon (RFC 7946): the exterior is the outline, holes are forbidden zones."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any

import msgspec
import shapely

from oxbow.contracts import MAX_REQUEST_BYTES, FloatArray
from oxbow.coordinates import GivenPolygon, lonlat_of, require_wgs84
from oxbow.errors import InvalidMission
from oxbow.frame import Frame, Position
from oxbow.mission import Bloom, Mission, MissionType
from oxbow.site import Site
from oxbow.strict_json import decode_json

__all__ = ["DOCUMENT", "mission_from_geojson"]

DOCUMENT = "GeoJSON"
"""What errors call the document as a whole."""


class _AreaKind(enum.StrEnum):
    POLYGON = "Polygon"
    MULTI_POLYGON = "MultiPolygon"


class _Kind(enum.StrEnum):
    FEATURE = "Feature"
    FEATURE_COLLECTION = "FeatureCollection"
    POLYGON = "Polygon"
    MULTI_POLYGON = "MultiPolygon"


class _Geometry(msgspec.Struct):
    type: _AreaKind
    coordinates: msgspec.Raw


class _Feature(msgspec.Struct):
    geometry: _Geometry
    properties: dict[str, Any] | None = None


class _Collection(msgspec.Struct):
    features: list[_Feature]


class _Head(msgspec.Struct):
    type: _Kind
    crs: Any = None


@dataclass(frozen=True)
class _Area:
    """One polygon: its rings as longitudes and latitudes, shape (n, 2), and where it stands in the document."""

    place: str
    rings: tuple[FloatArray, ...]
    name: str | None

    @property
    def km2(self) -> float:
        xy = Frame.around(self.rings[0]).to_planar(self.rings[0])
        return float(shapely.Polygon(xy).area) / 1e6 if len(xy) > 2 else 0.0


def mission_from_geojson(  # noqa: PLR0913 - one parameter for each field of the Mission File
    data: bytes,
    *,
    launch: Position,
    recovery: Position | None = None,
    mission_type: MissionType = MissionType.MAP,
    bloom: Bloom | None = None,
    site_name: str | None = None,
    safety_m: float = 0.0,
    length_m: float = 20_000.0,
    minimal_spatial_rate_m: float | None = None,
    part: int | None = None,
) -> Mission:
    """A mission on the water that a GeoJSON document describes.

    Parameters
    ----------
    data
        A Polygon or MultiPolygon, or a Feature or FeatureCollection of them, in WGS84 degrees.
    site_name
        The name of the site; by default the feature's property ``name``.
    part
        Which polygon of the document, from 0 in the order in which they stand there; needed where there are
        several. Nothing is chosen silently: a site is one water.

    Raises
    ------
    InvalidMission
        The document is not such GeoJSON, holds several polygons and `part` does not choose one, is not in
        degrees, or the mission's geometry breaks a rule (`oxbow.site.Site.of`).
    """
    area = _chosen(_areas(data), part)
    outline, *holes = (_positions(ring) for ring in area.rings)
    mission = Mission(
        mission_type=mission_type,
        site_name=site_name or area.name,
        launch=launch,
        recovery=recovery,
        outline=outline,
        forbidden_zones=tuple(holes),
        bloom=bloom,
        master_length_m=length_m,
        safety_m=safety_m,
        minimal_spatial_rate_m=minimal_spatial_rate_m,
    )
    Site.of(mission)
    return mission


def _areas(data: bytes) -> list[_Area]:
    """Every polygon of the document."""
    if len(data) > MAX_REQUEST_BYTES:
        raise InvalidMission(f"is {len(data)} bytes; expected at most {MAX_REQUEST_BYTES}", where=DOCUMENT)
    head = decode_json(data, _Head, DOCUMENT, at=DOCUMENT)
    require_wgs84(head.crs)
    match head.type:
        case _Kind.FEATURE_COLLECTION:
            features = decode_json(data, _Collection, DOCUMENT).features
            return [
                area
                for index, feature in enumerate(features)
                for area in _of_feature(feature, f"features[{index}].")
            ]
        case _Kind.FEATURE:
            return _of_feature(decode_json(data, _Feature, DOCUMENT), "")
        case _:
            return _of_geometry(decode_json(data, _Geometry, DOCUMENT), "", None)


def _of_feature(feature: _Feature, prefix: str) -> list[_Area]:
    name = (feature.properties or {}).get("name")
    return _of_geometry(feature.geometry, f"{prefix}geometry.", name if isinstance(name, str) else None)


def _of_geometry(geometry: _Geometry, prefix: str, name: str | None) -> list[_Area]:
    place, coordinates = f"{prefix}coordinates", bytes(geometry.coordinates)
    if geometry.type is _AreaKind.POLYGON:
        rings = decode_json(coordinates, GivenPolygon, DOCUMENT, at=place)
        return [_area(place, rings, name)]
    polygons = decode_json(coordinates, list[GivenPolygon], DOCUMENT, at=place)
    return [_area(f"{place}[{index}]", rings, name) for index, rings in enumerate(polygons)]


def _area(place: str, rings: list[list[list[float]]], name: str | None) -> _Area:
    return _Area(place, tuple(_ring(f"{place}[{index}]", ring) for index, ring in enumerate(rings)), name)


def _ring(place: str, points: list[list[float]]) -> FloatArray:
    """A ring in degrees, less its closing point."""
    degrees = lonlat_of(points, place)
    return degrees[:-1] if len(degrees) > 1 and (degrees[0] == degrees[-1]).all() else degrees


def _chosen(areas: list[_Area], part: int | None) -> _Area:
    if not areas:
        raise InvalidMission("holds no polygon", where=DOCUMENT)
    if part is None and len(areas) == 1:
        return areas[0]
    if part is None or not 0 <= part < len(areas):
        largest = sorted(enumerate(areas), key=lambda item: -item[1].km2)[:5]
        sizes = ", ".join(f"{index} ({area.km2:.4g} km2)" for index, area in largest)
        asked = "holds" if part is None else f"has no part {part}: it holds"
        raise InvalidMission(
            f"{asked} {len(areas)} polygons; choose one water by its part number, largest first: {sizes}",
            where=DOCUMENT,
        )
    return areas[part]


def _positions(ring: FloatArray) -> tuple[Position, ...]:
    return tuple(Position(lat=lat, long=long) for long, lat in ring.tolist())
