"""Records what the stages show: ``python -m oxbow_recorder --folder recordings``."""

from __future__ import annotations

import argparse
import logging
import os
import sys
import threading
from pathlib import Path

import platformdirs

from oxbow.bus import DEFAULT_ENDPOINT, Session
from oxbow.codec import decode
from oxbow.contracts import ANY_LAYER, live_key
from oxbow.errors import OxbowError
from oxbow.lifetime import Lifetime
from oxbow.recording import Stamped
from oxbow_recorder.address import address_of
from oxbow_recorder.live import serve
from oxbow_recorder.recordings import Recordings
from oxbow_recorder.vitals import answer_introspection

_log = logging.getLogger("oxbow_recorder")

QUEUE = 4096
"""Layers waiting to be drawn; further ones are dropped: planning never waits for a recording."""

_MOST_LOGGED = 300
"""Characters of a key and of an error that are logged: both may hold what a stranger sent."""


def main(argv: list[str] | None = None) -> None:
    """Record until told to end; every open file is finished then."""
    options = _options(argv)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s %(name)s: %(message)s")
    lifetime = Lifetime(options.parent)
    live = serve(options.live_port) if options.live_port else None
    recordings = Recordings(options.folder, live)
    lock = threading.Lock()

    def record(key: str, payload: bytes) -> None:
        try:
            address_of(key, payload)
            with lock:
                recordings.add(decode(payload, Stamped))
        except (OxbowError, OSError) as error:
            _log.error("a layer on %s is not recorded: %s", key[:_MOST_LOGGED], str(error)[:_MOST_LOGGED])

    session = Session.join(options.connect, lambda: lifetime.over)
    if session is not None:
        with session:
            subscription = session.subscribe(ANY_LAYER, record, queue_size=QUEUE)
            answer_introspection(session, options.instance, recordings.counts)
            session.declare_live(live_key("recorder", options.instance))
            lifetime.wait()
            subscription.close()
    with lock:
        recordings.close()


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="oxbow_recorder", description="Record what the stages show.")
    parser.add_argument("--connect", default=DEFAULT_ENDPOINT, help="the router's endpoint (default: %(default)s)")
    parser.add_argument("--folder", type=Path, default=_default_folder(), help="where recordings are kept")
    parser.add_argument(
        "--live-port", type=int, default=0, help="serve live viewers on this loopback port; 0: none (default)"
    )
    parser.add_argument(
        "--instance", default=f"pid{os.getpid()}", help="the name on the bus (default: %(default)s)"
    )
    parser.add_argument("--parent", type=int, help="end when this parent process has ended")
    return parser.parse_args(argv)


def _default_folder() -> Path:
    home = os.environ.get("OXBOW_HOME")
    return (Path(home) if home else platformdirs.user_state_path("oxbow")) / "recordings"


if __name__ == "__main__":
    main()
