"""How the command ends: one line on stderr for an error, and the exit status that goes with its code."""

from __future__ import annotations

import os
import sys
import traceback

from oxbow.errors import ErrorCode, OxbowError

__all__ = ["DEBUG", "exit_status", "explain"]

DEBUG = "OXBOW_DEBUG"
"""Environment variable that `--debug` sets for this process and those that it starts."""

_STATUS = {
    ErrorCode.INVALID_MISSION: 2,
    ErrorCode.INVALID_REQUEST: 2,
    ErrorCode.INVALID_OPTION: 2,
    ErrorCode.INFEASIBLE: 3,
    ErrorCode.UNAVAILABLE: 4,
    ErrorCode.BUSY: 4,
    ErrorCode.TIMEOUT: 4,
    ErrorCode.CANCELLED: 4,
    ErrorCode.INTERNAL: 1,
}


def exit_status(error: Exception) -> int:
    """2 invalid input, 3 infeasible, 4 unavailable, busy, timed out or cancelled, 1 a fault of Oxbow's own."""
    return _STATUS[error.code] if isinstance(error, OxbowError) else _STATUS[ErrorCode.INTERNAL]


def explain(error: Exception) -> None:
    """Report on stderr what went wrong, in one line; with the traceback only if `DEBUG` is set."""
    text = str(error) if isinstance(error, OxbowError) else f"{type(error).__name__}: {error}"
    if DEBUG in os.environ:
        traceback.print_exception(error)
    elif exit_status(error) == _STATUS[ErrorCode.INTERNAL]:
        text += " (a fault of Oxbow's own; oxbow --debug ... shows more)"
    # On one line whatever the text quotes, so that it can be read by `grep` and in logs.
    print("error:", " ".join(text.split()), file=sys.stderr)
