"""What runs on a stack, and where its missions stand."""

from __future__ import annotations

from contextlib import suppress
from typing import TypeVar

import msgspec

from oxbow.bus.client import Bus
from oxbow.client import Client
from oxbow.contracts import MissionStatus, any_introspection_key
from oxbow.errors import OxbowError, Unavailable
from oxbow.wire.introspection import Ping, Stats, Supervised, Supervision
from oxbow_cli.stack import SERVICES

__all__ = ["Process", "StackStatus", "status_of"]

ANSWER_S = 2.0
"""How long a process may take to answer; one that is alive and stays silent hangs."""

SEEN_S = 0.5
"""How long to wait for a service to be seen alive; those that are there are seen in milliseconds."""

T = TypeVar("T", Ping, Stats, Supervision)


class Process(msgspec.Struct, frozen=True, kw_only=True):
    """One process that is seen alive; where it does not hang, with what it tells about itself."""

    service: str
    instance: str
    ping: Ping | None = None
    stats: Stats | None = None


class StackStatus(msgspec.Struct, frozen=True, kw_only=True):
    """The processes of a stack, the services of which there is none, and each mission's latest revision.

    `supervised` are the processes that `oxbow up` keeps running, those that do not run now, too.
    """

    endpoint: str
    processes: tuple[Process, ...]
    missing: tuple[str, ...]
    missions: tuple[MissionStatus, ...]
    supervised: tuple[Supervised, ...] = ()


def status_of(endpoint: str) -> StackStatus:
    """Ask all that is alive on the bus at `endpoint`; `Unavailable` where there is no router."""
    with Bus.connect(endpoint, timeout_s=ANSWER_S) as bus:
        with suppress(Unavailable):
            bus.wait_ready(SERVICES, SEEN_S)
        supervisions = _ask(bus, "processes", Supervision).values()
        pings, stats = _ask(bus, "ping", Ping), _ask(bus, "stats", Stats)
        alive = {service: bus.instances(service) for service in SERVICES}  # by now, each replica has been seen
    missions: list[MissionStatus] = []
    if alive["mission"]:
        with Client(endpoint, timeout_s=ANSWER_S) as client:
            missions = client.statuses()
    return StackStatus(
        endpoint=endpoint,
        processes=tuple(
            Process(service=name[0], instance=name[1], ping=pings.get(name), stats=stats.get(name))
            for service, instances in alive.items()
            for name in ((service, instance) for instance in instances)
        ),
        missing=tuple(service for service, instances in alive.items() if not instances),
        missions=tuple(missions),
        supervised=tuple(each for supervision in supervisions for each in supervision.processes),
    )


def _ask(bus: Bus, what: str, kind: type[T]) -> dict[tuple[str, str], T]:
    """The answers of all processes, by service and instance."""
    try:
        replies = bus.query(any_introspection_key(what), timeout_s=ANSWER_S, all_targets=True, may_be_empty=True)
    except OxbowError:
        return {}
    answers = {}
    for _key, payload in replies:
        with suppress(msgspec.DecodeError):  # anyone may answer
            answer = msgspec.json.decode(payload, type=kind)
            answers[answer.stage, answer.instance] = answer
    return answers
