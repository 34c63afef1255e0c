"""How a command ends when it is asked to: by Ctrl-C, SIGTERM or SIGHUP.

A command with nothing to tidy leaves at once: an exception, raised wherever the interpreter happens to be, would
surface as another one, or be swallowed, as while a library is imported. One that has started processes unwinds.
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
    """The one answer of this process to the signals that ask it to end.

    Attributes
    ----------
    status
        The exit status that goes with the signal received; None where there was none.
    """

    def __init__(self) -> None:
        self.status: int | None = None
        self._unwinds = False
        self._held = False

    def begin(self) -> None:
        """Answer signals from now on, those that are ignored (as nohup leaves them) excepted."""
        for number in _SIGNALS:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._on_signal)

    @contextmanager
    def orderly(self) -> Iterator[None]:
        """Within, a first signal leaves through every `with`, and a second one at once."""
        self._unwinds = True
        try:
            yield
        finally:
            self._unwinds = False

    @contextmanager
    def held(self) -> Iterator[None]:
        """Within, nothing ends: for what is short, and should not be left half done."""
        self._held = True
        try:
            yield
        finally:
            self._held = False
        if self.status is not None:
            self._end(self.status)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        is_first = self.status is None
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
    """End the process, its terminal as a progress bar may have left it put right."""
    if os.isatty(2):
        os.write(2, _SHOW_CURSOR)
    os._exit(status)


ending = Ending()
