"""The process of a stage: a light session process on the bus, and a worker process that runs the handler.

The `__main__.py` of a service reads ``serve_stage("oxbow.contracts:CONTOUR", "oxbow_contour.service:handle")``.
Endpoint and handler are named, not imported: only the worker process pays for what they bring.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys

from oxbow.bus.config import DEFAULT_ENDPOINT
from oxbow.bus.session import Session
from oxbow.errors import OxbowError, Unavailable
from oxbow.lifetime import Lifetime
from oxbow.stage.service import Stage
from oxbow.stage.worker import Worker

__all__ = ["serve_stage"]

_log = logging.getLogger(__name__)


def serve_stage(endpoint: str, handler: str, argv: list[str] | None = None) -> None:
    """Run one replica of a stage until it is told to end; exits with status 1 where it cannot serve.

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
    worker = Worker(endpoint, handler, options.instance)
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
    stage.drain()
    if stage.failed:
        raise Unavailable("no worker process", where=options.instance)


def _options(handler: str, argv: list[str] | None) -> argparse.Namespace:
    program = handler.partition(".")[0]
    parser = argparse.ArgumentParser(prog=program, description=f"Serve {handler} on the bus.")
    parser.add_argument("--connect", default=DEFAULT_ENDPOINT, help="the router's endpoint (default: %(default)s)")
    parser.add_argument(
        "--instance", default=f"pid{os.getpid()}", help="this replica's name (default: %(default)s)"
    )
    parser.add_argument("--queue", type=int, default=16, help="requests that may wait (default: %(default)s)")
    parser.add_argument("--parent", type=int, help="end when this parent process has ended")
    return parser.parse_args(argv)
