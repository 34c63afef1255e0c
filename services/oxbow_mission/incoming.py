"""The three ways in which a mission is handed in: put, asked for a receipt, and asked for the plan."""

from __future__ import annotations

import logging
import time

import msgspec

from oxbow.bus.query import Query
from oxbow.contracts import MissionKey, MissionStatus, mission_key
from oxbow.errors import ErrorReply, OxbowError
from oxbow_mission.checks import Incoming
from oxbow_mission.registry import Registry
from oxbow_mission.revision import Request
from oxbow_mission.waiters import Waiter, Waiters
from oxbow_mission.wire import Check, Checked

__all__ = ["PutRequest", "QueriedPlan", "QueriedRequest"]

GRACE_S = 1.0
"""How much longer than its deadline a query waits, so that the stage's own words about it arrive."""

_log = logging.getLogger(__name__)


class PutRequest(Incoming):
    """A request that was put: its sender learns of the outcome from the mission's status alone."""

    def __init__(self, registry: Registry, mission_id: str, document: bytes) -> None:
        self.registry = registry
        self.mission_id = mission_id
        self.document = document
        self.client = ""
        self.size = len(document)

    def check(self) -> Check:
        return Check(document=self.document, parameters={"id": self.mission_id})

    def accept(self, checked: Checked) -> None:
        _accepted(self.registry, checked)

    def fail(self, error: OxbowError) -> None:
        _log.warning("mission %.200s: refused: %s", self.mission_id, error)
        self.registry.refuse(self.mission_id, error)


class QueriedRequest(Incoming):
    """A request whose receipt is asked for."""

    def __init__(self, registry: Registry, waiters: Waiters, query: Query) -> None:
        self.registry = registry
        self.waiters = waiters
        self.query = query
        self.parameters = query.parameters
        self.client = self.parameters.get("client", "")
        self.size = query.size_bytes
        self.since = time.monotonic()

    def check(self) -> Check:
        mission_id = MissionKey.parse(self.query.key).mission_id
        return Check(document=self.query.payload, parameters=self.parameters | {"id": mission_id})

    def accept(self, checked: Checked) -> None:
        status = _accepted(self.registry, checked)
        with self.query:
            self.query.reply(mission_key(status.mission_id, "request"), msgspec.json.encode(status))

    def fail(self, error: OxbowError) -> None:
        with self.query:
            self.query.fail(ErrorReply.of(error))


class QueriedPlan(QueriedRequest):
    """A request whose plan is asked for: its query waits for it, without a thread."""

    def check(self) -> Check:
        return Check(document=self.query.payload, parameters=self.parameters)

    def accept(self, checked: Checked) -> None:
        until = self.since + checked.deadline_s + GRACE_S
        waiter = Waiter(self.query, checked.client, until, self.size)
        status = _accepted(self.registry, checked)
        # The revision may be done already, as where the same mission was handed in before.
        final = self.registry.when_final(status, lambda revision: self.waiters.add(revision, waiter))
        if final.state.is_final:
            waiter.answer(self.registry.store, final)


def _accepted(registry: Registry, checked: Checked) -> MissionStatus:
    request = Request(checked.document, checked.parameters, checked.fingerprint)
    return registry.accept(checked.mission_id, request, checked.client)
