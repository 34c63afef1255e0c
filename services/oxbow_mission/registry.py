"""Where all missions stand: every change is kept in the store first, and published second."""

from __future__ import annotations

import logging
import sqlite3
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Self
from urllib.parse import quote

import msgspec

from oxbow.bus import Session
from oxbow.contracts import MissionKey, MissionState, MissionStatus, mission_key
from oxbow.errors import Cancelled, ErrorReply, Internal, InvalidRequest, OxbowError
from oxbow.runtime.closing import Closing
from oxbow_mission.fair import Order
from oxbow_mission.revision import QueuedMission, Request, Revision
from oxbow_mission.store import Store

__all__ = ["Registry"]

MOST_ANSWERED_CHARACTERS = 1024
"""Longer ids, percent-encoded, are not answered: no sender could mean them."""

_log = logging.getLogger(__name__)


@dataclass
class _Running:
    """A revision that is being planned."""

    status: MissionStatus
    client: str
    cancels: list[Callable[[], None]] = field(default_factory=list)


class Registry(Closing):
    """The missions, for the threads that take them in, plan them and answer for them.

    One lock orders all changes, so statuses are published in the order in which they came about.

    Parameters
    ----------
    store
        Where they are kept.
    bus
        Where they are published.
    most_running
        Missions of one client that are planned at the same time: the others' find a free planner.
    """

    def __init__(self, store: Store, bus: Session, most_running: int) -> None:
        self.store = store
        self.bus = bus
        self.most_running = most_running
        self.on_final: Callable[[MissionStatus], None] = lambda _status: None
        """Called with each outcome, once it is published."""
        self._changed = threading.Condition()
        self._order = Order()
        self._running: dict[Revision, _Running] = {}
        self._closed = False

    def __enter__(self) -> Self:
        for status in self.store.unannounced():
            self._announce(status)
        return self

    def close(self) -> None:
        """Change nothing any more: what is being planned waits in the store for another time."""
        with self._changed:
            self._closed = True
            for revision, running in self._running.items():
                with suppress(OxbowError, sqlite3.Error):  # at the next start, it is found as it is
                    self.store.release(revision)
                for cancel in running.cancels:
                    cancel()
            self._running.clear()
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        return self._closed

    # ----------------------------------------------------------------- taking in

    def accept(self, mission_id: str, request: Request, client: str) -> MissionStatus:
        """Take in a checked mission.

        Parameters
        ----------
        mission_id
            Its id.
        request
            What to plan, and how.
        client
            Who handed it in; empty where nobody is named.

        Returns
        -------
        MissionStatus
            That of a new revision, or of the latest one where that is for the same request.
        """
        with self._changed:
            status = self._current(self.store.accept(mission_id, request, client))
            self._publish_status(status)
            self._changed.notify_all()
            return status

    def refuse(self, mission_id: str, error: OxbowError) -> None:
        """Publish that a request was refused: its sender may be listening to the status alone.

        Nothing is kept of it, and it takes no revision: the status of the mission itself is unchanged. An id that
        cannot be kept is answered under its percent-encoded form.

        Parameters
        ----------
        mission_id
            The id as it was given, valid or not.
        error
            Why it was refused.
        """
        # Not every text can be part of a key: percent-encoded, any can, and its sender can work it out.
        chunk = quote(mission_id, safe="")
        if len(chunk) > MOST_ANSWERED_CHARACTERS:
            return
        status = MissionStatus(
            mission_id=mission_id,
            revision=0,
            state=MissionState.FAILED,
            error=ErrorReply.of(error),
            time_s=time.time(),
        )
        self._publish_status(status, chunk)

    def cancel(self, mission_id: str) -> MissionStatus:
        """End whatever of a mission waits or is being planned; the status of its latest revision.

        Raises
        ------
        InvalidRequest
            There is no such mission.
        """
        cause = Cancelled("was cancelled", where=f"mission {mission_id}")
        with self._changed:
            for revision in self.store.open_revisions(mission_id):
                running = self._running.pop(revision, None)
                for cancel in running.cancels if running else ():
                    cancel()
                self._announce(self.store.fail(revision, cause))
            self._changed.notify_all()
            latest = self.statuses(mission_id)
        if not latest:
            raise InvalidRequest(
                "is not kept here; expected a mission submitted before", where=f"mission {mission_id}"
            )
        return latest[0]

    # ----------------------------------------------------------------- planning

    def claim(self) -> QueuedMission | None:
        """Wait for a revision to plan, and take it; None once the registry is closed."""
        with self._changed:
            while not self._closed:
                job = self._next_job()
                if job is not None:
                    status = self._planning(job, "", 0.0)
                    self._running[job.revision] = _Running(status, job.client)
                    self._publish_status(status)
                    return job
                self._changed.wait()
        return None

    def _next_job(self) -> QueuedMission | None:
        """A revision of the client that has the fewest being planned, and was served longest ago of these."""
        running = Counter(each.client for each in self._running.values())
        waiting = [client for client in self.store.waiting_clients() if running[client] < self.most_running]
        if not waiting:
            return None
        # Whoever has least at work comes first: else one client's hundred missions would hold every planner.
        fewest = min(running[client] for client in waiting)
        client = self._order.next(client for client in waiting if running[client] == fewest)
        self._order.note(client)
        return self.store.claim(client)

    @contextmanager
    def cancellable(self, job: QueuedMission, cancel: Callable[[], None]) -> Iterator[None]:
        """Have a job stopped where it is cancelled, or the registry is closed.

        Parameters
        ----------
        job
            What is being planned.
        cancel
            Stops it; called at once where the job was cancelled before.

        Yields
        ------
        None
            Once; `cancel` has been called by then where the job was cancelled before.
        """
        with self._changed:
            running = self._running.get(job.revision)
            if running is None:
                cancel()
            else:
                running.cancels.append(cancel)
        yield

    def note_progress(self, job: QueuedMission, stage: str, fraction: float) -> None:
        """Publish which stage is at work; this is not kept, since after a crash it is no longer true.

        Parameters
        ----------
        job
            What is being planned; nothing is published where it was cancelled or stopped.
        stage
            The stage that is asked.
        fraction
            The share of the run that is done, 0 to 1.
        """
        with self._changed:
            running = self._running.get(job.revision)
            if running is not None:
                running.status = self._planning(job, stage, fraction)
                self._publish_status(running.status)

    def _planning(self, job: QueuedMission, stage: str, fraction: float) -> MissionStatus:
        return MissionStatus(
            mission_id=job.revision.mission_id,
            revision=job.revision.number,
            state=MissionState.PLANNING,
            stage=stage,
            fraction=fraction,
            time_s=time.time(),
        )

    def settle(self, job: QueuedMission, outcome: bytes | OxbowError) -> None:
        """Keep and publish the outcome of a job.

        That of a run that was cancelled or stopped meanwhile is dropped.

        Parameters
        ----------
        job
            What was planned.
        outcome
            The completed Mission File, or why there is none.
        """
        with self._changed:
            if self._running.pop(job.revision, None) is None:
                return
            self._announce(self._kept(job.revision, outcome))
            self._changed.notify_all()

    def _kept(self, revision: Revision, outcome: bytes | OxbowError) -> MissionStatus:
        if isinstance(outcome, OxbowError):
            return self.store.fail(revision, outcome)
        try:
            return self.store.finish(revision, outcome)
        except (sqlite3.DataError, OverflowError) as error:  # it is this plan that cannot be kept, not any
            return self.store.fail(revision, Internal(f"the plan cannot be kept: {error}", where=str(revision)))

    # ----------------------------------------------------------------- publishing

    def _announce(self, status: MissionStatus) -> None:
        """Publish an outcome, its plan before its status, and note that this was done."""
        if status.state is MissionState.DONE:
            # The plan comes first: whoever hears that it is done finds it.
            plan = self.store.plan(Revision.of(status))
            self.bus.publish(mission_key(status.mission_id, "plan"), plan)
            if self.is_replan(Revision.of(status)):
                self.bus.publish(mission_key(status.mission_id, "replan"), plan)
        self._publish_status(status)
        # After it was published: a crash in between publishes it twice, which does no harm, rather than never.
        self.store.mark_announced(Revision.of(status))
        self.on_final(status)

    def _publish_status(self, status: MissionStatus, chunk: str | None = None) -> None:
        key = MissionKey(chunk or status.mission_id, "status")
        self.bus.publish(str(key), msgspec.json.encode(status))

    def is_replan(self, revision: Revision) -> bool:
        """Whether a revision's plan takes the place of what guidance may be following already."""
        return revision.number > self.store.planned(revision.mission_id)[0].number

    # ----------------------------------------------------------------- asking

    def when_final(self, status: MissionStatus, wait: Callable[[Revision], None]) -> MissionStatus:
        """Look up a revision's status, or begin to wait for its outcome, with no gap between the two.

        Parameters
        ----------
        status
            A status of the revision.
        wait
            Called where the status is not final, before `on_final` can be.

        Returns
        -------
        MissionStatus
            The present one.
        """
        with self._changed:
            status = self.store.status(Revision.of(status))
            if not status.state.is_final:
                wait(Revision.of(status))
            return status

    def statuses(self, mission_id: str | None) -> list[MissionStatus]:
        """The status of one mission's latest revision, or of each mission's."""
        with self._changed:
            return [self._current(status) for status in self.store.statuses(mission_id)]

    def _current(self, kept: MissionStatus) -> MissionStatus:
        running = self._running.get(Revision.of(kept))
        return kept if running is None else running.status
