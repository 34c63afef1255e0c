"""The session process's handle of its worker process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe

import msgspec

from oxbow.errors import DeadlineExceeded, Unavailable
from oxbow.stage.wire import Described, Done, Failed, FromWorker, Job, Shown

__all__ = ["Worker", "WorkerLost"]

START_S = 30.0
END_S = 2.0


class WorkerLost(Unavailable):
    """The worker process died with a job."""


class Worker:
    """Runs a stage's handler in a process of its own, which is replaced when it dies or is late.

    A process that holds a bus session must stay responsive, and C code may keep the interpreter's lock for
    seconds. The process is a fresh one, never a fork: a child forked after zenoh has opened hangs.

    Parameters
    ----------
    endpoint, handler
        As ``package.module:attribute``.
    instance
        The replica's name.
    """

    def __init__(self, endpoint: str, handler: str, instance: str) -> None:
        self.endpoint = endpoint
        self.handler = handler
        self.instance = instance
        self.restarts = 0
        self._launch()

    @property
    def pid(self) -> int:
        return self._process.pid

    def describe(self) -> Described:
        """Wait for a newly started process, and return what it says about itself.

        Raises
        ------
        Unavailable
            It ended, or stayed silent, before it was ready.
        """
        try:
            described = self._receive(START_S)
        except (WorkerLost, TimeoutError) as error:
            self._kill()
            raise Unavailable(f"the worker process did not start: {error}", where=self.handler) from error
        assert isinstance(described, Described)
        return described

    def run(self, job: Job, on_shown: Callable[[Shown], None]) -> Done | Failed:
        """Run a job, and call `on_shown` with each layer on the way.

        Raises
        ------
        WorkerLost
            The process died.
        DeadlineExceeded
            The deadline passed; the process is stopped, since nobody waits for what it does.
        """
        try:
            self._pipe.send_bytes(msgspec.msgpack.encode(job))
        except OSError as error:
            raise WorkerLost(self._obituary(), where=self.handler) from error
        while True:
            try:
                message = self._receive(job.envelope.remaining_s())
            except TimeoutError:
                self._kill()
                raise DeadlineExceeded("stopped at the deadline, not done yet", where=self.handler) from None
            if isinstance(message, Done | Failed):
                return message
            if isinstance(message, Shown):
                on_shown(message)

    def alive(self) -> bool:
        return self._process.poll() is None

    def restart(self) -> None:
        """Replace the process by a new one, and wait until it is ready."""
        self.restarts += 1
        self._kill()
        self._launch()
        self.describe()

    def close(self) -> None:
        """End the process: at once where it is idle."""
        self._pipe.close()
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._kill()

    def _launch(self) -> None:
        self._pipe, theirs = Pipe()
        with theirs:
            fd = theirs.fileno()
            self._process = subprocess.Popen(
                [sys.executable, "-m", "oxbow.stage.process", str(fd), self.endpoint, self.handler, self.instance],
                pass_fds=[fd],
                stdin=subprocess.DEVNULL,
                stdout=2,  # what a handler prints is no data
                env=_one_threaded(),
            )

    def _receive(self, timeout_s: float) -> FromWorker:
        try:
            if not self._pipe.poll(max(0.0, timeout_s)):
                raise TimeoutError(f"silent for {timeout_s:.1f} s")
            data = self._pipe.recv_bytes()
        except (EOFError, ConnectionError) as error:
            raise WorkerLost(self._obituary(), where=self.handler) from error
        message: FromWorker = msgspec.msgpack.decode(data, type=FromWorker)
        return message

    def _obituary(self) -> str:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(END_S)
        self._kill()
        status = self._process.returncode
        cause = f"by {signal.Signals(-status).name}" if status < 0 else f"with status {status}"
        return f"worker process {self.pid} ended {cause}"

    def _kill(self) -> None:
        self._pipe.close()
        self._process.kill()
        self._process.wait()


def _one_threaded() -> dict[str, str]:
    """An environment in which linear algebra takes one thread: results must not depend on the number of cores."""
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**threads, **os.environ}
