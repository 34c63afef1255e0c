"""A process that writes recordings: the only one that imports rerun, which keeps memory and threads of each.

``python -m oxbow_recorder.process FD FOLDER [VIEWERS]``, started by `oxbow_recorder.writer`.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec

from oxbow.runtime.lifetime import wake_with_parents_death
from oxbow.wire.codec import decode
from oxbow.wire.recording import Stamped
from oxbow_recorder.recordings import Recordings
from oxbow_recorder.wire import Finish, ToWriter

__all__ = ["main"]

_DONE = b""
_log = logging.getLogger("oxbow_recorder")


def main(argv: list[str]) -> None:
    """Draw what comes through the pipe, and say so; when it is closed, or the recorder gone, finish every file."""
    fd, folder, *viewers = argv
    # Signals to the process group are the recorder's business, which closes the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    wake_with_parents_death()
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s %(name)s: %(message)s")
    recordings = Recordings(Path(folder), *viewers)
    try:
        with Connection(int(fd)) as pipe:
            while True:
                _follow(msgspec.msgpack.decode(pipe.recv_bytes(), type=ToWriter), recordings)
                # Also after a failure, which has been logged: the recorder counts what waits by these answers.
                pipe.send_bytes(_DONE)
    except (EOFError, OSError):
        recordings.close()
    os._exit(0)  # rerun might wait forever for files that could not be written


def _follow(order: ToWriter, recordings: Recordings) -> None:
    """Draw or finish: the adapter at which the failure of a layer or a recording ends; others go on."""
    try:
        if isinstance(order, Finish):
            recordings.finish(order.run)
        else:
            recordings.add(order.run, decode(order.payload, Stamped))
    except Exception as error:  # noqa: BLE001 - rerun raises any
        _log.error("mission %s: a layer is not recorded: %s", order.run.mission_id, str(error)[:300])


if __name__ == "__main__":
    main(sys.argv[1:])
