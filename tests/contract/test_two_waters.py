"""Each caller gets the answer to its own request, whatever others ask and whichever process dies meanwhile."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import Any

import msgspec
import pytest
import shapely
from shapely import Point, Polygon

from oxbow.bus.client import Bus, BusCall
from oxbow.bus.router import RouterProcess
from oxbow.contracts import CONTOUR, DECOMPOSE, ContourRequest, DecomposeRequest, Endpoint, FreeSpace, Message
from oxbow.errors import OxbowError
from oxbow.wire import codec
from oxbow.wire.introspection import Info
from oxbow.wire.recording import discard
from oxbow_contour.service import handle
from tests.support.bus_processes import end, wait_until
from tests.support.mutations import mutated

pytestmark = pytest.mark.processes

INSTANCES = ("w0", "w1")
PONDS = (
    ContourRequest(outline=Point(0.0, 0.0).buffer(40.0), safety_m=2.0, spacing_m=5.0),
    ContourRequest(
        outline=shapely.box(900.0, 900.0, 1000.0, 960.0),
        zones=(shapely.box(940.0, 920.0, 950.0, 930.0),),
        safety_m=3.0,
        spacing_m=6.0,
    ),
)
DEADLINES_S: tuple[float | str, ...] = (3e6, 1e308, -1e308, 0.0, "soon", 1e-9)


@contextmanager
def replicas(router: RouterProcess, bus: Bus, endpoints: Sequence[Endpoint[Any, Any]]) -> Iterator[None]:
    """Two real replicas of each stage."""
    options = ("--connect", router.endpoint, "--parent", str(os.getpid()))
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", f"oxbow_{endpoint.stage}", "--instance", instance, *options],
            stderr=subprocess.DEVNULL,
        )
        for endpoint in endpoints
        for instance in INSTANCES
    ]
    try:
        wait_until(lambda: all(len(bus.instances(endpoint.stage)) == 2 for endpoint in endpoints), 60.0)
        yield
    finally:
        for process in processes:
            end(process)


def ask_oddly(bus: Bus, endpoint: Endpoint[Any, Any], request: Message, chance: random.Random) -> None:
    """One query that nobody should ask: its deadline, its payload or its envelope is none."""
    deadline_s = chance.choice(DEADLINES_S)
    envelope = {"request_id": uuid.uuid4().hex, "deadline_s": deadline_s}
    if isinstance(deadline_s, float):
        envelope["deadline_s"] = time.time() + deadline_s
    attachment = msgspec.json.encode(envelope)
    if chance.random() < 0.2:
        attachment = attachment.replace(b":", chance.choice((b"", b":NaN", b"\xff")), 1)
    payload = mutated(codec.encode(request), chance) if chance.random() < 0.7 else chance.randbytes(200)
    key = endpoint.instance_key(chance.choice(INSTANCES))
    with suppress(OxbowError):
        bus.query(key, payload, timeout_s=5.0, attachment=attachment)


def strike(bus: Bus, endpoint: Endpoint[Any, Any], instance: str, number: int) -> None:
    """Kill or stop the worker process of a replica."""
    with suppress(OxbowError, ProcessLookupError):
        [(_, data)] = bus.query(endpoint.introspection_key(instance, "info"), timeout_s=5.0)
        os.kill(msgspec.json.decode(data, type=Info).worker_pid, number)


def mixed_up(bus: Bus, endpoints: Sequence[Endpoint[Any, Any]], count: int, strikes: Sequence[int]) -> list[int]:
    """The numbers of those of `count` exchanges, on two waters in turn, that got another answer than their own."""
    expected = [handle(pond, discard) for pond in PONDS]
    every = max(1, count // (len(strikes) + 1))

    def exchange(number: int) -> bool:
        chance = random.Random(number)
        request, own = PONDS[number % 2], expected[number % 2]
        call = BusCall(bus, deadline_s=time.time() + 60.0)
        with ThreadPoolExecutor(1) as pool:
            odd = [pool.submit(ask_oddly, bus, chance.choice(endpoints), request, chance) for _ in range(2)]
            if number % every == every - 1 and number // every < len(strikes):
                strike(
                    bus,
                    endpoints[number // every % len(endpoints)],
                    chance.choice(INSTANCES),
                    strikes[number // every],
                )
            space = call(CONTOUR, request)
            right = is_same(space, own)
            if DECOMPOSE in endpoints:
                cells = call(DECOMPOSE, DecomposeRequest(free=space.free, spacing_m=5.0, heading_rad=0.0)).cells
                low, high = own.free.bounds[0], own.free.bounds[2]
                right &= all(low - 1e-6 <= u <= high + 1e-6 for cell in cells for u in cell.floor[:, 0])
            for each in odd:
                each.result()
        return right

    with ThreadPoolExecutor(4) as pool:
        answers = pool.map(exchange, range(count))
        return [number for number, right in enumerate(answers) if not right]


def is_same(space: FreeSpace, own: FreeSpace) -> bool:
    pairs: Iterator[tuple[Polygon, Polygon]] = iter([(space.free, own.free), (space.water, own.water)])
    return all(shapely.equals_exact(one, other, tolerance=0.0) for one, other in pairs)


def test_two_waters_are_never_mixed_up(router: RouterProcess, bus: Bus) -> None:
    endpoints = (CONTOUR,)
    strikes = [signal.SIGKILL, signal.SIGSTOP, signal.SIGKILL]
    with replicas(router, bus, endpoints):
        assert mixed_up(bus, endpoints, 100, strikes) == []
