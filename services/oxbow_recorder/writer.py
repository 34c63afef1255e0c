"""The recorder's handle of a process that writes recordings."""

from __future__ import annotations

import logging
import queue
import subprocess
import sys
import threading
import time
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec

from oxbow_recorder.address import RecordedRun
from oxbow_recorder.wire import DrawLayer, Finish

__all__ = ["Writer"]

MOST_WAITING = 4096
MOST_WAITING_BYTES = 128 * 2**20
"""Layers that may wait to be drawn, and their size; more are dropped: planning never waits for a recording."""

END_S = 8.0
"""How long a process may take to finish its files once it has nothing else to do."""

STUCK_S = 15.0
"""How long a process may take for one layer or file: where a disk is full, rerun may wait forever."""

_log = logging.getLogger("oxbow_recorder")


class Writer:
    """A process that writes recordings, and the thread that feeds it.

    Parameters
    ----------
    folder
        Where recordings are kept.
    viewers
        Address of a server that viewers watch, if there is one.

    Attributes
    ----------
    begun
        Recordings that it was given to begin, as its owner counts.
    is_ending
        It has been asked to end.
    failed
        It ended without being asked to, or with an error.
    """

    def __init__(self, folder: Path, viewers: str | None = None) -> None:
        self.begun = 0
        self.is_ending = False
        self.failed = False
        self.pid = 0
        self._folder = folder
        self._arguments = [str(folder), *([viewers] if viewers else [])]
        self._orders: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._waiting = self._waiting_bytes = 0
        self._busy_since: float | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._thread = threading.Thread(target=self._run, name="writer", daemon=True)
        self._thread.start()

    @property
    def fill(self) -> float:
        """The share of the room for waiting layers that is taken."""
        return max(self._waiting_bytes / MOST_WAITING_BYTES, self._waiting / MOST_WAITING)

    def draw(self, run: RecordedRun, payload: bytes) -> bool:
        """Have a layer drawn.

        Parameters
        ----------
        run
            The run that it belongs to.
        payload
            The encoded layer.

        Returns
        -------
        bool
            False where too much waits already, and the layer is dropped.
        """
        # Read without the lock: whoever adds holds the recorder's own, so that it can only shrink meanwhile.
        if self._waiting >= MOST_WAITING or self._waiting_bytes + len(payload) > MOST_WAITING_BYTES:
            return False
        self._put(msgspec.msgpack.encode(DrawLayer(run=run, payload=payload)))
        return True

    def finish(self, run: RecordedRun) -> None:
        """Have the recording of a run put in its place, when all of its layers are drawn."""
        self._put(msgspec.msgpack.encode(Finish(run=run)))

    def end(self) -> None:
        """Have the process end when it has done all that waits."""
        if not self.is_ending:
            self.is_ending = True
            self._orders.put(None)

    def has_ended(self) -> bool:
        """Whether nothing is left of it."""
        return not self._thread.is_alive()

    def has_died(self) -> bool:
        """Whether its process has ended with no one asking."""
        process = self._process
        return self.failed or (process is not None and process.poll() is not None)

    def join(self, timeout_s: float) -> None:
        """Wait for the end; kill the process after `timeout_s`."""
        self._thread.join(timeout_s)
        self._kill()
        self._thread.join()

    def kill_if_stuck(self) -> None:
        """Kill a process that makes no progress, at the cost of what it has not finished."""
        since = self._busy_since
        if since is not None and time.monotonic() - since > STUCK_S:
            _log.error("%s: nothing could be written for %.0f s; the writer is killed", self._folder, STUCK_S)
            self._kill()

    def _put(self, order: bytes) -> None:
        with self._lock:
            self._waiting += 1
            self._waiting_bytes += len(order)
        self._orders.put(order)

    def _run(self) -> None:
        """Feed a process until there is no more; on this writer's thread."""
        try:
            self._feed()
        except OSError as error:
            self.failed = True
            _log.error("%s: a writer failed with all recordings that it had not finished: %s", self._folder, error)
        finally:
            self._kill()

    def _feed(self) -> None:
        # Started on this thread and not by the caller, who holds the recorder's lock: a start takes a moment.
        ours, theirs = Pipe()
        with ours:
            with theirs:
                self._process = self._launch(theirs)
                self.pid = self._process.pid
            while (order := self._orders.get()) is not None:
                self._send(ours, order)
        # The pipe is closed: the process finishes its files, and ends.
        try:
            status = self._process.wait(END_S)
        except subprocess.TimeoutExpired as error:
            raise OSError(str(error)) from error
        if status != 0:
            raise OSError(f"it ended with status {status}")

    def _launch(self, pipe: Connection) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "oxbow_recorder.process", str(pipe.fileno()), *self._arguments],
            pass_fds=[pipe.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=2,
        )

    def _send(self, pipe: Connection, order: bytes) -> None:
        """Send an order, and wait until it has been followed."""
        self._busy_since = time.monotonic()
        try:
            pipe.send_bytes(order)
            pipe.recv_bytes()  # one order at a time: what waits is counted, rather than hidden in a pipe
        except EOFError as error:
            raise OSError("its process died") from error
        finally:
            self._busy_since = None
            with self._lock:
                self._waiting -= 1
                self._waiting_bytes -= len(order)

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
