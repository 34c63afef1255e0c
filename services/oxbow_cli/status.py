"""The processes of a stack, and the state of its missions."""

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
"""How long a process may take to answer; one that is alive but silent hangs."""

SEEN_S = 0.5
"""How long to wait for a service to be seen alive; running ones are seen in milliseconds."""

T = TypeVar("T", Ping, Stats, Supervision)


class Process(msgspec.Struct, frozen=True, kw_only=True):
    """A process that is seen alive, with what it reports about itself; None if it hangs."""

    service: str
    instance: str
    ping: Ping | None = None
    stats: Stats | None = None


class StackStatus(msgspec.Struct, frozen=True, kw_only=True):
    """The processes of a stack, the services without any, and each mission's latest revision.

    `supervised` are the processes that `oxbow up` keeps running, including those that are down at the moment.
    """

    endpoint: str
    processes: tuple[Process, ...]
    missing: tuple[str, ...]
    missions: tuple[MissionStatus, ...]
    supervised: tuple[Supervised, ...] = ()


def status_of(endpoint: str) -> StackStatus:
    """Ask everything that is alive on the bus at `endpoint`; raises `Unavailable` if there is no router."""
    with Bus.connect(endpoint, timeout_s=ANSWER_S) as bus:
        # Missing services are part of the answer; the wait is only for those that are there to be seen.
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
        with suppress(msgspec.DecodeError):  # any program on the bus may answer, in any form
            answer = msgspec.json.decode(payload, type=kind)
            answers[answer.stage, answer.instance] = answer
    return answers
