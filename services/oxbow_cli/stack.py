"""The embedded stack: router, stages, mission service and recorder, as child processes of the command."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from oxbow.bus import Bus
from oxbow.contracts import STAGES
from oxbow.errors import InvalidMission, Unavailable
from oxbow_cli.supervisor import Supervisor

__all__ = ["StackSettings", "free_endpoint", "running_stack"]

START_S = 30.0
"""How long a stack may take to come up, on a machine that is busy."""

_ATTENTION_S = 0.1
_STAGES = tuple(endpoint.stage for endpoint in STAGES)


@dataclass(frozen=True)
class StackSettings:
    """What to start.

    Parameters
    ----------
    endpoint
        Where the router listens.
    home
        The mission service's store; one process at a time may hold it.
    recordings
        The recorder's folder.
    replicas
        Processes of each stage, one where it is not named.
    """

    endpoint: str
    home: Path
    recordings: Path
    replicas: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for stage, count in self.replicas.items():
            if stage not in _STAGES or count < 1:
                raise InvalidMission(
                    f"is {stage}={count}; expected one of {', '.join(_STAGES)} and 1 or more", where="--replicas"
                )


@contextmanager
def running_stack(settings: StackSettings, output: IO[bytes] | None = None) -> Iterator[Bus]:
    """A stack that is ready, for as long as the context lasts; yields a session on its bus.

    A process that ends is started again. All of them end with the context, or with this process
    however it dies.

    Parameters
    ----------
    output
        A file for what the processes log; where absent, this process's stderr.

    Raises
    ------
    Unavailable
        A process ended before it was ready, or was not ready after `START_S`.
    """
    with Supervisor(output) as supervisor:
        _start(supervisor, settings)
        with Bus.connect(settings.endpoint, timeout_s=START_S) as bus:
            _wait_ready(bus, supervisor)
            supervisor.keep_alive()
            yield bus


def _start(supervisor: Supervisor, settings: StackSettings) -> None:
    """Start everything at once: the services wait for the router by themselves."""
    parent = ("--parent", str(os.getpid()))
    supervisor.start("router", "-m", "oxbow.bus.router", "--listen", settings.endpoint, *parent)
    common = ("--connect", settings.endpoint, *parent)
    for stage in _STAGES:
        for number in range(1, settings.replicas.get(stage, 1) + 1):
            instance = f"{os.getpid()}-{number}"
            supervisor.start(f"{stage}-{number}", "-m", f"oxbow_{stage}", "--instance", instance, *common)
    supervisor.start("mission", "-m", "oxbow_mission", "--home", str(settings.home), *common)
    supervisor.start("recorder", "-m", "oxbow_recorder", "--folder", str(settings.recordings), *common)


def _wait_ready(bus: Bus, supervisor: Supervisor) -> None:
    services = (*_STAGES, "mission", "recorder")
    give_up = time.monotonic() + START_S
    while missing := [service for service in services if not bus.instances(service)]:
        supervisor.require_alive()
        if time.monotonic() > give_up:
            raise Unavailable(f"no live {', '.join(missing)} after {START_S:g} s", where=bus.endpoint)
        with suppress(Unavailable):
            bus.wait_ready(missing, _ATTENTION_S)


def free_endpoint() -> str:
    """An endpoint on a loopback port that was free a moment ago."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
