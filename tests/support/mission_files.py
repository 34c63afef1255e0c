"""Mission Files for the tests, what the trivial stages make of them, and an ear on the bus."""

from __future__ import annotations

import contextlib
import json
import queue
from collections.abc import Iterator
from typing import Any

from oxbow.bus import Session
from oxbow.mission.file import Mission

__all__ = [
    "BLOOM",
    "BROKEN_SEED",
    "INFEASIBLE_SEED",
    "POISON_SEED",
    "Samples",
    "listening",
    "mission_file",
    "revision_of",
]

INFEASIBLE_SEED = 1_000_001
BROKEN_SEED = 1_000_002
POISON_SEED = 1_000_003
"""Any other seed is the time that the trivial path stage takes, in milliseconds."""

BLOOM = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [5.002, 45.002]},
            "properties": {"value": 12.0},
        }
    ],
}
"""A prior model with one hot spot in that lake."""

Samples = queue.SimpleQueue[tuple[str, bytes]]


def mission_file(**fields: Any) -> bytes:
    """A square lake of about 1 km."""
    corners = [(-0.005, -0.005), (-0.005, 0.005), (0.005, 0.005), (0.005, -0.005)]
    outline = [{"lat": 45.0 + lat, "long": 5.0 + long} for lat, long in corners]
    lake = {"MissionType": "map", "LaunchPoint": {"lat": 45.0, "long": 5.0}, "BoundingBox": outline}
    return json.dumps(lake | fields).encode()


def revision_of(mission: Mission) -> int:
    assert mission.plan is not None
    assert mission.plan.revision is not None
    return mission.plan.revision


@contextlib.contextmanager
def listening(bus: Session, key: str) -> Iterator[Samples]:
    samples: Samples = queue.SimpleQueue()
    subscription = bus.subscribe(key, lambda sample_key, payload: samples.put((sample_key, payload)))
    yield samples
    subscription.close()
