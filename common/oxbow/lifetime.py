"""How a process of Oxbow is told to end: SIGTERM, SIGINT, or the death of the process that started it."""

from __future__ import annotations

import os
import signal
import threading
from types import FrameType

__all__ = ["Lifetime"]

_PARENT_CHECK_S = 0.25


class Lifetime:
    """Notices when this process should end; made once, in the main thread of a process.

    The first signal asks for an orderly end; a second one exits at once, with status 1.

    Parameters
    ----------
    parent
        Process id of the parent to end with; None to outlive it.
    """

    def __init__(self, parent: int | None = None) -> None:
        self.parent = parent
        self._over = threading.Event()
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._on_signal)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        if self._over.is_set():
            os._exit(1)
        self._over.set()

    def end(self) -> None:
        """End for a reason of one's own."""
        self._over.set()

    @property
    def over(self) -> bool:
        if self.parent is not None and os.getppid() != self.parent:
            self._over.set()
        return self._over.is_set()

    def wait(self) -> None:
        """Return once this process should end."""
        while not self.over:
            self._over.wait(_PARENT_CHECK_S if self.parent is not None else None)
