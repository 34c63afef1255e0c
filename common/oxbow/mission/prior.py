"""The prior model of a mission: where sampling matters more, what values are expected, how the field varies.

It is the Mission File's `PriorModel`, a GeoJSON FeatureCollection (RFC 7946). Rendas and Li 2016, section 1.1,
name the field and leave its content open; `docs/mission-file.md` describes it.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import msgspec
import shapely
from shapely import MultiPoint, MultiPolygon, Point, Polygon
from shapely.geometry import mapping
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray
from oxbow.contracts import Variogram
from oxbow.errors import InvalidInput, InvalidMission
from oxbow.geometry.crossings import MOST_PAIRS, TooManyPairs, is_valid
from oxbow.mission.coordinates import GivenPoint, GivenPolygon, lonlat_of, require_wgs84
from oxbow.wire.strict_json import decode_json, utf8, with_extra

__all__ = ["PriorFeature", "PriorModel", "parse_prior", "prior_document"]

T = TypeVar("T", bound=msgspec.Struct)

LEAST_RING = 4
"""Positions of a ring: the last repeats the first."""


class PriorFeature(msgspec.Struct, frozen=True, kw_only=True):
    """A place of which something is known beforehand: a weight, a value, or both.

    Parameters
    ----------
    geometry
        A Polygon, MultiPolygon, Point or MultiPoint; longitudes and latitudes in WGS84 degrees.
    weight
        How many times as important sampling is in this polygon as elsewhere, where the weight is 1.
    value
        The field's value here, in the unit of the mission's sensor.
    properties, extra
        Other properties, and other members of the feature, kept unchanged.
    """

    geometry: BaseGeometry
    weight: float | None = None
    value: float | None = None
    properties: dict[str, Any] = {}
    extra: dict[str, Any] = {}

    def __post_init__(self) -> None:
        self._check_geometry()
        if self.weight is None and self.value is None:
            raise InvalidMission("have neither weight nor value; expected one or both", where="properties")
        if self.weight is not None and not (math.isfinite(self.weight) and self.weight >= 0):
            raise InvalidMission(f"is {self.weight!r}; expected a finite number >= 0", where="properties.weight")
        if self.value is not None and not math.isfinite(self.value):
            raise InvalidMission(f"is {self.value!r}; expected a finite number", where="properties.value")
        if self.weight is not None and not isinstance(self.geometry, Polygon | MultiPolygon):
            kind = self.geometry.geom_type
            raise InvalidMission(
                f"is {self.weight!r} on a {kind}; only a Polygon or MultiPolygon has a weight",
                where="properties.weight",
            )

    def _check_geometry(self) -> None:
        kind = self.geometry.geom_type
        if kind not in set(_GeometryKind):
            raise InvalidMission(f"is a {kind}; expected {', '.join(_GeometryKind)}", where="geometry")
        if self.geometry.is_empty:
            raise InvalidMission(f"is a {kind} without a position", where="geometry")
        try:
            is_sound = is_valid(self.geometry)
        except TooManyPairs as error:
            raise InvalidMission(
                f"is a {kind} with so many long edges side by side that over {MOST_PAIRS} pairs of them"
                " would have to be compared; expected shorter edges or fewer points",
                where="geometry",
            ) from error
        # The reason is text for people, and takes as long again: asked only where there is something to report.
        if not is_sound:
            reason = shapely.is_valid_reason(self.geometry)
            raise InvalidMission(f"is not a valid {kind} ({reason} in degrees)", where="geometry")


class PriorModel(msgspec.Struct, frozen=True, kw_only=True):
    """What is known of a field before it is sampled.

    Parameters
    ----------
    features
        Weights and values by place. Where weighted polygons overlap, the last one counts: they are painted over
        one another in this order.
    variogram
        How the field varies from place to place.
    extra
        Other members of the collection, kept unchanged.
    """

    features: tuple[PriorFeature, ...] = ()
    variogram: Variogram | None = None
    extra: dict[str, Any] = {}


# --------------------------------------------------------------------------- GeoJSON

# Not the structs that `oxbow.site.geojson` reads with. A prior model is written again with all that it had: these
# keep every member, and accept only the geometries that can have a weight or a value. An import takes any GeoJSON,
# down to collections in collections and features without a geometry, and keeps the polygons and a name.


class _CollectionKind(enum.StrEnum):
    FEATURE_COLLECTION = "FeatureCollection"


class _FeatureKind(enum.StrEnum):
    FEATURE = "Feature"


class _GeometryKind(enum.StrEnum):
    POLYGON = "Polygon"
    MULTI_POLYGON = "MultiPolygon"
    POINT = "Point"
    MULTI_POINT = "MultiPoint"


class _Geometry(msgspec.Struct):
    type: _GeometryKind
    coordinates: msgspec.Raw


class _Properties(msgspec.Struct):
    weight: float | None = None
    value: float | None = None
    extra: dict[str, Any] = {}


class _Feature(msgspec.Struct):
    type: _FeatureKind
    geometry: _Geometry
    properties: dict[str, msgspec.Raw] = {}
    extra: dict[str, Any] = {}


class _Collection(msgspec.Struct):
    type: _CollectionKind
    features: list[dict[str, msgspec.Raw]]
    variogram: msgspec.Raw = msgspec.Raw()
    extra: dict[str, Any] = {}


def parse_prior(data: bytes, name: str = "PriorModel") -> PriorModel:
    """The prior model that a GeoJSON FeatureCollection holds.

    Parameters
    ----------
    data
        The collection in JSON, with the foreign member ``variogram`` where there is one.
    name
        What it is called in errors.

    Returns
    -------
    PriorModel
        Its features in the order of the file.

    Raises
    ------
    InvalidMission
        It is no such collection, or breaks a rule; the error names what, as
        ``PriorModel.features[3].properties.weight``, and its value.
    """
    with _inside(name):
        collection = _decoded(decode_json(utf8(data, ""), dict[str, msgspec.Raw], ""), _Collection)
        require_wgs84(collection.extra.get("crs"))
        features = [_feature(feature, index) for index, feature in enumerate(collection.features)]
        variogram = _variogram(bytes(collection.variogram)) if collection.variogram else None
        return PriorModel(features=tuple(features), variogram=variogram, extra=collection.extra)


def _variogram(data: bytes) -> Variogram:
    with _inside("variogram"):
        return decode_json(data, Variogram, "")


def _feature(document: dict[str, msgspec.Raw], index: int) -> PriorFeature:
    with _inside(f"features[{index}]"):
        feature = _decoded(document, _Feature)
        with _inside("geometry.coordinates"):
            geometry = _READERS[feature.geometry.type](bytes(feature.geometry.coordinates))
        with _inside("properties"):
            known = _decoded(feature.properties, _Properties)
        return PriorFeature(
            geometry=geometry,
            weight=known.weight,
            value=known.value,
            properties=known.extra,
            extra=feature.extra,
        )


def _decoded(document: dict[str, msgspec.Raw], kind: type[T]) -> T:
    """An object's known members as the fields of a struct, and the others as its `extra`."""
    known = frozenset(kind.__struct_fields__) - {"extra"}
    return decode_json(msgspec.json.encode(with_extra(document, known)), kind, "")


@contextmanager
def _inside(place: str) -> Iterator[None]:
    """Say of every error where in the whole document it happened."""
    try:
        yield
    except InvalidInput as error:
        # Places are put in front from the inside out: `features[3]`, then `PriorModel` before it.
        dot = "" if error.where.startswith("[") or not error.where else "."
        raise InvalidMission(error.message, f"{place}{dot}{error.where}") from error


def _polygon(coordinates: bytes) -> Polygon:
    return _with_rings(decode_json(coordinates, GivenPolygon, ""))


def _multi_polygon(coordinates: bytes) -> MultiPolygon:
    parts = []
    for index, rings in enumerate(decode_json(coordinates, list[GivenPolygon], "")):
        with _inside(f"[{index}]"):
            parts.append(_with_rings(rings))
    return MultiPolygon(parts)


def _with_rings(rings: list[list[list[float]]]) -> Polygon:
    shell, *holes = (_ring(ring, f"[{index}]") for index, ring in enumerate(rings))
    return Polygon(shell, holes)


def _ring(points: list[list[float]], place: str) -> FloatArray:
    if len(points) < LEAST_RING:
        raise InvalidMission(f"has {len(points)} positions; expected a ring of {LEAST_RING} or more", where=place)
    return lonlat_of(points, place)


def _point(coordinates: bytes) -> Point:
    return Point(lonlat_of([decode_json(coordinates, GivenPoint, "")], "")[0])


def _multi_point(coordinates: bytes) -> MultiPoint:
    return MultiPoint(lonlat_of(decode_json(coordinates, list[GivenPoint], ""), ""))


_READERS: dict[_GeometryKind, Callable[[bytes], BaseGeometry]] = {
    _GeometryKind.POLYGON: _polygon,
    _GeometryKind.MULTI_POLYGON: _multi_polygon,
    _GeometryKind.POINT: _point,
    _GeometryKind.MULTI_POINT: _multi_point,
}


def prior_document(prior: PriorModel) -> dict[str, Any]:
    """The GeoJSON FeatureCollection of a prior model."""
    document: dict[str, Any] = {"type": "FeatureCollection"}
    document["features"] = [_feature_document(feature) for feature in prior.features]
    if prior.variogram is not None:
        document["variogram"] = prior.variogram
    return document | prior.extra


def _feature_document(feature: PriorFeature) -> dict[str, Any]:
    # Only what was given: a null would come back as another document than was read.
    known = {"weight": feature.weight, "value": feature.value}
    properties = {name: value for name, value in known.items() if value is not None} | feature.properties
    geometry = mapping(feature.geometry)
    return {"type": "Feature", "geometry": geometry, "properties": properties} | feature.extra
