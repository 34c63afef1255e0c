"""The mission service's handle of a helper process."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import Pipe
from multiprocessing.connection import Connection

import msgspec

from oxbow.errors import DeadlineExceeded, Internal, OxbowError
from oxbow.runtime.closing import Closing
from oxbow.stage.watch import Verdict, Watch
from oxbow.stage.worker import ending_text, is_want_of_memory, needs_memory, one_threaded
from oxbow_mission.wire import (
    STAGE,
    Answer,
    Ask,
    Check,
    Checked,
    FromHelper,
    HelperFailed,
    Plan,
    Planned,
    Ready,
    Said,
    Show,
    ToHelper,
    Told,
)

__all__ = ["Helper", "HelperDied", "Helpers"]

START_S = 30.0
END_S = 2.0
MOST_MESSAGE_BYTES = 2**29

Outcome = Checked | Planned | HelperFailed


class HelperDied(Internal):
    """A helper process ended with an order.

    Attributes
    ----------
    is_own_fault
        Whether it died of what it did; a process that is killed from outside did not.
    """

    def __init__(self, message: str, *, is_own_fault: bool) -> None:
        super().__init__(message, where=STAGE)
        self.is_own_fault = is_own_fault


class Helper(Closing):
    """A process that reads what came from outside: geometry may hold the interpreter's lock for minutes, take all
    memory, or crash the libraries, and none of that may happen in the process that has the bus and the store.

    It is a fresh process, never a fork, is started when it is first needed, and is replaced once it has ended.
    One thread at a time may have orders carried out, but any may `kill` it.

    Parameters
    ----------
    handler
        What carries out its orders, as ``package.module:attribute``.
    memory_mb
        What the process may take.
    """

    def __init__(self, handler: str, memory_mb: int) -> None:
        self.handler = handler
        self.memory_mb = memory_mb
        self._lock = threading.Lock()
        self._is_up, self._order = False, 0
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None

    def carry_out(
        self, order: Check | Plan, limit_s: float, answer: Callable[[Ask | Show], Answer | None]
    ) -> Outcome:
        """Have an order carried out.

        Whatever is raised, the process is ended: nothing that it may still say can pass for the outcome of another
        order.

        Parameters
        ----------
        order
            What to do.
        limit_s
            Seconds that it may take, once the process is up.
        answer
            Called with whatever the process asks or shows on the way; what it returns answers what was asked.

        Returns
        -------
        Checked, Planned or HelperFailed
            What became of the order.

        Raises
        ------
        DeadlineExceeded
            It was not done by then, or the process did not come up.
        Infeasible
            The process died for want of memory.
        HelperDied
            The process ended, or said something that makes no sense.
        """
        # Both limits count apart: a process that takes long to load must not cost the order its time.
        self.start()
        if not self._is_up:
            with self._limited(START_S):
                self._greet()
        with self._limited(limit_s):
            return self._converse(order, answer)

    @contextmanager
    def _limited(self, limit_s: float) -> Iterator[None]:
        """End the process where it takes longer, and on whatever is raised."""
        assert self._process is not None
        watch = Watch(self._process, time.time() + limit_s)
        try:
            with watch:
                yield
        except (EOFError, OSError) as error:
            raise self._loss(watch, limit_s) from error
        except BaseException:
            self.kill()
            raise

    def _greet(self) -> None:
        """Wait until the process has loaded what it needs: that is no part of an order's time."""
        if not isinstance(self._heard(), Ready):
            raise HelperDied("a helper process said something before it was ready", is_own_fault=False)
        self._is_up = True

    def _converse(self, order: Check | Plan, answer: Callable[[Ask | Show], Answer | None]) -> Outcome:
        self._order += 1
        self._tell(order)
        # It may ask or show any number of times before it is done.
        while isinstance(said := self._heard(), Ask | Show):
            reply = answer(said)
            if reply is not None:
                self._tell(reply)
        if isinstance(said, Ready):
            raise HelperDied("a helper process began anew", is_own_fault=False)
        return said

    def _tell(self, message: ToHelper) -> None:
        assert self._pipe is not None
        self._pipe.send_bytes(msgspec.msgpack.encode(Told(order=self._order, what=message)))

    def _heard(self) -> FromHelper:
        assert self._pipe is not None
        data = self._pipe.recv_bytes(MOST_MESSAGE_BYTES)
        try:
            said = msgspec.msgpack.decode(data, type=Said)
        except (msgspec.MsgspecError, ValueError) as error:
            raise HelperDied(f"a helper process sent garbage: {error}", is_own_fault=True) from error
        # A late answer to one order must not pass for the answer to the next.
        if said.order != self._order:
            raise HelperDied(
                f"a helper process answered order {said.order}, not {self._order}", is_own_fault=False
            )
        return said.what

    def kill(self) -> None:
        """End the process at once; the next order starts another."""
        with self._lock:
            if self._process is not None:
                self._process.kill()

    def start(self) -> None:
        """Start a process where none runs that waits for an order, so that it is ready when it is needed."""
        with self._lock:
            if self._is_ready():
                return
            self._release()
            self._is_up, self._order = False, 0
            self._pipe, theirs = Pipe()
            # The child has a copy of its end. Ours is closed, or the end of the child would never be noticed.
            with theirs:
                fd = theirs.fileno()
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "oxbow_mission.process", str(fd), str(self.memory_mb), self.handler],
                    pass_fds=[fd],
                    stdin=subprocess.DEVNULL,
                    stdout=2,  # what a library prints is no data
                    env=one_threaded(),
                )

    def close(self) -> None:
        """End the process."""
        self.kill()
        with self._lock:
            self._release()

    def _is_ready(self) -> bool:
        """Whether a process runs, and has nothing to say unasked."""
        return (
            self._process is not None
            and self._process.poll() is None
            and self._pipe is not None
            and not (self._is_up and self._pipe.poll())
        )

    def _release(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def _loss(self, watch: Watch, limit_s: float) -> OxbowError:
        """What to say of a process whose pipe is closed."""
        with self._lock:
            process = self._process
            assert process is not None
            try:
                status = process.wait(END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                status = process.wait()
        if watch.verdict is Verdict.LATE:
            return DeadlineExceeded(f"stopped after {limit_s:.1f} s, not done yet", where=STAGE)
        if is_want_of_memory(status, watch.data_bytes, self.memory_mb):
            return needs_memory(self.memory_mb, STAGE)
        # The kernel's and the operator's ways to end a process; a fault of its own ends it by another signal.
        from_outside = watch.verdict is Verdict.FROZEN or status in (-signal.SIGKILL, -signal.SIGTERM)
        return HelperDied(f"helper process {process.pid} {ending_text(status)}", is_own_fault=not from_outside)


class Helpers(Closing):
    """Helper processes of one kind, as many as were ever at work at the same time.

    Parameters
    ----------
    handler, memory_mb
        As of `Helper`.
    """

    def __init__(self, handler: str, memory_mb: int) -> None:
        self.handler = handler
        self.memory_mb = memory_mb
        self._lock = threading.Lock()
        self._idle: list[Helper] = []
        self._closed = False

    @contextmanager
    def one(self) -> Iterator[Helper]:
        """A helper process for one thread, which may give it several orders, one after another."""
        with self._lock:
            helper = self._idle.pop() if self._idle else Helper(self.handler, self.memory_mb)
        try:
            yield helper
        finally:
            with self._lock:
                self._idle.append(helper)
                # Closed meanwhile: whoever closed could not end a process that was at work.
                if self._closed:
                    helper.close()

    def close(self) -> None:
        """End those that are idle, and the others when their order is carried out."""
        with self._lock:
            self._closed = True
            for helper in self._idle:
                helper.close()
