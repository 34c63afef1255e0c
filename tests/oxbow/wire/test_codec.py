"""What comes over the bus is a message, or is refused by name before anything works with it."""

from __future__ import annotations

import math
import struct
from typing import Any

import msgspec
import numpy as np
import pytest
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import (
    Cell,
    ContourRequest,
    DecomposeRequest,
    Decomposition,
    FreeSpace,
    Message,
    PathPlan,
    PathRequest,
)
from oxbow.errors import InvalidRequest
from oxbow.wire import codec
from oxbow.wire.recording import Layer, discard
from oxbow_decomposition.service import handle as decompose

SQUARE = box(0.0, 0.0, 10.0, 10.0)
ISLAND = Polygon(SQUARE.exterior, [box(2.0, 2.0, 4.0, 4.0).exterior])
FIELDS: dict[str, Any] = msgspec.msgpack.decode(codec.encode(ContourRequest(outline=SQUARE, spacing_m=1.0)))


class Lines(Message, frozen=True, kw_only=True):
    lines: tuple[LineString, ...]


def sent(**fields: Any) -> bytes:
    return msgspec.msgpack.encode(FIELDS | fields)


def collection(depth: int) -> bytes:
    return b"\x01\x07\x00\x00\x00\x01\x00\x00\x00" * depth + shapely.to_wkb(Point(0.0, 0.0))


def with_count(geometry: BaseGeometry, count: int) -> bytes:
    data = shapely.to_wkb(geometry)
    return data[:5] + struct.pack("<I", count) + data[9:]


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("flavor", ["iso", "extended"])
def test_polygons_come_back_as_they_were(order: int, flavor: str) -> None:
    wkb = shapely.to_wkb(ISLAND, byte_order=order, flavor=flavor)
    outline = codec.decode(sent(outline=wkb), ContourRequest).outline
    assert shapely.equals_exact(outline, ISLAND, tolerance=0.0)


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        (collection(1), r"is WKB of type 7; expected 3 \(polygon\)"),
        (collection(200_000), r"is WKB of type 7; expected 3 \(polygon\)"),
        (shapely.to_wkb(Point(1.0, 1.0)), "is WKB of type 1"),
        (shapely.to_wkb(MultiPolygon([SQUARE])), "is WKB of type 6"),
        (shapely.to_wkb(Polygon([(0, 0, 1), (1, 0, 1), (1, 1, 1)]), flavor="iso"), "is WKB of type 1003"),
        (
            shapely.to_wkb(Polygon([(0, 0, 1), (1, 0, 1), (1, 1, 1)]), flavor="extended"),
            "is WKB of type 2147483651",
        ),
        (shapely.to_wkb(shapely.set_srid(SQUARE, 4326), include_srid=True), "is WKB of type 536870915"),
        (b"\x02" + shapely.to_wkb(SQUARE)[1:], "byte order 2; expected 0 or 1"),
        (b"", "ends too early"),
        (shapely.to_wkb(SQUARE)[:-1], "ends too early"),
        (shapely.to_wkb(SQUARE) + b"\x00", "is WKB of 93 bytes in 94"),
        (with_count(SQUARE, 2**32 - 1), "ends too early|a ring of"),
        (with_count(SQUARE, 0), "is WKB of 9 bytes in 93"),
        (shapely.to_wkb(Polygon()), "is empty"),
        (shapely.to_wkb(box(0.0, 0.0, 1e300, 1.0)), r"not finite, or beyond 2\.1e\+07 m"),
        (shapely.to_wkb(SQUARE)[:-8] + struct.pack("<d", math.nan), "not finite"),
        (shapely.to_wkb(SQUARE)[:-8] + struct.pack("<d", 1.0), "is not a geometry: .*closed"),
        (bytes(2**24 + 1), "has 16777217 bytes; expected at most 16777216"),
        ("POINT (0 0)", "is a str; expected WKB"),
        (msgspec.msgpack.Ext(1, b""), "is a Ext; expected WKB"),
    ],
)
def test_what_is_no_polygon_is_refused_before_geos_sees_it(outline: Any, message: str) -> None:
    with pytest.raises(InvalidRequest, match=rf"ContourRequest\.outline: .*({message})"):
        codec.decode(sent(outline=outline), ContourRequest)


def test_the_field_is_named_with_its_index() -> None:
    zones = [shapely.to_wkb(SQUARE), collection(2)]
    with pytest.raises(InvalidRequest, match=r"ContourRequest\.zones\[1\]: is WKB of type 7"):
        codec.decode(sent(zones=zones), ContourRequest)
    with pytest.raises(InvalidRequest, match=r"ContourRequest\.spacing_m: expected `float`, got `str`"):
        codec.decode(sent(spacing_m="x"), ContourRequest)


def test_layers_may_hold_any_simple_geometry_and_no_collection() -> None:
    shapes = (Point(0.0, 0.0), shapely.MultiPoint([(0.0, 0.0), (1.0, 1.0)]), ISLAND.boundary, SQUARE.boundary)
    layer = Layer(stage="s", name="n", geometries=(*shapes, Polygon(), MultiPolygon([SQUARE, box(20, 0, 30, 9)])))
    for there, back in zip(layer.geometries, codec.decode(codec.encode(layer), Layer).geometries, strict=True):
        assert shapely.equals_exact(there, back, tolerance=0.0)
    nested = {"stage": "s", "name": "n", "geometries": [collection(200_000)]}
    with pytest.raises(InvalidRequest, match=r"Layer\.geometries\[0\]: is WKB of type 7"):
        codec.decode(msgspec.msgpack.encode(nested), Layer)


@pytest.mark.parametrize(
    "floor",
    [
        ["|O", [1, 2], bytes(16)],
        ["<c16", [1, 1], bytes(16)],
        ["<f8", [2, 2], bytes(16)],
        ["<f8", [-1, 2], bytes(16)],
        ["<f8", [1.0, 2], bytes(16)],
        ["<f8", [2**62, 8], bytes(16)],
        ["<f8", [1] * 40 + [2], bytes(16)],
        ["<f8", [1, 2], "x" * 16],
        ["<f8", [1, 2]],
        [1, 2, 3],
        {},
        None,
    ],
)
def test_what_is_no_array_of_floats_is_refused(floor: Any) -> None:
    message = {"floor": floor, "ceiling": ["<f8", [1, 2], bytes(16)], "start": 0, "end": 0}
    with pytest.raises(InvalidRequest, match=r"Cell\.floor: is not an array"):
        codec.decode(msgspec.msgpack.encode(message), Cell)


def test_elements_that_are_not_finite_are_refused() -> None:
    message = {"floor": ["<f8", [1, 2], np.array([math.inf, 0.0]).tobytes()], "ceiling": [], "start": 0, "end": 0}
    with pytest.raises(InvalidRequest, match=r"Cell\.floor: has elements that are not finite"):
        codec.decode(msgspec.msgpack.encode(message), Cell)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xc1",
        b"\xff" * 9,
        b"\x91" * 100_000,
        b"\xdd\xff\xff\xff\xff",
        b"\xa1\xff",
        b"\x81\xa1\xff\x01",
        b"\xc0",
    ],
)
@pytest.mark.parametrize("kind", [ContourRequest, PathPlan, Lines])
def test_bytes_that_are_no_message_are_refused(data: bytes, kind: type[Message]) -> None:
    with pytest.raises(InvalidRequest, match=kind.__name__):
        codec.decode(data, kind)


def test_a_message_is_checked_where_it_is_made_too() -> None:
    bow_tie = Polygon([(0, 0), (1, 1), (1, 0), (0, 1)])
    with pytest.raises(InvalidRequest, match=r"zones\[0\]: is empty or not a valid polygon"):
        ContourRequest(outline=SQUARE, zones=(bow_tie,), spacing_m=1.0)
    with pytest.raises(InvalidRequest, match="outline: is a Point; expected a Polygon"):
        ContourRequest(outline=Point(0, 0), spacing_m=1.0)  # type: ignore[arg-type]
    with pytest.raises(InvalidRequest, match="outline: has coordinates that are not finite, or beyond"):
        ContourRequest(outline=box(0, 0, 1e200, 1.0), spacing_m=1.0)
    with pytest.raises(InvalidRequest, match="path: is empty; expected a line"):
        PathPlan(path=LineString(), spacing_m=1.0, steps=())


def test_cells_of_another_heading_are_refused() -> None:
    request = DecomposeRequest(free=box(0.0, 0.0, 30.0, 10.0), spacing_m=2.0, heading_rad=0.3)
    right = msgspec.msgpack.decode(codec.encode(decompose(request, discard)))
    for heading_rad in (0.31, 1e300):
        with pytest.raises(InvalidRequest, match=r"cells\[0\]: begins or ends .* m from its critical points"):
            codec.decode(msgspec.msgpack.encode(right | {"heading_rad": heading_rad}), Decomposition)
    cells = [right["cells"][0] | {"start": 9}, *right["cells"][1:]]
    with pytest.raises(InvalidRequest, match=r"cells\[0\]: joins the critical points 9 and"):
        codec.decode(msgspec.msgpack.encode(right | {"cells": cells}), Decomposition)


def test_a_spacing_beyond_the_water_is_refused() -> None:
    free = box(0.0, 0.0, 30.0, 40.0)
    cells = decompose(DecomposeRequest(free=free, spacing_m=2.0, heading_rad=0.0), discard)
    space = FreeSpace(free=free, water=free, tolerance_m=0.0, compression=1.0)
    with pytest.raises(
        InvalidRequest, match="min_spacing_m: is 51 m; expected at most the extent of the water, 50 m"
    ):
        PathRequest(
            space=space,
            decomposition=cells,
            launch=(1.0, 1.0),
            recovery=(1.0, 1.0),
            length_m=100.0,
            min_spacing_m=51.0,
        )
