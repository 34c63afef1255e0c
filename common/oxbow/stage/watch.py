"""Ends a worker process that would be waited for in vain."""

from __future__ import annotations

import enum
import os
import subprocess
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Self

__all__ = ["Verdict", "Watch", "is_stopped"]

STOPPED_S = 2.0
"""How long a process may be stopped (SIGSTOP), as by a debugger or a shell; after that it counts as frozen."""

_SLICE_S = 0.5


class Verdict(enum.Enum):
    """Why a watch killed its process."""

    LATE = "late"
    FROZEN = "frozen"


class Watch:
    """Kills a process that is past a deadline or frozen, while someone reads from its pipe or writes to it.

    The reader or writer then finds the pipe closed: it is held up neither by a message that never comes or breaks
    off half way, nor by a pipe that is full. A context manager.

    Parameters
    ----------
    process
        A child of this process.
    deadline_s
        Unix time.

    Attributes
    ----------
    verdict
        Why the process was killed; None where it was not.
    data_bytes
        The most memory of its own that the process was seen to take; 0 where the system does not report it.
    """

    def __init__(self, process: subprocess.Popen[bytes], deadline_s: float) -> None:
        self.verdict: Verdict | None = None
        self.data_bytes = 0
        self._process = process
        self._deadline_s = deadline_s
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="watch", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        running = time.monotonic()
        # In slices: whether a process is stopped can only be asked, not waited for beside a deadline.
        while not self._over.wait(min(_SLICE_S, max(0.0, self._deadline_s - time.time()))):
            self.data_bytes = max(self.data_bytes, _data_bytes(self._process.pid))
            if not is_stopped(self._process.pid):
                running = time.monotonic()
            if time.time() >= self._deadline_s:
                self.verdict = Verdict.LATE
            elif time.monotonic() - running > STOPPED_S:
                self.verdict = Verdict.FROZEN
            if self.verdict is not None:
                # SIGKILL, the only signal that ends a stopped process.
                self._process.kill()
                return


def is_stopped(pid: int) -> bool:
    """Whether a child of this process is stopped, as by SIGSTOP."""
    try:
        # WNOWAIT: the state is left to be asked for again.
        return os.waitid(os.P_PID, pid, os.WSTOPPED | os.WNOHANG | os.WNOWAIT) is not None
    except ChildProcessError:
        return False


def _data_bytes(pid: int) -> int:
    try:
        # The sixth number of statm is data and stack, which is nearly what RLIMIT_DATA limits.
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[5])
    except (OSError, IndexError, ValueError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")
