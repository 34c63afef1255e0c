"""What makes a process of Oxbow end: SIGTERM, SIGINT, or the death of the process that started it."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType

__all__ = ["Lifetime", "wake_with_parents_death"]

ORPHAN_GRACE_S = 2.0
"""How long a process may take for an orderly end once its parent is gone: nobody waits for its work any more."""

_SLICE_S = 0.25
_PR_SET_PDEATHSIG = 1


def wake_with_parents_death() -> None:
    """Let the death of the parent resume this process if it is stopped (SIGSTOP), on Linux.

    It can then notice that death, and end. A signal that kills is no alternative: the kernel sends it when the
    *thread* ends that started this process, and the parent's other threads may still need it.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGCONT)


class Lifetime:
    """Notices when this process should end; created once, in the main thread of a process.

    The first signal asks for an orderly end; a second one exits at once, with status 1.

    Parameters
    ----------
    parent
        Process id of the parent to end with; None to outlive it.
    """

    def __init__(self, parent: int | None = None) -> None:
        self._over = threading.Event()
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._on_signal)
        if parent is not None:
            wake_with_parents_death()
            threading.Thread(target=self._follow, args=(parent,), name="lifetime", daemon=True).start()

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        # Not sys.exit: the orderly end, which it would join, is what hangs.
        if self._over.is_set():
            os._exit(1)
        self._over.set()

    def _follow(self, parent: int) -> None:
        # An orphan gets another parent, at once and on every POSIX system; PR_SET_PDEATHSIG is Linux's alone.
        while os.getppid() == parent:
            time.sleep(_SLICE_S)
        self._over.set()
        time.sleep(ORPHAN_GRACE_S)
        _end_at_once()

    def end(self) -> None:
        """End for a reason other than a signal or the parent."""
        self._over.set()

    @property
    def over(self) -> bool:
        """Whether this process should end."""
        return self._over.is_set()

    def wait(self, meanwhile: Callable[[], object] = lambda: None) -> None:
        """Return once this process should end; `meanwhile` is called several times a second."""
        # In slices: a signal delivered to one of Zenoh's threads does not wake the main thread.
        while not self._over.wait(_SLICE_S):
            meanwhile()


def _end_at_once() -> None:
    """End, along with all child processes: a group that this process leads contains nobody else."""
    if os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(1)
