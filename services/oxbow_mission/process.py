"""A helper process of the mission service: it reads what came from outside, and may hang or die of it.

``python -m oxbow_mission.process FD MEMORY_MB HANDLER``, started by `oxbow_mission.helper`.
"""

from __future__ import annotations

import importlib
import logging
import sys
from multiprocessing.connection import Connection

from oxbow.errors import ErrorReply, Internal, OxbowError, error_text
from oxbow.stage.jobs import is_memory_error
from oxbow.stage.process import guard
from oxbow.stage.worker import needs_memory
from oxbow_mission.peer import Handler, HungUp, Peer
from oxbow_mission.wire import STAGE, Answer, FromHelper, HelperFailed, Ready, ToHelper

_log = logging.getLogger(__name__)


def main(argv: list[str]) -> None:
    """Carry out what is ordered until the mission service closes the pipe or dies."""
    fd, memory_mb, handler_name = argv
    guard(int(fd), int(memory_mb))
    module, _, attribute = handler_name.partition(":")
    handler: Handler = getattr(importlib.import_module(module), attribute)
    peer = Peer(Connection(int(fd)))
    try:
        peer.send(Ready())
        while True:
            order = peer.receive()
            if not isinstance(order, Answer):
                peer.send(_outcome(order, handler, peer, int(memory_mb)))
    except HungUp:
        return


def _outcome(order: ToHelper, handler: Handler, peer: Peer, memory_mb: int) -> FromHelper:
    """Carry out an order: the adapter at which whatever is raised becomes an error."""
    try:
        return handler(order, peer)
    except HungUp:
        raise
    except OxbowError as error:
        return HelperFailed(error=ErrorReply.of(error))
    except BaseException as error:  # noqa: BLE001 - becomes an `internal` error
        if is_memory_error(error):
            return HelperFailed(error=ErrorReply.of(needs_memory(memory_mb, STAGE)))
        _log.exception("%s failed", type(order).__name__)
        return HelperFailed(error=ErrorReply.of(Internal(error_text(error), where=STAGE)))


if __name__ == "__main__":
    main(sys.argv[1:])
