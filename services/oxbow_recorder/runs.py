"""Which runs are recorded, and by which process: admission, ends, and bounds on everything.

Whoever is on the bus can put layers under any number of ids. What is kept of a run is bounded, and the run of a
mission that is planned, which shows many layers, is given up only after those that have shown few.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from oxbow.runtime.closing import Closing
from oxbow_recorder.address import RecordedRun, address_of
from oxbow_recorder.files import holds, recording_path
from oxbow_recorder.vitals import Counts
from oxbow_recorder.writer import END_S, Writer

__all__ = ["Runs"]

MOST_OPEN = 16
"""Runs that are recorded at the same time."""

MOST_WRITERS = 4
"""Processes that write recordings, at the same time."""

MOST_BEGUN = 32
"""Recordings that one process begins: rerun keeps 2 MB and four threads for each, which only its end frees."""

MOST_WAITING = 512
MOST_WAITING_BYTES = 64 * 2**20
"""Runs that wait to be recorded, and the size of their layers."""

MOST_REMEMBERED = 10_000
"""Runs that are known to be over."""

WAIT_S = 1.0
"""How long a run waits for a second layer; after that it is recorded if there is room."""

RECENT_S = 30.0
"""A run that has shown something within this time is active."""

IDLE_S = 900.0
"""A run that has shown nothing for this long is over."""

SPARE_S = 60.0
"""How long a process is kept that has no run to record."""

AFTER_FAILURE_S = 2.0
"""How long no process is started after one has failed."""

_log = logging.getLogger("oxbow_recorder")


@dataclass
class _Waiting:
    """A run that is not recorded yet: one of many that have shown a single layer, or one that finds no room."""

    run: RecordedRun
    since: float
    payloads: list[bytes] = field(default_factory=list)
    size: int = 0
    ended: bool = False


@dataclass
class _Open:
    """A run that is being recorded."""

    run: RecordedRun
    writer: Writer
    seen: float
    layers: int = 0
    dropped: int = 0


class Runs(Closing):
    """Takes layers from the bus, and hands them to processes that record them. Safe to share between threads.

    Parameters
    ----------
    folder
        Where recordings are kept.
    viewers
        Address of a server that viewers watch, if there is one.
    clock
        Tells the time, in seconds, by which runs are idle.
    """

    def __init__(
        self, folder: Path, viewers: str | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.folder = folder
        self.viewers = viewers
        self._clock = clock
        self._lock = threading.Lock()
        self._waiting: dict[RecordedRun, _Waiting] = {}
        self._open: dict[str, _Open] = {}
        self._over: dict[RecordedRun, bool] = {}  # and whether a late layer of it has been mentioned
        self._finished = self._refused = self._waiting_bytes = 0
        self._used = self._not_before = clock()
        self._current = Writer(folder, viewers)
        self._writers = [self._current]

    def take(self, key: str, payload: bytes) -> None:
        """Take in a layer. Never waits.

        Parameters
        ----------
        key
            Where the layer was put.
        payload
            An encoded `oxbow.wire.recording.Stamped`.

        Raises
        ------
        InvalidRequest
            It is no layer, or not of this key (`oxbow_recorder.address`).
        """
        address = address_of(key, payload)
        with self._lock:
            run = address.run
            if run in self._over:
                self._note_late(run)
                return
            recorded = self._open.get(run.mission_id)
            if recorded is not None and recorded.run == run:
                self._draw(recorded, payload)
                if address.is_last:
                    self._finish(recorded)
            else:
                self._wait(run, payload, address.is_last)

    def tick(self) -> None:
        """Do what is due; to be called several times a second."""
        with self._lock:
            self._let_go_of_runs()
            self._let_go_of_writers()
            self._admit_waiting()
            self._note_refused()

    def counts(self) -> Counts:
        """How much is done, and how much is being done."""
        with self._lock:
            pids = tuple(writer.pid for writer in self._writers if writer.pid)
            return Counts(finished=self._finished, open=len(self._open) + len(self._waiting), writers=pids)

    def is_busy(self) -> bool:
        """Whether a process has something to write."""
        with self._lock:
            return any(writer.fill > 0 and not writer.has_died() for writer in self._writers)

    def close(self) -> None:
        """Finish every recording, including those of runs that wait."""
        give_up = time.monotonic() + END_S
        with self._lock:
            for waiting in tuple(self._waiting.values()):
                self._admit(waiting)
            self._refused += sum(len(waiting.payloads) for waiting in self._waiting.values())
            self._note_refused()
            for recorded in tuple(self._open.values()):
                self._finish(recorded)
            # Taken under the lock, ended outside it: to join takes seconds.
            writers, self._writers = self._writers, []
        # All are asked to end before any is waited for, so that they finish side by side.
        for writer in writers:
            writer.end()
        for writer in writers:
            writer.join(max(0.0, give_up - time.monotonic()))

    # ----------------------------------------------------------------- waiting

    def _wait(self, run: RecordedRun, payload: bytes, is_last: bool) -> None:
        waiting = self._waiting.setdefault(run, _Waiting(run, self._clock()))
        waiting.payloads.append(payload)
        waiting.size += len(payload)
        waiting.ended |= is_last
        self._waiting_bytes += len(payload)
        if len(waiting.payloads) > 1 or is_last:
            self._admit(waiting)
        # The oldest go first: whoever floods the bus with ids pushes out their own.
        while len(self._waiting) > MOST_WAITING or self._waiting_bytes > MOST_WAITING_BYTES:
            self._refused += len(self._leave(next(iter(self._waiting.values()))).payloads)

    def _leave(self, waiting: _Waiting) -> _Waiting:
        del self._waiting[waiting.run]
        self._waiting_bytes -= waiting.size
        return waiting

    def _admit_waiting(self) -> None:
        """Record runs of one layer where nothing else waits, and those for which there was no room."""
        oldest = self._clock() - WAIT_S
        for waiting in tuple(self._waiting.values()):
            is_due = len(waiting.payloads) > 1 or waiting.ended or waiting.since < oldest
            # Where there is no room for one there is none for the next.
            if is_due and not self._admit(waiting):
                return

    def _admit(self, waiting: _Waiting) -> bool:
        """Record a run from now on; False where there is no room for it now."""
        run = waiting.run
        writer = self._writer()
        if writer is None:
            return False
        self._leave(waiting)
        # A recorder that was stopped may have finished this run before: its last layers alone must not replace the
        # whole recording.
        if holds(recording_path(self.folder, run), run):
            self._remember(run)
            self._note_late(run)
            return True
        # Another run of the same mission ends the one before, whose file it will replace.
        before = self._open.get(run.mission_id) or (self._least() if len(self._open) >= MOST_OPEN else None)
        if before is not None:
            self._finish(before)
        writer.begun += 1
        self._open[run.mission_id] = recorded = _Open(run, writer, self._clock())
        for payload in waiting.payloads:
            self._draw(recorded, payload)
        if waiting.ended:
            self._finish(recorded)
        return True

    def _least(self) -> _Open:
        """The recorded run to give up: one that is no longer active, or else the one that has shown least."""
        recent = self._clock() - RECENT_S
        return min(self._open.values(), key=lambda each: (each.seen > recent, each.layers, each.seen))

    def _note_refused(self) -> None:
        if self._refused:
            _log.warning("%d layers of runs for which there was no room are not recorded", self._refused)
            self._refused = 0

    # ----------------------------------------------------------------- recorded

    def _draw(self, recorded: _Open, payload: bytes) -> None:
        recorded.seen = self._clock()
        recorded.layers += 1
        recorded.dropped += not recorded.writer.draw(recorded.run, payload)

    def _finish(self, recorded: _Open) -> None:
        """Let the recording of a run be put in its place, where no later layer of that run changes it."""
        run = recorded.run
        del self._open[run.mission_id]
        recorded.writer.finish(run)
        self._remember(run)
        self._finished += 1
        self._used = self._clock()
        if recorded.dropped:
            _log.warning("mission %s: %d layers were too many to be recorded", run.mission_id, recorded.dropped)

    def _remember(self, run: RecordedRun) -> None:
        self._over[run] = False
        if len(self._over) > MOST_REMEMBERED:
            del self._over[next(iter(self._over))]

    def _note_late(self, run: RecordedRun) -> None:
        if not self._over[run]:
            self._over[run] = True
            _log.warning("mission %s: layers of run %s arrived after its end; dropped", run.mission_id, run.run_id)

    # ----------------------------------------------------------------- writers

    def _writer(self) -> Writer | None:
        """The process that records the next run; None where none has room now."""
        current = self._current
        if not self._is_spent(current):
            return current if current.fill < 0.5 else None  # the rest of the room is for runs that are recorded
        if len(self._writers) >= MOST_WRITERS or self._clock() < self._not_before:
            return None
        self._current = Writer(self.folder, self.viewers)
        self._writers.append(self._current)
        return self._current

    def _is_spent(self, writer: Writer) -> bool:
        return writer.is_ending or writer.has_died() or writer.begun >= MOST_BEGUN

    def _let_go_of_runs(self) -> None:
        """Finish runs from which nothing comes any more, and forget those that were lost with their process."""
        now = self._clock()
        # Where processes are scarce, runs that have gone quiet do not keep one to themselves.
        idle_s = IDLE_S if len(self._writers) < MOST_WRITERS else RECENT_S
        for recorded in tuple(self._open.values()):
            # Its file is lost with it; a later layer of the run begins a new one.
            if recorded.writer.has_died():
                del self._open[recorded.run.mission_id]
            elif now - recorded.seen > idle_s:
                self._finish(recorded)

    def _let_go_of_writers(self) -> None:
        """End processes that have nothing left to record, or have begun as much as they may."""
        now = self._clock()
        at_work = {id(recorded.writer) for recorded in self._open.values()}
        for writer in tuple(self._writers):
            writer.kill_if_stuck()
            if writer.has_ended():
                self._writers.remove(writer)
                if writer.failed:
                    self._not_before = now + AFTER_FAILURE_S
            elif id(writer) not in at_work and (self._is_spent(writer) or now - self._used > SPARE_S):
                writer.end()
