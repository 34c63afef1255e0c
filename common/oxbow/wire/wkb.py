"""Planar geometry as Well-Known Binary (OGC 06-103r4, section 8), checked before GEOS sees it.

GEOS crashes the process on deeply nested collections, so nothing from outside is handed to it before this module
has checked types and counts. It accepts what Oxbow's own processes write: points, lines and polygons in two
dimensions, and sets of one of these kinds.
"""

from __future__ import annotations

import struct
from enum import IntEnum

import numpy as np
import shapely
from shapely import LineString, MultiLineString, MultiPoint, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.tolerances import FARTHEST_M

__all__ = ["MOST_WKB_BYTES", "from_wkb"]

MOST_WKB_BYTES = 2**24
"""A million vertices: ten times the largest lakes at full detail."""

_LEAST_RING = 4
_VERTEX_BYTES = 16


class _Type(IntEnum):
    POINT = 1
    LINE = 2
    POLYGON = 3
    POINTS = 4
    LINES = 5
    POLYGONS = 6


_TYPES: dict[type[BaseGeometry], frozenset[int]] = {
    Point: frozenset([_Type.POINT]),
    LineString: frozenset([_Type.LINE]),
    Polygon: frozenset([_Type.POLYGON]),
    MultiPoint: frozenset([_Type.POINTS]),
    MultiLineString: frozenset([_Type.LINES]),
    MultiPolygon: frozenset([_Type.POLYGONS]),
    BaseGeometry: frozenset(_Type),
}

_MEMBERS = {
    _Type.POINTS: frozenset([_Type.POINT]),
    _Type.LINES: frozenset([_Type.LINE]),
    _Type.POLYGONS: frozenset([_Type.POLYGON]),
}


def from_wkb(data: bytes, kind: type[BaseGeometry]) -> BaseGeometry:
    """The geometry that bytes describe.

    Parameters
    ----------
    data
        WKB.
    kind
        The kind to expect; with `BaseGeometry` any kind, which may also be empty.

    Returns
    -------
    shapely geometry of type `kind`
        In two dimensions. It is not empty, unless `kind` is `BaseGeometry`; whether it is valid is not checked.

    Raises
    ------
    ValueError
        The bytes are not WKB of this kind, or too many, or some are left over; or the geometry has rings that are
        not closed, is empty, or has coordinates that are not finite or beyond `FARTHEST_M`.
    """
    # The checks run from the cheapest to GEOS, and each relies on the ones before.
    if len(data) > MOST_WKB_BYTES:
        raise ValueError(f"has {len(data)} bytes; expected at most {MOST_WKB_BYTES}")
    try:
        end = _end(data, 0, _TYPES[kind])
    except (struct.error, IndexError) as error:
        raise ValueError("is WKB that ends too early") from error
    if end != len(data):
        raise ValueError(f"is WKB of {end} bytes in {len(data)}")
    try:
        geometry: BaseGeometry = shapely.from_wkb(data)
    except shapely.errors.ShapelyError as error:
        raise ValueError(f"is not a geometry: {error}") from error
    if kind is not BaseGeometry and geometry.is_empty:
        raise ValueError("is empty")
    return geometry


def _end(data: bytes, start: int, accepted: frozenset[int]) -> int:
    """Where the geometry ends that begins at `start` and should be of one of the `accepted` types."""
    if data[start] > 1:
        raise ValueError(f"is not WKB: byte order {data[start]}; expected 0 or 1")
    order = "<" if data[start] == 1 else ">"
    (number,) = struct.unpack_from(f"{order}I", data, start + 1)
    if number not in accepted:
        names = ", ".join(f"{each} ({_Type(each).name.lower()})" for each in sorted(accepted))
        raise ValueError(f"is WKB of type {number}; expected {names}")
    position = start + 5
    if number == _Type.POINT:
        return _end_of_vertices(data, position, order, 1)
    (count,) = struct.unpack_from(f"{order}I", data, position)
    position += 4
    if number == _Type.LINE:
        return _end_of_vertices(data, position, order, count)
    if number == _Type.POLYGON:
        return _end_of_rings(data, position, order, count)
    # Members are never sets themselves, which bounds the depth. A count cannot be trusted, but each turn reads
    # bytes or fails, so that the work is bounded by the size of the data.
    for _ in range(count):
        position = _end(data, position, _MEMBERS[_Type(number)])
    return position


def _end_of_rings(data: bytes, position: int, order: str, count: int) -> int:
    for _ in range(count):
        (vertices,) = struct.unpack_from(f"{order}I", data, position)
        if vertices < _LEAST_RING:
            raise ValueError(f"has a ring of {vertices} vertices; expected {_LEAST_RING} or more")
        position = _end_of_vertices(data, position + 4, order, vertices)
    return position


def _end_of_vertices(data: bytes, position: int, order: str, count: int) -> int:
    end = position + _VERTEX_BYTES * count
    # `frombuffer` would refuse it too, but speak of buffers.
    if end > len(data):
        raise ValueError(f"is WKB that ends too early: {count} vertices do not fit")
    coordinates = np.frombuffer(data, f"{order}f8", 2 * count, position)
    # Not `> FARTHEST_M`, of which NaN is no case either.
    if not (np.abs(coordinates) <= FARTHEST_M).all():
        raise ValueError(f"has coordinates that are not finite, or beyond {FARTHEST_M:g} m")
    return end
