"""Where all missions stand: every change is kept in the store first, and published second."""

from __future__ import annotations

import threading
import time
from typing import Self
from urllib.parse import quote

import msgspec

from oxbow.bus import Session
from oxbow.closing import Closing
from oxbow.contracts import MissionKey, MissionState, MissionStatus, mission_key
from oxbow.errors import ErrorReply, OxbowError, Unavailable
from oxbow.submission import Submission
from oxbow_mission.store import Job, Request, Revision, Store

__all__ = ["Registry"]

MOST_ANSWERED_CHARACTERS = 1024
"""Longer ids, percent-encoded, are not answered: no sender could mean them."""


class Registry(Closing):
    """The missions, for the threads that take them in, plan them and wait for them.

    One lock orders all changes, so statuses are published in the order in which they came about.

    Parameters
    ----------
    store
        Where they are kept.
    bus
        Where they are published.
    """

    def __init__(self, store: Store, bus: Session) -> None:
        self.store = store
        self.bus = bus
        self._changed = threading.Condition()
        self._running: dict[Revision, MissionStatus] = {}
        self._closed = False

    def __enter__(self) -> Self:
        for status in self.store.unannounced():
            self._announce(status)
        return self

    def close(self) -> None:
        """Change nothing any more: what is being planned waits in the store for another time."""
        with self._changed:
            self._closed = True
            for revision in self._running:
                self.store.release(revision)
            self._running.clear()
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        return self._closed

    # ----------------------------------------------------------------- taking in

    def accept(self, submission: Submission) -> MissionStatus:
        """Take in a checked mission; the status of a new revision, or of the one that is the same."""
        parameters = msgspec.json.encode(submission.parameters)
        request = Request(submission.document, parameters, submission.fingerprint)
        with self._changed:
            status = self.store.accept(submission.mission_id, request)
            status = self._running.get(Revision.of(status), status)
            self._publish_status(status)
            self._changed.notify_all()
            return status

    def refuse(self, mission_id: str, error: OxbowError) -> None:
        """Let it be known that a request was refused: its sender may be listening to the status alone.

        Nothing is kept of it, and it takes no revision: where the mission stands remains as it was. An id that
        cannot be kept is answered under its percent-encoded form.
        """
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

    # ----------------------------------------------------------------- planning

    def claim(self) -> Job | None:
        """Wait for a revision to plan, and take it; None once the registry is closed."""
        with self._changed:
            while not self._closed:
                job = self.store.claim()
                if job is not None:
                    self._note_progress(job, "", 0.0)
                    return job
                self._changed.wait()
        return None

    def note_progress(self, job: Job, stage: str, fraction: float) -> None:
        """Publish which stage is at work; this is not kept, since after a crash it is no longer so."""
        with self._changed:
            if not self._closed:
                self._note_progress(job, stage, fraction)

    def _note_progress(self, job: Job, stage: str, fraction: float) -> None:
        status = MissionStatus(
            mission_id=job.revision.mission_id,
            revision=job.revision.number,
            state=MissionState.PLANNING,
            stage=stage,
            fraction=fraction,
            time_s=time.time(),
        )
        self._running[job.revision] = status
        self._publish_status(status)

    def settle(self, job: Job, outcome: bytes | OxbowError) -> None:
        """Keep and publish a plan, a completed Mission File, or why there is none."""
        with self._changed:
            if self._closed:
                return
            if isinstance(outcome, OxbowError):
                status = self.store.fail(job.revision, outcome)
            else:
                status = self.store.finish(job.revision, outcome)
            del self._running[job.revision]
            self._announce(status)
            self._changed.notify_all()

    # ----------------------------------------------------------------- publishing

    def _announce(self, status: MissionStatus) -> None:
        """Publish an outcome, its plan before its status, and note that this was done."""
        if status.state is MissionState.DONE:
            plan = self.store.plan(Revision.of(status))
            self.bus.publish(mission_key(status.mission_id, "plan"), plan)
            if self.is_replan(Revision.of(status)):
                self.bus.publish(mission_key(status.mission_id, "replan"), plan)
        self._publish_status(status)
        self.store.mark_announced(Revision.of(status))

    def _publish_status(self, status: MissionStatus, chunk: str | None = None) -> None:
        key = MissionKey(chunk or status.mission_id, "status")
        self.bus.publish(str(key), msgspec.json.encode(status))

    # ----------------------------------------------------------------- asking

    def wait_final(self, status: MissionStatus) -> MissionStatus:
        """Wait until a revision is done or failed.

        Raises
        ------
        Unavailable
            The service stops before; the revision is kept, and asking again continues with it.
        """
        with self._changed:
            while not status.state.is_final:
                if self._closed:
                    raise Unavailable("the mission service is stopping; ask again", where="mission")
                self._changed.wait()
                status = self.store.status(Revision.of(status))
        return status

    def statuses(self, mission_id: str | None) -> list[MissionStatus]:
        """The status of one mission's latest revision, or of each mission's."""
        with self._changed:
            kept = self.store.statuses(mission_id)
            return [self._running.get(Revision.of(status), status) for status in kept]

    def is_replan(self, revision: Revision) -> bool:
        """Whether a revision's plan takes the place of what guidance may be following already."""
        return revision.number > self.store.planned(revision.mission_id)[0].number
