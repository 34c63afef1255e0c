"""The embedded stack: router, stages, mission service and recorder, as child processes of the command."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from oxbow.bus.client import Bus
from oxbow.contracts import STAGES
from oxbow.errors import InvalidOption, Unavailable
from oxbow_cli.health import PERIOD_S, Health
from oxbow_cli.interrupts import ending
from oxbow_cli.supervisor import Child, Supervisor

__all__ = ["SERVICES", "StackSettings", "running_stack"]

START_S = 30.0
"""How long a stack may take to become ready, even on a busy machine."""

_ATTEMPT_S = 1.0
_LOOK_S = 0.02
_STOPPED_S = 1.0
_log = logging.getLogger(__name__)
_STAGES = tuple(endpoint.stage for endpoint in STAGES)
SERVICES = (*_STAGES, "mission", "recorder")


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
        The number of processes of each stage; 1 if it is not named.

    Raises
    ------
    InvalidOption
        A stage is unknown, or its number is less than 1.
    """

    endpoint: str
    home: Path
    recordings: Path
    replicas: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for stage, count in self.replicas.items():
            if stage not in _STAGES or count < 1:
                raise InvalidOption(
                    f"is {stage}={count}; expected one of {', '.join(_STAGES)} and 1 or more", where="--replicas"
                )


@contextmanager
def running_stack(settings: StackSettings, output: int | None = None) -> Iterator[None]:
    """A stack that is ready, for as long as the context lasts.

    A process that ends, is stopped or hangs is restarted. All of them end with the context, or with this process,
    however it dies.

    Parameters
    ----------
    settings
        What to start.
    output
        A file descriptor for the logs of the processes; by default this process's stderr.

    Yields
    ------
    None
        Once every process has been seen alive on the bus.

    Raises
    ------
    Unavailable
        A process ended before it was ready, or was not ready after `START_S`.
    """
    with Supervisor(output) as supervisor:
        with ending.holding_signals():  # so that the supervisor knows every process that was started
            started = _start(supervisor, settings)
        give_up = time.monotonic() + START_S
        with _connected(settings.endpoint, supervisor, give_up) as bus:
            _wait_ready(bus, started.services, supervisor, give_up)
        # Only now: while a stack starts, an end is an error to report, and not one to mend.
        watch = Health(settings.endpoint, started.router, [each.child for each in started.services])
        supervisor.keep_alive()
        supervisor.repeat(watch.ask, PERIOD_S, "pings", at_end=watch.close)
        supervisor.repeat(watch.look, _STOPPED_S, "stopped processes")
        yield


@dataclass(frozen=True)
class _Service:
    """A process of a service, and its name on the bus."""

    service: str
    instance: str
    child: Child


@dataclass(frozen=True)
class _Started:
    """All processes of a stack."""

    router: Child
    services: tuple[_Service, ...]


def _start(supervisor: Supervisor, settings: StackSettings) -> _Started:
    """Start everything at once: the services wait for the router themselves."""
    parent = ("--parent", str(os.getpid()))
    listen = ("--listen", settings.endpoint)
    router = supervisor.start("router", ["-m", "oxbow.bus.router", *listen, *parent], rank=0)
    own_options = {"mission": ("--home", settings.home), "recorder": ("--folder", settings.recordings)}
    started = []
    for service in SERVICES:
        for number in range(1, settings.replicas.get(service, 1) + 1):
            instance = f"{os.getpid()}-{number}"
            options = ("--connect", settings.endpoint, "--instance", instance, *own_options.get(service, ()))
            arguments = ["-m", f"oxbow_{service}", *map(str, options), *parent]
            # The recorder is stopped after the stages, whose last layers it has to write.
            child = supervisor.start(f"{service}-{number}", arguments, rank=1 if service == "recorder" else 2)
            started.append(_Service(service, instance, child))
    return _Started(router, tuple(started))


def _connected(endpoint: str, supervisor: Supervisor, give_up: float) -> Bus:
    while True:
        _require_alive(supervisor)
        try:
            return Bus.connect(endpoint, timeout_s=_ATTEMPT_S)
        except Unavailable:
            if time.monotonic() > give_up:
                raise


def _wait_ready(bus: Bus, started: Iterable[_Service], supervisor: Supervisor, give_up: float) -> None:
    """Wait for every process by its own name, since another stack may be on the same bus."""
    while missing := [each.service for each in started if each.instance not in bus.instances(each.service)]:
        _require_alive(supervisor)
        if missing == ["recorder"] and supervisor.ended():
            _log.warning("the recorder does not start; planning continues without recordings")
            return
        if time.monotonic() > give_up:
            raise Unavailable(f"no live {', '.join(missing)} after {START_S:g} s", where=bus.endpoint)
        time.sleep(_LOOK_S)


def _require_alive(supervisor: Supervisor) -> None:
    """Raise `Unavailable` if a process has ended that planning needs."""
    for name, status in supervisor.ended().items():
        if name != "recorder-1":
            raise Unavailable(f"ended with status {status} before it was ready", where=name)
