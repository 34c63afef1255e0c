"""The `oxbow` command."""

from __future__ import annotations

import signal
import sys
from types import FrameType

from oxbow_cli.app import app
from oxbow_cli.exits import INTERRUPTED, exit_status, explain

__all__ = ["main"]


def main() -> None:
    """Run the command; ends the process with its exit status."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup leaves it
            signal.signal(number, _terminate)
    try:
        app(prog_name="oxbow")
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except Exception as error:  # noqa: BLE001 - the outermost frame: no traceback but with --debug
        explain(error)
        sys.exit(exit_status(error))


def _terminate(number: int, _frame: FrameType | None) -> None:
    """Leave through every `with`, as Ctrl-C does, so that the processes started are stopped."""
    sys.exit(128 + number)


if __name__ == "__main__":
    main()
