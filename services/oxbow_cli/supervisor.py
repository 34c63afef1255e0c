"""Child processes: started, restarted when they end or hang, and stopped without leaving any behind."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from types import TracebackType
from typing import Self

from oxbow.errors import Unavailable

__all__ = ["Child", "Supervisor"]

GRACE_S = 10.0
"""How long children may take for an orderly end before they are killed."""

HURRIED_GRACE_S = 0.5
"""The same after an error or Ctrl-C, when their work is of no more use."""

_CHECK_S = 0.1
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.2, 5.0
_SETTLED_S = 10.0
_log = logging.getLogger(__name__)


class Child:
    """A process, and those that replace it when it ends.

    It leads a session of its own. So Ctrl-C reaches only the supervisor, which then stops its children in order,
    and whatever the process has started itself can be killed with it.

    Parameters
    ----------
    name
        Its name in the log.
    arguments
        Arguments to this Python interpreter.
    rank
        Its place in the order of stopping; the highest is stopped first.
    output
        A file descriptor for all that it prints; None for this process's stderr.

    Attributes
    ----------
    starts
        How many times it has been started.
    trouble
        Why it does not run; empty while it runs.

    Raises
    ------
    Unavailable
        It cannot be started.
    """

    def __init__(self, name: str, arguments: Sequence[str], rank: int, output: int | None) -> None:
        self.name = name
        self.rank = rank
        self.starts = 0
        self._command = [sys.executable, *arguments]
        self._output = sys.stderr.fileno() if output is None else output
        self._pause_s = _FIRST_PAUSE_S
        self._start_again: float | None = None
        try:
            self._start()
        except OSError as error:
            raise Unavailable(f"cannot be started: {error}", where=name) from error

    def _start(self) -> None:
        self.process = subprocess.Popen(
            self._command,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=self._output,
            start_new_session=True,
        )
        self.starts += 1
        self.trouble = ""
        self._started = time.monotonic()
        self._start_again = None

    @property
    def pid(self) -> int:
        return self.process.pid

    def runs(self) -> bool:
        return self.process.poll() is None

    def age_s(self) -> float:
        """How long ago its current process was started."""
        return time.monotonic() - self._started

    def revive(self) -> None:
        """Restart it if it has ended, after a pause that doubles while it keeps ending early."""
        if self.runs():
            return
        if self._start_again is None:
            self.send(signal.SIGKILL)  # kills what it had started itself
            if self.age_s() > _SETTLED_S:
                self._pause_s = _FIRST_PAUSE_S
            self._start_later(f"ended with status {self.process.returncode}")
        elif time.monotonic() >= self._start_again:
            try:
                self._start()
            except OSError as error:
                self._start_later(f"cannot be started: {error}")

    def _start_later(self, why: str) -> None:
        self.trouble = why
        _log.warning("%s %s; again in %.1f s", self.name, why, self._pause_s)
        self._start_again = time.monotonic() + self._pause_s
        self._pause_s = min(2 * self._pause_s, _LONGEST_PAUSE_S)

    def replace(self, why: str) -> None:
        """Kill it and all that it has started; `revive` starts it again."""
        _log.warning("%s %s; it is killed", self.name, why)
        self.send(signal.SIGKILL)

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the process and those that it has started."""
        with suppress(ProcessLookupError):
            os.killpg(self.pid, number)

    def terminate(self) -> None:
        """Ask the process for an orderly end, even if it is stopped."""
        self.process.terminate()
        self.send(signal.SIGCONT)  # a stopped process receives SIGTERM only once it continues

    def stop(self, grace_s: float) -> None:
        """Wait at most `grace_s` for it to end; then kill it, and whatever it leaves behind."""
        try:
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(grace_s)
        finally:
            self.send(signal.SIGKILL)
            self.process.wait()


class Supervisor:
    """Runs children until it is closed; a context manager.

    Children that should not outlive a killed supervisor must notice its death themselves
    (`oxbow.runtime.lifetime`).

    Parameters
    ----------
    output
        A file descriptor for all that children print; None for this process's stderr.
    """

    def __init__(self, output: int | None = None) -> None:
        self.children: list[Child] = []
        self._output = output
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self, name: str, arguments: Sequence[str], rank: int) -> Child:
        """Start a child.

        Parameters
        ----------
        name, arguments, rank
            See `Child`.

        Returns
        -------
        Child
            Running; restarted only once `keep_alive` has been called.

        Raises
        ------
        Unavailable
            It cannot be started.
        """
        child = Child(name, arguments, rank, self._output)
        self.children.append(child)
        return child

    def ended(self) -> dict[str, int]:
        """The exit status of each child that has ended, by name."""
        return {child.name: child.process.returncode for child in self.children if not child.runs()}

    def keep_alive(self) -> None:
        """From now on, restart children that end."""
        for child in self.children:
            self.repeat(child.revive, _CHECK_S, child.name)

    def repeat(
        self,
        step: Callable[[], object],
        period_s: float,
        name: str,
        at_end: Callable[[], object] = lambda: None,
    ) -> None:
        """Call a function again and again on a thread of its own, until the supervisor is closed.

        Parameters
        ----------
        step
            Called every period; what it raises is logged, and the pauses then grow.
        period_s
            The pause between calls.
        name
            Of the thread, for the log.
        at_end
            Called last, on the same thread.
        """

        def run() -> None:
            try:
                self._repeat(step, period_s, name)
            finally:
                at_end()

        # A thread for each child: one that is slow to start must not hold up the restart of another.
        thread = threading.Thread(target=run, name=name, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _repeat(self, step: Callable[[], object], period_s: float, name: str) -> None:
        pause_s = period_s
        while not self._closing.wait(pause_s):
            try:
                step()
                pause_s = period_s
            except BaseException as error:  # noqa: BLE001 - a panic of zenoh's is no Exception
                pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
                known = isinstance(error, OSError)
                _log.error("%s: %s; again in %.1f s", name, error, pause_s, exc_info=not known)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close(GRACE_S if error is None else HURRIED_GRACE_S)

    def close(self, grace_s: float) -> None:
        """Stop all children, by rank; those that others need for an orderly end come last."""
        self._closing.set()
        try:
            # First, so that no thread restarts a child that has just been stopped.
            for thread in self._threads:
                thread.join()
            for rank in sorted({child.rank for child in self.children}, reverse=True):
                self._stop([child for child in self.children if child.rank == rank], grace_s)
        finally:
            for child in self.children:
                child.stop(0.0)

    def _stop(self, group: Sequence[Child], grace_s: float) -> None:
        give_up = time.monotonic() + grace_s
        # All of a rank are asked before any is waited for: they end side by side, within one grace.
        for child in group:
            child.terminate()
        for child in group:
            child.stop(max(0.0, give_up - time.monotonic()))
