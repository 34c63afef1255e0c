"""Records what the stages show: ``python -m oxbow_recorder --folder recordings``."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import platformdirs

from oxbow.bus import DEFAULT_ENDPOINT, Session
from oxbow.contracts import ANY_LAYER, live_key
from oxbow.errors import InvalidRequest
from oxbow.runtime.lifetime import Lifetime
from oxbow_recorder.files import sweep
from oxbow_recorder.live import LiveServer
from oxbow_recorder.runs import Runs
from oxbow_recorder.vitals import answer_introspection

_log = logging.getLogger("oxbow_recorder")

QUEUE = 4096
"""Layers waiting to be looked at, which takes microseconds."""

_MOST_LOGGED = 300
"""Characters of a key and of an error that are logged: both may hold what a stranger sent."""


def main(argv: list[str] | None = None) -> None:
    """Record until asked to end; every open file is finished then."""
    options = _options(argv)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s %(name)s: %(message)s")
    lifetime = Lifetime(options.parent)
    # Parts that another recorder is writing now are younger than what is swept.
    sweep(options.folder)
    with ExitStack() as held:
        live = held.enter_context(LiveServer(options.live_port)) if options.live_port else None
        # Entered before the session, and so left after it: no layer comes to files that are being finished.
        runs = held.enter_context(Runs(options.folder, live.address if live else None))
        session = Session.join(options.connect, lambda: lifetime.over)
        if session is not None:
            held.enter_context(session)
            session.subscribe(ANY_LAYER, partial(_record, runs), queue_size=QUEUE)
            answer_introspection(session, options.instance, runs.counts)
            session.declare_live(live_key("recorder", options.instance))
            lifetime.wait(partial(_tick, runs, live))


def _record(runs: Runs, key: str, payload: bytes) -> None:
    try:
        runs.take(key, payload)
    except InvalidRequest as error:
        _log.warning("a layer on %s is not recorded: %s", key[:_MOST_LOGGED], str(error)[:_MOST_LOGGED])


def _tick(runs: Runs, live: LiveServer | None) -> None:
    try:
        runs.tick()
        if live is not None:
            live.revive()
    except Exception:  # noqa: BLE001 - whatever it was, other runs are still recorded
        _log.exception("something that was due is not done")


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
