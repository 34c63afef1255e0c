"""One rerun file for each run of a mission."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import rerun as rr

from oxbow.frame import Frame
from oxbow.recording import Stamped
from oxbow_recorder.address import Run
from oxbow_recorder.blueprint import blueprint
from oxbow_recorder.drawing import draw
from oxbow_recorder.files import part_path, recording_path, sweep
from oxbow_recorder.vitals import Counts

__all__ = ["Recording", "Recordings"]

_log = logging.getLogger("oxbow_recorder")

IDLE_S = 300.0
"""A run that has shown nothing for so long is closed."""

END = frozenset({"done", "failed"})
"""Names of the mission's last layer."""


class Recording:
    """The recording of one run, written beside its place and moved there when it is closed.

    Parameters
    ----------
    folder
        Where the file ends up, as ``<mission>.rrd``; an older one is replaced as a whole.
    live
        Address of a server that viewers watch, if there is one.
    """

    def __init__(self, folder: Path, run: Run, live: str | None = None) -> None:
        self.path = recording_path(folder, run)
        self._part = part_path(folder, run)
        self.seen = time.monotonic()
        self._stream = rr.RecordingStream("oxbow", recording_id=f"{run.mission_id}-{run.run_id}")
        sinks: Sequence[rr.FileSink | rr.GrpcSink] = (
            [rr.FileSink(str(self._part))] if live is None else [rr.FileSink(str(self._part)), rr.GrpcSink(live)]
        )
        self._stream.set_sinks(*sinks, default_blueprint=blueprint())
        self._stream.send_recording_name(run.mission_id)

    def add(self, stamped: Stamped) -> None:
        """Draw one layer."""
        self.seen = time.monotonic()
        layer = stamped.layer
        frame = None if stamped.origin is None else Frame(*stamped.origin)
        self._stream.set_time("time", timestamp=stamped.time_s)
        self._stream.set_time("step", sequence=layer.step)
        for drawn in draw(layer, frame, stamped.part):
            self._stream.log(drawn.entity, drawn.archetype)

    def close(self) -> Path:
        """Finish the file and put it in its place."""
        self._stream.flush()
        self._stream.disconnect()
        return self._part.replace(self.path)


class Recordings:
    """All runs that are being recorded.

    Parameters
    ----------
    folder
        Where recordings are kept.
    live
        Address of a server that viewers watch, if there is one.
    clock
        Tells the time by which idle runs are closed, in seconds.
    """

    def __init__(self, folder: Path, live: str | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self.folder = folder
        self.live = live
        self._clock = clock
        self._open: dict[Run, Recording] = {}
        self._finished = 0
        folder.mkdir(parents=True, exist_ok=True)
        sweep(folder)

    def add(self, stamped: Stamped) -> None:
        """Draw a layer in its run's recording, and close that with its last one."""
        run = Run(mission_id=stamped.mission_id, run_id=stamped.request_id or "run")
        if run not in self._open:
            self._open[run] = Recording(self.folder, run, live=self.live)
        self._open[run].add(stamped)
        if stamped.layer.stage == "mission" and stamped.layer.name in END:
            self._close(run)
        self._close_idle()

    def counts(self) -> Counts:
        return Counts(finished=self._finished, open=len(self._open))

    def close(self) -> None:
        """Finish every file."""
        for run in list(self._open):
            self._close(run)

    def _close_idle(self) -> None:
        for run, recording in list(self._open.items()):
            if self._clock() - recording.seen > IDLE_S:
                self._close(run)

    def _close(self, run: Run) -> None:
        self._finished += 1
        _log.info("wrote %s", self._open.pop(run).close())
