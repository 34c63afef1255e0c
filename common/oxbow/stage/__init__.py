"""The process of a stage: a light session process on the bus, and a worker process that runs the handler.

The `__main__.py` of a service reads ``serve_stage("oxbow.contracts:CONTOUR", "oxbow_contour.service:handle")``.
Endpoint and handler are named, not imported: only the worker process pays for what they bring.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable

from oxbow.bus.config import DEFAULT_ENDPOINT
from oxbow.bus.session import Session
from oxbow.errors import InvalidInput, OxbowError, Unavailable
from oxbow.ids import checked_id
from oxbow.runtime.lifetime import Lifetime
from oxbow.stage.service import Stage
from oxbow.stage.worker import DEFAULT_MEMORY_MB, Worker

__all__ = ["serve_stage"]

MEMORY_VARIABLE = "OXBOW_WORKER_MEMORY_MB"
LEAST_MEMORY_MB = 256
"""What a worker process needs to start."""

_log = logging.getLogger(__name__)


def serve_stage(endpoint: str, handler: str, argv: list[str] | None = None) -> None:
    """Run one replica of a stage until it is asked to end; exits with status 1 where it cannot serve.

    Parameters
    ----------
    endpoint, handler
        As ``package.module:attribute``; the handler is called as ``handle(request, show) -> reply``.
    argv
        The command line; see ``--help``.
    """
    options = _options(handler, argv)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s %(name)s: %(message)s")
    lifetime = Lifetime(options.parent)
    # Before the bus: the worker loads its libraries while the session looks for the router.
    worker = Worker(endpoint, handler, options.instance, options.memory_mb)
    try:
        session = Session.join(options.connect, lambda: lifetime.over)
        if session is not None:
            with session:
                _serve(session, worker, options, lifetime)
    except OxbowError as error:
        _log.error("%s", error)
        sys.exit(1)
    finally:
        worker.close()


def _serve(session: Session, worker: Worker, options: argparse.Namespace, lifetime: Lifetime) -> None:
    stage = Stage(session, worker, options.instance, options.queue, on_failure=lifetime.end)
    lifetime.wait()
    # What was accepted is still answered: only then may the process end.
    stage.drain()
    if stage.failed:
        raise Unavailable("no worker process", where=options.instance)


def _options(handler: str, argv: list[str] | None) -> argparse.Namespace:
    program = handler.partition(".")[0]
    parser = argparse.ArgumentParser(prog=program, description=f"Serve {handler} on the bus.")
    parser.add_argument("--connect", default=DEFAULT_ENDPOINT, help="the router's endpoint (default: %(default)s)")
    parser.add_argument(
        "--instance",
        type=checked_id,
        default=f"pid{os.getpid()}",
        help="this replica's name (default: %(default)s)",
    )
    parser.add_argument(
        "--queue", type=_count(1), default=16, help="requests that may wait (default: %(default)s)"
    )
    parser.add_argument(
        "--memory-mb",
        type=_count(LEAST_MEMORY_MB),
        # As text: argparse then checks it as it does the option, and names what is wrong with the variable.
        default=os.environ.get(MEMORY_VARIABLE, str(DEFAULT_MEMORY_MB)),
        help=f"what the worker process may take, also ${MEMORY_VARIABLE} (default: %(default)s)",
    )
    parser.add_argument("--parent", type=int, help="end when this parent process has ended")
    try:
        return parser.parse_args(argv)
    except InvalidInput as error:
        parser.error(str(error))


def _count(least: int) -> Callable[[str], int]:
    """Reads a whole number from `least` to a million."""

    def count(text: str) -> int:
        # The length first: `int` refuses thousands of digits with an error of its own.
        if not (text.isdecimal() and len(text) <= 7 and least <= int(text) <= 10**6):
            raise argparse.ArgumentTypeError(f"is {text!r}; expected a whole number from {least} to {10**6}")
        return int(text)

    return count
