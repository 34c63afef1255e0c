"""How a process of Oxbow is told to end: SIGTERM, SIGINT, or the death of the process that started it."""

from __future__ import annotations

import os
import signal
import threading
import time
from types import FrameType

__all__ = ["Lifetime"]

ORPHAN_GRACE_S = 2.0
"""How long a process may take to end in order once its parent is gone: nobody waits for what it still does."""

_SLICE_S = 0.25


class Lifetime:
    """Notices when this process should end; made once, in the main thread of a process.

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
            threading.Thread(target=self._follow, args=(parent,), name="lifetime", daemon=True).start()

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        if self._over.is_set():
            os._exit(1)
        self._over.set()

    def _follow(self, parent: int) -> None:
        while os.getppid() == parent:
            time.sleep(_SLICE_S)
        self._over.set()
        time.sleep(ORPHAN_GRACE_S)
        os._exit(1)

    def end(self) -> None:
        """End for a reason of one's own."""
        self._over.set()

    @property
    def over(self) -> bool:
        return self._over.is_set()

    def wait(self) -> None:
        """Return once this process should end."""
        # In slices: a signal that a thread of zenoh's takes does not wake the main thread.
        while not self._over.wait(_SLICE_S):
            pass
