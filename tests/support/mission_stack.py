"""A real router, trivial stages and mission services, each a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from oxbow import Client
from oxbow.bus.client import Bus
from oxbow.bus.router import start_router
from tests.support.mission_processes import STAGES, START_S, Process, end, launch

__all__ = ["bus", "client", "home", "router", "start_service", "start_stages"]


@pytest.fixture(scope="module")
def router() -> Iterator[str]:
    running = start_router(timeout_s=START_S)
    yield running.endpoint
    end(running.process)


@pytest.fixture(scope="module")
def bus(router: str) -> Iterator[Bus]:
    with Bus.connect(router) as session:
        yield session


@pytest.fixture
def start_stages(router: str) -> Iterator[Callable[[], None]]:
    started: list[Process] = []

    def start() -> None:
        started.append(launch(*STAGES, "--connect", router))

    yield start
    for process in started:
        end(process)


@pytest.fixture
def start_service(router: str, tmp_path: Path) -> Iterator[Callable[[], Process]]:
    """Starts a mission service, always on the same store."""
    started: list[Process] = []

    def start() -> Process:
        started.append(
            launch("-m", "oxbow_mission", "--connect", router, "--home", str(tmp_path), "--workers", "4")
        )
        return started[-1]

    yield start
    for process in started:
        end(process)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def client(router: str, home: Path) -> Iterator[Client]:
    """A client of a service and stages that live as long as the module."""
    stages = launch(*STAGES, "--connect", router)
    service = launch("-m", "oxbow_mission", "--connect", router, "--home", str(home), "--workers", "2")
    with Client(router, timeout_s=START_S) as connected:
        yield connected
    end(service)
    end(stages)
