"""The session process's handle of its worker process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import Pipe

import msgspec

from oxbow.errors import DeadlineExceeded, Infeasible, OxbowError, Unavailable
from oxbow.stage.watch import STOPPED_S, Verdict, Watch, is_stopped
from oxbow.stage.wire import MOST_MESSAGE_BYTES, Described, Done, Failed, FromWorker, Job, Shown

__all__ = [
    "DEFAULT_MEMORY_MB",
    "Worker",
    "WorkerLost",
    "ending_text",
    "is_want_of_memory",
    "needs_memory",
    "one_threaded",
]

DEFAULT_MEMORY_MB = 4096
START_S = 30.0
END_S = 2.0

_FULL_SHARE = 0.5
"""A process that dies of a fault with this share of its memory taken has died of its limit: the next allocation
was refused, and libraries in C seldom survive that."""

_FAULTS = {-signal.SIGABRT, -signal.SIGSEGV, -signal.SIGBUS}


class WorkerLost(Unavailable):
    """The worker process died with a job, or did what no worker does."""


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
    memory_mb
        What the process may take.
    """

    def __init__(self, endpoint: str, handler: str, instance: str, memory_mb: int = DEFAULT_MEMORY_MB) -> None:
        self.endpoint = endpoint
        self.handler = handler
        self.instance = instance
        self.memory_mb = memory_mb
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
            It ended, stayed silent, or said something else, before it was ready.
        """
        try:
            with self._watched(time.time() + START_S):
                message = self._receive()
                if not isinstance(message, Described):
                    raise self._misconduct(message)
        except (WorkerLost, DeadlineExceeded, Infeasible) as error:
            raise Unavailable(f"the worker process did not start: {error}", where=self.handler) from error
        return message

    def run(self, job: Job, on_shown: Callable[[Shown], None]) -> Done | Failed:
        """Run a job.

        Whatever is raised, the process is gone: nothing that it may still say can pass for the answer to another
        job.

        Parameters
        ----------
        job
            The request, with its id and deadline.
        on_shown
            Called with each layer on the way.

        Returns
        -------
        Done or Failed
            The encoded reply, or the error that the handler raised.

        Raises
        ------
        WorkerLost
            The process died, was frozen, or said something else than the answer to this job.
        DeadlineExceeded
            The deadline passed; the process is stopped, since nobody waits for what it does.
        Infeasible
            The process died for want of memory.
        """
        with self._watched(job.envelope.deadline_s):
            # What was said before the job was sent cannot be about it.
            if self._pipe.poll():
                raise self._misconduct(self._receive())
            self._pipe.send_bytes(msgspec.msgpack.encode(job))
            while True:
                message = self._receive()
                if isinstance(message, Described) or message.request_id != job.envelope.request_id:
                    raise self._misconduct(message)
                if not isinstance(message, Shown):
                    return message
                on_shown(message)

    def alive(self) -> bool:
        """Whether the process can take a job."""
        return self._process.poll() is None and not is_stopped(self.pid)

    def restart(self) -> None:
        """Replace the process by a new one, and wait until it is ready; `Unavailable` where that fails."""
        self.restarts += 1
        self._kill()
        try:
            self._launch()
        except OSError as error:
            raise Unavailable(f"the worker process cannot be started: {error}", where=self.handler) from error
        self.describe()

    def close(self) -> None:
        """End the process: at once where it is idle."""
        self._pipe.close()  # an idle process reads the end of the pipe, and ends
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._kill()

    def _launch(self) -> None:
        self._pipe, theirs = Pipe()
        # The child has a copy of its end. Ours is closed, or the end of the child would never be noticed.
        with theirs:
            fd = theirs.fileno()
            arguments = [str(fd), self.endpoint, self.handler, self.instance, str(self.memory_mb)]
            self._process = subprocess.Popen(
                [sys.executable, "-m", "oxbow.stage.process", *arguments],
                pass_fds=[fd],
                stdin=subprocess.DEVNULL,
                stdout=2,  # what a handler prints is no data
                env=one_threaded(),
            )

    @contextmanager
    def _watched(self, deadline_s: float) -> Iterator[None]:
        """Kill the process at the deadline, where it freezes, and on whatever is raised."""
        watch = Watch(self._process, deadline_s)
        try:
            with watch:
                yield
        except (EOFError, OSError) as error:
            raise self._loss(watch) from error
        except BaseException:
            self._kill()
            raise

    def _receive(self) -> FromWorker:
        data = self._pipe.recv_bytes(MOST_MESSAGE_BYTES)
        try:
            message: FromWorker = msgspec.msgpack.decode(data, type=FromWorker)
        except (msgspec.MsgspecError, ValueError) as error:
            raise WorkerLost(f"worker process {self.pid} sent garbage: {error}", where=self.handler) from error
        return message

    def _misconduct(self, message: FromWorker) -> WorkerLost:
        kind = type(message).__name__
        about = "" if isinstance(message, Described) else f" to request {message.request_id!r}"
        return WorkerLost(f"worker process {self.pid} sent an unexpected {kind}{about}", where=self.handler)

    def _loss(self, watch: Watch) -> OxbowError:
        """What to say of a process whose pipe is closed."""
        if watch.verdict is Verdict.LATE:
            return DeadlineExceeded("stopped at the deadline, not done yet", where=self.handler)
        if watch.verdict is Verdict.FROZEN:
            reason = f"worker process {self.pid} was frozen for {STOPPED_S:g} s, and killed"
            return WorkerLost(reason, where=self.handler)
        try:
            # The pipe closes before the process has ended: a moment is given to it, for its status says why.
            status = self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            return WorkerLost(f"worker process {self.pid} closed its pipe, or sent garbage", where=self.handler)
        finally:
            self._kill()
        if is_want_of_memory(status, watch.data_bytes, self.memory_mb):
            return needs_memory(self.memory_mb, self.handler)
        return WorkerLost(f"worker process {self.pid} {ending_text(status)}", where=self.handler)

    def _kill(self) -> None:
        self._pipe.close()
        self._process.kill()
        # Reaped, or it would stay in the process table as a zombie.
        self._process.wait()


def needs_memory(memory_mb: int, where: str) -> Infeasible:
    """The error of a request that does not fit.

    Parameters
    ----------
    memory_mb
        What the worker process may take.
    where
        The stage, or its handler.

    Returns
    -------
    Infeasible
        To be raised, or sent, by the caller.
    """
    return Infeasible(
        f"needs more than the {memory_mb} MB of memory that a worker process may take (--memory-mb)", where=where
    )


def is_want_of_memory(status: int, data_bytes: int, memory_mb: int) -> bool:
    """Whether a process died of its memory limit.

    Parameters
    ----------
    status
        What it ended with; a signal is negative.
    data_bytes
        The most memory that it was seen to have.
    memory_mb
        Its limit.

    Returns
    -------
    bool
        False for a process that was killed from outside, or died of a fault with memory to spare.
    """
    return status in _FAULTS and data_bytes > _FULL_SHARE * memory_mb * 2**20


def ending_text(status: int) -> str:
    """How a process ended."""
    return f"ended by {_signal_name(-status)}" if status < 0 else f"ended with status {status}"


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def one_threaded() -> dict[str, str]:
    """An environment in which linear algebra takes one thread: results must not depend on the number of cores."""
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    # What the user has set takes precedence.
    return {**threads, **os.environ}
