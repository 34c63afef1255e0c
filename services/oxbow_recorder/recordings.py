"""One rerun file for each run of a mission."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import rerun as rr

from oxbow.errors import OxbowError, Unavailable
from oxbow.geometry.frame import Frame
from oxbow.wire.recording import Stamped
from oxbow_recorder.address import RecordedRun
from oxbow_recorder.blueprint import blueprint
from oxbow_recorder.drawing import draw
from oxbow_recorder.files import part_path, recording_id, recording_path

__all__ = ["Recording", "Recordings"]

FLUSH_S = 5.0
"""How long what is left of a recording may take to be written: where a disk is full, rerun may wait forever."""

LEAVE_S = 1.0
"""How long viewers may take to be served what is left; where nobody serves them, rerun takes some seconds more."""

_ABANDONED: list[rr.RecordingStream] = []
"""Streams whose files could not be written: to leave one may take forever, so they are kept until the end."""

_log = logging.getLogger("oxbow_recorder")


class Recording:
    """The recording of one run, written beside its place and moved there when it is finished.

    Parameters
    ----------
    folder
        Where the file ends up, as ``<mission>.rrd``; an older one is replaced as a whole.
    viewers
        Address of a server that viewers watch, if there is one.

    Raises
    ------
    Unavailable
        The file cannot be written.
    """

    def __init__(self, folder: Path, run: RecordedRun, viewers: str | None = None) -> None:
        self.path = recording_path(folder, run)
        self._part = part_path(folder, run)
        self._file = rr.RecordingStream("oxbow", recording_id=recording_id(run))
        with self._writing():
            folder.mkdir(parents=True, exist_ok=True)
            self._part.unlink(missing_ok=True)
            self._file.set_sinks(rr.FileSink(str(self._part)), default_blueprint=blueprint())
        self._streams = [self._file]
        if viewers is not None:
            # A stream of its own: that nobody serves viewers must not cost the file.
            live = rr.RecordingStream("oxbow", recording_id=recording_id(run))
            live.connect_grpc(viewers, default_blueprint=blueprint())
            self._streams.append(live)
        for stream in self._streams:
            stream.send_recording_name(run.mission_id)

    def add(self, stamped: Stamped) -> None:
        """Draw one layer."""
        layer = stamped.layer
        frame = None if stamped.origin is None else Frame(*stamped.origin)
        # Drawn once, for the file and for the viewers.
        drawn = tuple(draw(layer, frame, stamped.part))
        for stream in self._streams:
            stream.set_time("time", timestamp=stamped.time_s)
            stream.set_time("step", sequence=layer.step)
            for each in drawn:
                stream.log(each.entity, each.archetype)

    def finish(self) -> Path:
        """Finish the file and put it in its place."""
        try:
            with self._writing():
                self._file.flush(timeout_sec=FLUSH_S)
                self._file.disconnect()
                return self._part.replace(self.path)
        finally:
            for live in self._streams[1:]:
                _leave(live)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except (OSError, RuntimeError) as error:  # rerun raises RuntimeError, also for a full disk
            _ABANDONED.append(self._file)
            with suppress(OSError):
                # Half a recording is of no use, and on a full disk its room is.
                self._part.unlink(missing_ok=True)
            raise Unavailable(f"cannot be written: {error}", where=str(self.path)) from error


def _leave(live: rr.RecordingStream) -> None:
    """Leave the server for viewers, which may be gone."""
    try:
        live.flush(timeout_sec=LEAVE_S)
        live.disconnect()
    except RuntimeError as error:
        _ABANDONED.append(live)
        _log.warning("viewers do not see the end of a recording: %s", error)


class Recordings:
    """All runs that this process records.

    Parameters
    ----------
    folder
        Where recordings are kept.
    viewers
        Address of a server that viewers watch, if there is one.
    """

    def __init__(self, folder: Path, viewers: str | None = None) -> None:
        self.folder = folder
        self.viewers = viewers
        self._open: dict[RecordedRun, Recording | None] = {}
        """None stands for a recording that could not be begun: its layers have nowhere to go."""

    def add(self, run: RecordedRun, stamped: Stamped) -> None:
        """Draw a layer in its run's recording, which the first one begins.

        Parameters
        ----------
        run
            The run that the layer belongs to.
        stamped
            The layer, and when and where it was shown.

        Raises
        ------
        Unavailable
            The recording cannot be begun; further layers of the run are passed over.
        """
        if run not in self._open:
            # First None, which stays where the recording cannot be begun: it is tried only once.
            self._open[run] = None
            self._open[run] = Recording(self.folder, run, self.viewers)
        recording = self._open[run]
        if recording is not None:
            recording.add(stamped)

    def finish(self, run: RecordedRun) -> None:
        """Put the recording of a run in its place."""
        recording = self._open.pop(run, None)
        if recording is not None:
            _log.info("wrote %s", recording.finish())

    def close(self) -> None:
        """Finish every file, whatever becomes of another."""
        for run in tuple(self._open):
            try:
                self.finish(run)
            except OxbowError as error:
                _log.error("%s", error)
