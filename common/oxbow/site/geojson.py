"""A Mission File from GeoJSON (RFC 7946): a polygon's exterior is the outline, its holes are forbidden zones."""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import shapely

from oxbow.arrays import FloatArray
from oxbow.contracts import MAX_REQUEST_BYTES
from oxbow.errors import InvalidMission, about_mission
from oxbow.geometry.antimeridian import joined_at_antimeridian
from oxbow.geometry.frame import Frame, Position
from oxbow.mission.coordinates import GivenPolygon, lonlat_of, require_wgs84
from oxbow.mission.file import Bloom, Mission, MissionType
from oxbow.site.site import Site
from oxbow.wire.strict_json import decode_json, utf8

__all__ = ["DOCUMENT", "ImportedMission", "mission_from_geojson"]

DOCUMENT = "GeoJSON"
"""What errors call the document as a whole."""
MOST_LISTED = 5
"""At most this many of several polygons are named in an error, largest first."""


class _FeatureKind(enum.StrEnum):
    FEATURE = "Feature"


class _GeometryKind(enum.StrEnum):
    POLYGON = "Polygon"
    MULTI_POLYGON = "MultiPolygon"
    GEOMETRY_COLLECTION = "GeometryCollection"
    POINT = "Point"
    MULTI_POINT = "MultiPoint"
    LINE_STRING = "LineString"
    MULTI_LINE_STRING = "MultiLineString"


class _Kind(enum.StrEnum):
    FEATURE = "Feature"
    FEATURE_COLLECTION = "FeatureCollection"
    POLYGON = "Polygon"
    MULTI_POLYGON = "MultiPolygon"
    GEOMETRY_COLLECTION = "GeometryCollection"
    POINT = "Point"
    MULTI_POINT = "MultiPoint"
    LINE_STRING = "LineString"
    MULTI_LINE_STRING = "MultiLineString"


class _Geometry(msgspec.Struct):
    type: _GeometryKind
    coordinates: msgspec.Raw = msgspec.Raw()
    geometries: list[_Geometry] = []
    crs: Any = None


class _Feature(msgspec.Struct):
    type: _FeatureKind
    geometry: _Geometry | None
    properties: dict[str, Any] | None = None
    crs: Any = None


class _Collection(msgspec.Struct):
    features: list[_Feature]


class _Head(msgspec.Struct):
    type: _Kind
    crs: Any = None


@dataclass(frozen=True)
class ImportedMission:
    """A mission, and notes for its author on how the document was read."""

    mission: Mission
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Placed:
    """A geometry of the document, where it stands there, and the name of its feature."""

    place: str
    geometry: _Geometry | None
    name: str | None = None

    @property
    def kind(self) -> str:
        return "feature without a geometry" if self.geometry is None else self.geometry.type.value


@dataclass(frozen=True, eq=False)
class _Area:
    """A polygon: its rings as longitudes and latitudes, shape (n, 2), and where it stands in the document."""

    place: str
    rings: tuple[FloatArray, ...]
    name: str | None

    @property
    def km2(self) -> float:
        shell = self.rings[0]
        if len(shell) < 3:
            return 0.0
        return float(shapely.Polygon(Frame.around(shell).to_planar(shell)).area) / 1e6

    @property
    def rough_size(self) -> float:
        """What orders areas by size, without a map projection for each."""
        shell = self.rings[0]
        if len(shell) < 3:
            return 0.0
        # A degree of longitude shrinks with the cosine of the latitude; the error of one latitude for all is
        # small here.
        return float(shapely.Polygon(shell).area * np.cos(np.radians(shell[0, 1])))


@dataclass(frozen=True)
class _Water:
    """The area that is planned on, and notes on how the document was read."""

    area: _Area
    notes: tuple[str, ...]


@about_mission()
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
) -> ImportedMission:
    """A mission on the water that a GeoJSON document describes.

    Parameters
    ----------
    data
        Any GeoJSON that holds a polygon, in WGS84 degrees. What is no polygon is passed over, with a note.
        Polygons that were cut at the antimeridian (RFC 7946, section 3.1.9) are one again.
    site_name
        The name of the site; by default the feature's property ``name``.
    part
        Which polygon of the document, from 0 in the order in which they stand there; needed where there are
        several. Nothing is chosen silently: a site is one water.
    launch, recovery, mission_type, bloom, safety_m, length_m, minimal_spatial_rate_m
        Fields of the mission, `length_m` that of its master; see `oxbow.mission.file.Mission`.

    Returns
    -------
    ImportedMission
        The mission, its geometry checked, with notes on what of the document was passed over or joined.

    Raises
    ------
    InvalidMission
        The document is not such GeoJSON, holds several polygons and `part` does not choose one, is not in
        degrees, or the mission's geometry breaks a rule (`oxbow.site.site.Site.of`).
    """
    water = _water(data, part)
    outline, *holes = (_positions(ring) for ring in water.area.rings)
    mission = Mission(
        mission_type=mission_type,
        site_name=site_name or water.area.name,
        launch=launch,
        recovery=recovery,
        outline=outline,
        forbidden_zones=tuple(holes),
        bloom=bloom,
        master_length_m=length_m,
        safety_m=safety_m,
        minimal_spatial_rate_m=minimal_spatial_rate_m,
    )
    # For its checks alone: what cannot be planned is refused now, while the author looks at the document.
    Site.of(mission)
    return ImportedMission(mission, water.notes)


# --------------------------------------------------------------------------- the document


def _geometries(data: bytes) -> Iterator[_Placed]:
    """Every geometry of the document, those of collections one by one."""
    if len(data) > MAX_REQUEST_BYTES:
        raise InvalidMission(f"is {len(data)} bytes; expected at most {MAX_REQUEST_BYTES}", where=DOCUMENT)
    data = utf8(data, DOCUMENT)
    head = decode_json(data, _Head, DOCUMENT, at=DOCUMENT)
    require_wgs84(head.crs)
    match head.type:
        case _Kind.FEATURE_COLLECTION:
            for index, feature in enumerate(decode_json(data, _Collection, DOCUMENT).features):
                yield from _of_feature(feature, f"features[{index}].")
        case _Kind.FEATURE:
            yield from _of_feature(decode_json(data, _Feature, DOCUMENT), "")
        case _:
            yield from _single(_Placed("", decode_json(data, _Geometry, DOCUMENT)))


def _of_feature(feature: _Feature, prefix: str) -> Iterator[_Placed]:
    require_wgs84(feature.crs, f"{prefix}crs")
    name = (feature.properties or {}).get("name")
    yield from _single(_Placed(f"{prefix}geometry.", feature.geometry, name if isinstance(name, str) else None))


def _single(placed: _Placed) -> Iterator[_Placed]:
    """A geometry, or those of a collection, however deep they stand in it, in their order."""
    # A stack of our own: collections may be nested deeper than Python recurses.
    waiting = [placed]
    while waiting:
        one = waiting.pop()
        if one.geometry is not None:
            require_wgs84(one.geometry.crs, f"{one.place}crs")
        if one.geometry is None or one.geometry.type is not _GeometryKind.GEOMETRY_COLLECTION:
            yield one
            continue
        inner = [
            _Placed(f"{one.place}geometries[{index}].", geometry, one.name)
            for index, geometry in enumerate(one.geometry.geometries)
        ]
        waiting += reversed(inner)


def _has_area(placed: _Placed) -> bool:
    kinds = _GeometryKind.POLYGON, _GeometryKind.MULTI_POLYGON
    return placed.geometry is not None and placed.geometry.type in kinds


def _areas(placed: _Placed) -> list[_Area]:
    """The polygons of a geometry; none of one without an area, or without coordinates (RFC 7946, section 3.1)."""
    if placed.geometry is None or not _has_area(placed):
        return []
    place, coordinates = f"{placed.place}coordinates", bytes(placed.geometry.coordinates)
    if not coordinates:
        raise InvalidMission("is missing; it is required", where=place)
    if not decode_json(coordinates, list[msgspec.Raw], DOCUMENT, at=place):
        return []
    if placed.geometry.type is _GeometryKind.POLYGON:
        polygons = {place: decode_json(coordinates, GivenPolygon, DOCUMENT, at=place)}
    else:
        several = decode_json(coordinates, list[GivenPolygon], DOCUMENT, at=place)
        polygons = {f"{place}[{index}]": rings for index, rings in enumerate(several)}
    return [
        _Area(at, tuple(_ring(f"{at}[{index}]", ring) for index, ring in enumerate(rings)), placed.name)
        for at, rings in polygons.items()
    ]


def _ring(place: str, points: list[list[float]]) -> FloatArray:
    """A ring in degrees, less its closing point, however often it is repeated."""
    degrees = lonlat_of(points, place)
    # Up to the last point that differs from the first: some programs close a ring more than once.
    others = np.flatnonzero((degrees != degrees[:1]).any(axis=1))
    return degrees[: others[-1] + 1] if len(others) else degrees[:1]


# --------------------------------------------------------------------------- which water


def _water(data: bytes, part: int | None) -> _Water:
    """The water that a document describes, or its part of that number."""
    geometries = list(_geometries(data))
    given = [area for geometry in geometries for area in _areas(geometry)]
    passed_over = Counter(geometry.kind for geometry in geometries if not _has_area(geometry))
    # Areas first cut at the antimeridian are joined: their halves would be two waters.
    area = _chosen(_joined(given), part, passed_over)
    notes = [f"passed over {_counted(passed_over)}: only polygons are water"] if passed_over else []
    if area not in given:
        notes.append(f"{area.place} were cut at the antimeridian: joined into one water")
    return _Water(area, tuple(notes))


def _joined(areas: Sequence[_Area]) -> list[_Area]:
    """The areas, those that were cut at the antimeridian in one again."""
    joined = joined_at_antimeridian([area.rings for area in areas])
    return [
        areas[one.members[0]]
        if len(one.members) == 1
        else _Area(
            ", ".join(areas[index].place for index in one.members),
            one.rings,
            next((areas[index].name for index in one.members if areas[index].name), None),
        )
        for one in joined
    ]


def _chosen(areas: Sequence[_Area], part: int | None, passed_over: Counter[str]) -> _Area:
    if not areas:
        seen = f", but {_counted(passed_over)}" if passed_over else ""
        raise InvalidMission(f"contains no polygon{seen}", where=DOCUMENT)
    if part is None and len(areas) == 1:
        return areas[0]
    if part is None or not 0 <= part < len(areas):
        asked = "holds" if part is None else f"has no part {part}: it holds"
        raise InvalidMission(
            f"{asked} {len(areas)} polygons; choose one water by its part number, largest first: {_sizes(areas)}",
            where=DOCUMENT,
        )
    return areas[part]


def _sizes(areas: Sequence[_Area]) -> str:
    """The largest areas: number, name and size."""
    # By rough size: an exact one needs a projection, which takes a millisecond for each of thousands of polygons.
    largest = sorted(range(len(areas)), key=lambda index: -areas[index].rough_size)[:MOST_LISTED]
    texts = [
        f"{index} ({', '.join(filter(None, (areas[index].name, f'{areas[index].km2:.4g} km2')))})"
        for index in largest
    ]
    return ", ".join(texts) + (f" and {len(areas) - MOST_LISTED} more" if len(areas) > MOST_LISTED else "")


def _counted(kinds: Counter[str]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in kinds.items())


def _positions(ring: FloatArray) -> tuple[Position, ...]:
    return tuple(Position(lat=lat, long=long) for long, lat in ring.tolist())
