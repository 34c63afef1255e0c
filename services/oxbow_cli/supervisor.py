"""Child processes: started at once, started again when they end, and stopped without a trace."""

from __future__ import annotations

import logging
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Self

__all__ = ["Child", "Supervisor"]

GRACE_S = 10.0
"""How long children may take to end in order; then they are killed."""

HURRIED_GRACE_S = 0.5
"""The same after an error or Ctrl-C: what they still do is of no use."""

_CHECK_S = 0.1
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.2, 5.0
_SETTLED_S = 10.0
_log = logging.getLogger(__name__)


class Child:
    """A process, and the ones that take its place when it ends.

    It is no member of the terminal's process group: Ctrl-C reaches the supervisor alone, which then
    stops its children in order.

    Parameters
    ----------
    name
        What it is called in the log.
    arguments
        Those of this Python interpreter.
    rank
        Its place in the order of stopping.
    output
        A file descriptor for all that it prints; where absent, this process's stderr.
    """

    def __init__(self, name: str, arguments: Sequence[str], rank: int, output: int | None) -> None:
        self.name = name
        self.rank = rank
        self._command = [sys.executable, *arguments]
        self._output = sys.stderr.fileno() if output is None else output
        self._pause_s = _FIRST_PAUSE_S
        self._start()

    def _start(self) -> None:
        self.process = subprocess.Popen(
            self._command,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=self._output,
            start_new_session=True,
        )
        self._started = time.monotonic()
        self._start_again: float | None = None

    def revive(self) -> None:
        """Start it again where it has ended, after a pause that doubles while it keeps ending soon."""
        status = self.process.poll()
        now = time.monotonic()
        if status is None:
            return
        if self._start_again is None:
            if now - self._started > _SETTLED_S:
                self._pause_s = _FIRST_PAUSE_S
            _log.warning("%s ended with status %d; again in %.1f s", self.name, status, self._pause_s)
            self._start_again = now + self._pause_s
            self._pause_s = min(2 * self._pause_s, _LONGEST_PAUSE_S)
        elif now >= self._start_again:
            self._start()

    def stop(self, grace_s: float) -> None:
        """Wait for it to end, for no longer than `grace_s`; then kill it."""
        try:
            self.process.wait(grace_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Supervisor:
    """Runs children until it is closed; a context manager.

    Children that should not outlive a supervisor that is killed have to notice its death themselves.
    """

    def __init__(self, output: int | None = None) -> None:
        self.children: list[Child] = []
        self._output = output
        self._closing = threading.Event()
        self._watch = threading.Thread(target=self._revive, name="supervisor", daemon=True)

    def start(self, name: str, arguments: Sequence[str], rank: int) -> None:
        """Start a child; those of the highest rank are stopped first."""
        self.children.append(Child(name, arguments, rank, self._output))

    def ended(self) -> dict[str, int]:
        """The exit status of each child that has ended, by name."""
        statuses = {child.name: child.process.poll() for child in self.children}
        return {name: status for name, status in statuses.items() if status is not None}

    def keep_alive(self) -> None:
        """From now on, start children again that end."""
        self._watch.start()

    def _revive(self) -> None:
        while not self._closing.wait(_CHECK_S):
            for child in self.children:
                child.revive()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close(GRACE_S if error is None else HURRIED_GRACE_S)

    def close(self, grace_s: float) -> None:
        """Stop all children, those that others need to leave in order last."""
        self._closing.set()
        if self._watch.is_alive():
            self._watch.join()
        for rank in sorted({child.rank for child in self.children}, reverse=True):
            group = [child for child in self.children if child.rank == rank]
            give_up = time.monotonic() + grace_s
            for child in group:
                child.process.terminate()
            for child in group:
                child.stop(max(0.0, give_up - time.monotonic()))
