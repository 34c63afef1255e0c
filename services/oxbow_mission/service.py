"""The mission service on the bus: what each key does."""

from __future__ import annotations

import logging
import re
import threading
from collections.abc import Callable, Iterator, Sized

import msgspec

from oxbow.bus.client import Bus
from oxbow.bus.mailbox import Mailbox
from oxbow.bus.query import Query
from oxbow.contracts import (
    ANY,
    MAX_REQUEST_BYTES,
    PLAN_KEY,
    MissionKey,
    MissionStatus,
    checked_id,
    live_key,
    mission_key,
)
from oxbow.errors import ErrorReply, Internal, InvalidMission, InvalidRequest, OxbowError, error_text
from oxbow.ids import excerpt
from oxbow.runtime.closing import Closing
from oxbow_mission.checks import Checks
from oxbow_mission.incoming import PutRequest, QueriedPlan, QueriedRequest
from oxbow_mission.registry import Registry
from oxbow_mission.reports import Reports
from oxbow_mission.revision import Revision
from oxbow_mission.waiters import MOST, Waiter, Waiters

__all__ = ["MissionService"]

MOST_QUEUED = 256
MOST_UNREAD = 1024
"""Puts that may wait to be read."""
LOOK_S = 0.5
"""How often the service checks which clients are gone, whose time is up, and whether the store is still there."""

_log = logging.getLogger(__name__)

Replies = Iterator[tuple[str, bytes]]


class MissionService(Closing):
    """Answers a DSS and guidance.

    A request that is put is answered by the mission's status; one that is asked, by a reply too.

    Parameters
    ----------
    bus
        Where to serve.
    registry
        Where missions stand.
    reports
        Where guidance's reports are kept.
    checks
        Where requests are checked.
    instance
        The name to be seen alive under.
    """

    def __init__(self, bus: Bus, registry: Registry, reports: Reports, checks: Checks, instance: str) -> None:
        self.bus = bus
        self.registry = registry
        self.reports = reports
        self.checks = checks
        self.waiters = Waiters()
        self._over = threading.Event()
        # Answered by threads of their own: the registry calls with its lock held, and a plan may be megabytes.
        self._finals = Mailbox[tuple[Waiter, MissionStatus]]("plans", self._answer_final, size=MOST, workers=2)
        registry.on_final = self._on_final
        bus.subscribe(_any("request"), self._on_request, queue_size=MOST_UNREAD)
        bus.subscribe(_any("cancel"), self._on_cancel, queue_size=MOST_UNREAD)
        bus.subscribe(_any("report"), self._on_report, queue_size=MOST_UNREAD)
        self._queryables = [
            bus.declare_queryable(_any("request"), self._accepting(QueriedRequest)),
            bus.declare_queryable(PLAN_KEY, self._accepting(QueriedPlan)),
        ]
        bus.answer(_any("cancel"), self._cancel, queue_size=MOST_QUEUED)
        bus.answer(_any("status"), self._status, workers=2, queue_size=MOST_QUEUED)
        # The latest plan, and each revision's under a key of its own.
        history = [_any(what, revision) for what in ("plan", "replan") for revision in (None, ANY)]
        bus.answer(history, self._history, parameters=("after",), workers=2, queue_size=MOST_QUEUED)
        self._keeper = threading.Thread(target=self._keep_house, name="keeper", daemon=True)
        self._keeper.start()
        # Last of all: whoever sees the token asks at once.
        bus.declare_live(live_key("mission", instance))

    def close(self) -> None:
        """Take in nothing more; who waits for a plan asks again."""
        self._over.set()
        for queryable in self._queryables:
            queryable.undeclare()
        self._finals.close()

    # ----------------------------------------------------------------- requests

    def _on_request(self, key: str, document: bytes) -> None:
        self.checks.put(PutRequest(self.registry, MissionKey.parse(key).mission_id, document))

    def _accepting(self, kind: type[QueriedRequest] | type[QueriedPlan]) -> Callable[[Query], None]:
        def accept(query: Query) -> None:
            """Queue a request; on the network thread, so nothing here may take its time."""
            try:
                _require_size(query)
                self.checks.put(kind(self.registry, self.waiters, query))
            except OxbowError as error:
                _fail(query, error)
            except BaseException as error:  # noqa: BLE001 - an unanswered query looks like no service
                _log.exception("a query has no answer")
                _fail(query, Internal(error_text(error), where="mission"))

        return accept

    def _on_final(self, status: MissionStatus) -> None:
        for waiter in self.waiters.take(Revision.of(status)):
            self._finals.offer((waiter, status))

    def _answer_final(self, item: tuple[Waiter, MissionStatus]) -> None:
        waiter, status = item
        waiter.answer(self.registry.store, status)

    # ----------------------------------------------------------------- other puts and queries

    def _on_report(self, key: str, payload: bytes) -> None:
        try:
            self.reports.add(checked_id(MissionKey.parse(key).mission_id), payload)
        except OxbowError as error:
            _log.warning("report on %.200s: refused: %s", key, error)

    def _on_cancel(self, key: str, _payload: bytes) -> None:
        try:
            self.registry.cancel(checked_id(MissionKey.parse(key).mission_id))
        except OxbowError as error:
            _log.warning("%.200s: refused: %s", key, error)

    def _cancel(self, key: str, _parameters: dict[str, str], _payload: bytes) -> Replies:
        mission_id = checked_id(MissionKey.parse(key).mission_id)
        yield mission_key(mission_id, "cancel"), msgspec.json.encode(self.registry.cancel(mission_id))

    def _status(self, key: str, _parameters: dict[str, str], _payload: bytes) -> Replies:
        asked = MissionKey.parse(key)
        statuses = self.registry.statuses(_asked_id(asked))
        _require_kept(statuses, asked)
        for status in statuses:
            yield mission_key(status.mission_id, "status"), msgspec.json.encode(status)

    def _history(self, key: str, parameters: dict[str, str], _payload: bytes) -> Replies:
        """Plans that are kept: the latest under its mission's key, any under a key of its own."""
        asked, after = MissionKey.parse(key), _after(parameters)
        kept: dict[str, Revision] = {}
        first: dict[str, Revision] = {}
        for each in self.registry.store.planned(_asked_id(asked)):
            number = None if asked.revision is None else each.number
            is_replan = first.setdefault(each.mission_id, each) != each
            if each.number <= after:
                continue
            if asked.revision in (None, ANY, each.number) and (asked.what == "plan" or is_replan):
                kept[str(MissionKey(each.mission_id, asked.what, number))] = each
        _require_kept(kept, asked)
        for own_key, each in kept.items():
            yield own_key, self.registry.store.plan(each)

    # ----------------------------------------------------------------- those who are gone

    def _keep_house(self) -> None:
        present: set[str] = set()
        while not self._over.wait(LOOK_S):
            try:
                alive = set(self.bus.instances("client"))
                # Only clients that were seen can go: a name without a token, or none, is never dropped.
                for client in present - alive:
                    self.checks.drop(client)
                if let_go := self.waiters.let_go(present - alive):
                    _log.info("%d queries are waited for by nobody", let_go)
                present = alive
                self.registry.store.database.require_intact()
            except BaseException:  # noqa: BLE001 - the next look may succeed; a store that is lost ends the service
                _log.exception("looking after what is gone")


def _any(what: str, revision: str | None = None) -> str:
    return str(MissionKey(ANY, what, revision))


def _asked_id(key: MissionKey) -> str | None:
    return None if key.mission_id == ANY else checked_id(key.mission_id)


def _after(parameters: dict[str, str]) -> int:
    """The revision after which plans are asked for."""
    text = parameters.get("after", "0")
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise InvalidRequest(f"is {excerpt(text)}; expected the number of a revision", where="after")
    return int(text)


def _require_kept(found: Sized, asked: MissionKey) -> None:
    """Say that there is nothing: no reply at all would look like no service."""
    if not found:
        raise InvalidRequest(
            "is not kept here; expected a mission, or a revision of one, submitted before", where=str(asked)
        )


def _require_size(query: Query) -> None:
    if query.size_bytes > MAX_REQUEST_BYTES:
        raise InvalidMission(
            f"is {query.size_bytes} bytes; expected at most {MAX_REQUEST_BYTES}", where="Mission File"
        )


def _fail(query: Query, error: OxbowError) -> None:
    with query:
        query.fail(ErrorReply.of(error))
