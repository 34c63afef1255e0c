"""A real router and real stage processes on loopback."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest

from oxbow.bus.client import Bus, BusCall
from oxbow.bus.router import RouterProcess, start_router
from tests.support.bus_processes import Replica, end, launch, wait_until


@pytest.fixture(scope="module")
def router() -> Iterator[RouterProcess]:
    running = start_router(timeout_s=20.0)
    yield running
    end(running.process)


@pytest.fixture(scope="module")
def bus(router: RouterProcess) -> Iterator[Bus]:
    with Bus.connect(router.endpoint) as session:
        yield session


@pytest.fixture
def start_replicas(router: RouterProcess, bus: Bus) -> Iterator[Callable[..., list[Replica]]]:
    """Starts replicas ``r0``, ``r1`` ... that are ready, and are ended with the test."""
    started: list[Replica] = []

    def start(count: int = 1, *options: str) -> list[Replica]:
        names = [f"r{len(started) + i}" for i in range(count)]
        new = [launch(router.endpoint, name, *options) for name in names]
        started.extend(new)
        wait_until(lambda: set(names) <= set(bus.instances("echo")))
        return new

    yield start
    for process in started:
        end(process)
    wait_until(lambda: not bus.instances("echo"))


@pytest.fixture
def call(bus: Bus) -> BusCall:
    return BusCall(bus, mission_id="m1", origin=(43.5, 5.2), deadline_s=time.time() + 30.0)
