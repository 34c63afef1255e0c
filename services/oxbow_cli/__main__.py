"""The `oxbow` command."""

from __future__ import annotations

import sys

from oxbow_cli.interrupts import ending
from oxbow_cli.streams import tolerate_any_text

__all__ = ["main"]


def main() -> None:
    """Run the command; ends the process with its exit status."""
    ending.begin()  # before anything that takes time, imports included
    # Before any output: a mission's name may hold characters that the terminal's encoding lacks.
    tolerate_any_text()
    from oxbow_cli.app import app  # noqa: PLC0415 - as above
    from oxbow_cli.exits import exit_status, explain  # noqa: PLC0415

    try:
        app(prog_name="oxbow")
    except Exception as error:  # noqa: BLE001 - the outermost frame: no traceback but with --debug
        if ending.status is not None:  # unwinding may have raised an error of its own
            sys.exit(ending.status)
        explain(error)
        sys.exit(exit_status(error))


if __name__ == "__main__":
    main()
