"""How a command ends when it is asked to, by Ctrl-C, SIGTERM or SIGHUP.

A command with nothing to clean up ends at once: an exception, raised wherever the interpreter happens to be, could
surface as another one or be swallowed, for instance while a library is imported. A command that has started
processes unwinds.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["Ending", "ending"]

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_SHOW_CURSOR = b"\x1b[?25h\n"


class Ending:
    """The response of this process to the signals that ask it to end.

    Attributes
    ----------
    status
        The exit status that goes with the signal received; None before there is one.
    """

    def __init__(self) -> None:
        self.status: int | None = None
        self._unwinds = False
        self._held = False

    def begin(self) -> None:
        """Respond to signals from now on, except those that are ignored, as nohup leaves SIGHUP."""
        for number in _SIGNALS:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._on_signal)

    @contextmanager
    def orderly(self) -> Iterator[None]:
        """Within this context, a first signal unwinds the stack; a second one ends the process at once."""
        self._unwinds = True
        try:
            yield
        finally:
            self._unwinds = False

    @contextmanager
    def holding_signals(self) -> Iterator[None]:
        """Within this context, a signal waits: for short work that should not be left half done."""
        self._held = True
        try:
            yield
        finally:
            self._held = False
        # A signal that came meanwhile has waited for this.
        if self.status is not None:
            self._end(self.status)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        is_first = self.status is None
        # As shells report a death by a signal.
        self.status = 128 + number
        if not is_first:
            _leave(self.status)
        if not self._held:
            self._end(self.status)

    def _end(self, status: int) -> None:
        if self._unwinds:
            sys.exit(status)
        _leave(status)


def _leave(status: int) -> None:
    """End the process, after showing the cursor again, which a progress bar may have hidden."""
    if os.isatty(2):
        os.write(2, _SHOW_CURSOR)
    os._exit(status)  # not `sys.exit`, whose exception could be swallowed


ending = Ending()
