"""The mission service on the bus: what each key does."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sized

import msgspec

from oxbow.bus import Bus
from oxbow.contracts import (
    ANY,
    PLAN_KEY,
    MissionKey,
    MissionStatus,
    checked_id,
    live_key,
    mission_key,
)
from oxbow.errors import Internal, InvalidMission, OxbowError
from oxbow.site import Site
from oxbow.submission import Submission
from oxbow_mission.registry import Registry
from oxbow_mission.reports import Reports
from oxbow_mission.store import Revision

__all__ = ["MissionService"]

MOST_WAITING = 64
"""Callers whose plan is waited for at the same time, each by a thread; `MOST_QUEUED` more may queue."""
MOST_QUEUED = 256
MOST_UNREAD = 1024
"""Puts that may wait to be read."""

_log = logging.getLogger(__name__)

Replies = Iterator[tuple[str, bytes]]


class MissionService:
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
    instance
        The name to be seen alive under.
    """

    def __init__(self, bus: Bus, registry: Registry, reports: Reports, instance: str) -> None:
        self.registry = registry
        self.reports = reports
        bus.subscribe(_any("request"), self._on_request, queue_size=MOST_UNREAD)
        bus.subscribe(_any("report"), self._on_report, queue_size=MOST_UNREAD)
        bus.answer(_any("request"), self._submit, workers=4, queue_size=MOST_QUEUED)
        bus.answer(PLAN_KEY, self._plan, workers=MOST_WAITING, queue_size=MOST_QUEUED)
        bus.answer(_any("status"), self._status, workers=2, queue_size=MOST_QUEUED)
        history = [_any(what, revision) for what in ("plan", "replan") for revision in (None, ANY)]
        bus.answer(history, self._history, workers=2, queue_size=MOST_QUEUED)
        bus.declare_live(live_key("mission", instance))

    # ----------------------------------------------------------------- puts

    def _on_request(self, key: str, document: bytes) -> None:
        mission_id = MissionKey.parse(key).mission_id
        try:
            self._take_in(document, {"id": mission_id})
        except OxbowError as error:
            _log.warning("mission %s: refused: %s", mission_id, error)
            self.registry.refuse(mission_id, error)
        except Exception as error:  # noqa: BLE001 - becomes an `internal` error
            _log.exception("mission %s: refused", mission_id)
            self.registry.refuse(mission_id, Internal(f"{type(error).__name__}: {error}", where="mission"))

    def _on_report(self, key: str, payload: bytes) -> None:
        try:
            self.reports.add(checked_id(MissionKey.parse(key).mission_id), payload)
        except OxbowError as error:
            _log.warning("report on %.200s: refused: %s", key, error)

    # ----------------------------------------------------------------- queries

    def _submit(self, key: str, parameters: dict[str, str], document: bytes) -> Replies:
        status = self._take_in(document, parameters | {"id": MissionKey.parse(key).mission_id})
        yield mission_key(status.mission_id, "request"), msgspec.json.encode(status)

    def _plan(self, _key: str, parameters: dict[str, str], document: bytes) -> Replies:
        status = self.registry.wait_final(self._take_in(document, parameters))
        if status.error is not None:
            raise status.error.error()
        yield PLAN_KEY, self.registry.store.plan(Revision.of(status))

    def _status(self, key: str, _parameters: dict[str, str], _payload: bytes) -> Replies:
        asked = MissionKey.parse(key)
        statuses = self.registry.statuses(_asked_id(asked))
        _require_kept(statuses, asked)
        for status in statuses:
            yield mission_key(status.mission_id, "status"), msgspec.json.encode(status)

    def _history(self, key: str, _parameters: dict[str, str], _payload: bytes) -> Replies:
        """Plans that are kept: the latest under its mission's key, any under a key of its own."""
        asked = MissionKey.parse(key)
        kept: dict[str, Revision] = {}
        first: dict[str, Revision] = {}
        for each in self.registry.store.planned(_asked_id(asked)):
            number = None if asked.revision is None else each.number
            is_replan = first.setdefault(each.mission_id, each) != each
            if asked.revision in (None, ANY, each.number) and (asked.what == "plan" or is_replan):
                kept[str(MissionKey(each.mission_id, asked.what, number))] = each
        _require_kept(kept, asked)
        for own_key, each in kept.items():
            yield own_key, self.registry.store.plan(each)

    def _take_in(self, document: bytes, parameters: dict[str, str]) -> MissionStatus:
        """Check all of a request, so that its sender hears of every fault at once; then keep it."""
        submission = Submission.parse(document, parameters)
        Site.of(submission.mission)
        return self.registry.accept(submission)


def _any(what: str, revision: str | None = None) -> str:
    return str(MissionKey(ANY, what, revision))


def _asked_id(key: MissionKey) -> str | None:
    return None if key.mission_id == ANY else checked_id(key.mission_id)


def _require_kept(found: Sized, asked: MissionKey) -> None:
    """Say that there is nothing: no reply at all would look like no service."""
    if not found:
        raise InvalidMission(
            "is not kept here; expected a mission, or a revision of it, handed in before", where=str(asked)
        )
