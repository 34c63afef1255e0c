from pathlib import Path

import msgspec
import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from oxbow.contracts import ContourRequest, FreeSpace
from oxbow.wire.codec import decode, encode
from oxbow.wire.recording import Layer, discard
from oxbow_contour.service import handle
from tests.support.real_lakes import MISSIONS, needs_missions

REQUEST = ContourRequest(
    outline=box(0, 0, 100, 100),
    zones=(box(0, 60, 48, 62), box(52, 60, 100, 62), box(20, 20, 30, 30)),
    safety_m=3.0,
    spacing_m=10.0,
)


def shown(request: ContourRequest) -> dict[str, Layer]:
    layers: list[Layer] = []
    handle(request, layers.append)
    assert {layer.stage for layer in layers} == {"contour"}
    return {layer.name: layer for layer in layers}


def test_every_step_is_shown():
    layers = shown(REQUEST)
    assert list(layers) == ["raw", "simplified", "eroded", "dropped", "figures"]
    assert layers["raw"].geometries == (REQUEST.outline, *REQUEST.zones)
    assert layers["eroded"].geometries == (handle(REQUEST, discard).free,)
    assert layers["dropped"].labels[0].endswith(" m²")
    assert layers["figures"].scalars.keys() == {"compression", "tolerance_m"}


def test_no_layer_of_dropped_parts_without_any():
    assert "dropped" not in shown(msgspec.structs.replace(REQUEST, zones=()))


def test_the_reply_survives_the_bus():
    reply = handle(decode(encode(REQUEST), ContourRequest), discard)
    assert decode(encode(reply), FreeSpace) == reply


def planar(positions: list[dict[str, float]], middle: np.ndarray) -> Polygon:
    """Metres by an equirectangular projection: near enough to test with."""
    degrees = np.array([(place["long"], place["lat"]) for place in positions])
    metres = np.radians(degrees - middle) * 6_371_000
    return Polygon(metres * [np.cos(np.radians(middle[1])), 1.0])


def real_lake(mission: Path) -> ContourRequest:
    fields = msgspec.json.decode(mission.read_bytes())
    middle = np.mean([(place["long"], place["lat"]) for place in fields["BoundingBox"]], axis=0)
    outline = planar(fields["BoundingBox"], middle)
    return ContourRequest(
        outline=outline,
        zones=tuple(planar(zone, middle) for zone in fields["ForbiddenZones"]),
        safety_m=fields["Safety"],
        spacing_m=outline.area / fields["Master_length"],
    )


@needs_missions
@pytest.mark.parametrize("mission", MISSIONS, ids=lambda mission: mission.stem)
def test_real_lakes_lose_less_than_a_percent(mission):
    request = real_lake(mission)
    water = request.outline.difference(shapely.union_all(request.zones))
    exact = max(shapely.get_parts(water.buffer(-request.safety_m, quad_segs=64)), key=shapely.area)
    space = handle(request, discard)
    assert space.free.area >= 0.99 * exact.area
    assert space.free.difference(exact).area <= 1e-6 * exact.area
    assert water.contains(space.free)
    assert space.free.boundary.distance(water.boundary) >= request.safety_m
    assert not space.dropped
    assert not space.warnings
