"""Serves missions on the bus."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from pathlib import Path

import platformdirs

from oxbow.bus import DEFAULT_ENDPOINT
from oxbow.bus.client import Bus
from oxbow.errors import Internal, OxbowError, Unavailable
from oxbow.runtime.lifetime import Lifetime
from oxbow_mission.checks import Checks
from oxbow_mission.database import Database
from oxbow_mission.planner import Planner
from oxbow_mission.registry import Registry
from oxbow_mission.reports import Reports
from oxbow_mission.schema import SCHEMA
from oxbow_mission.service import MissionService
from oxbow_mission.store import Store
from oxbow_mission.vitals import Vitals

_log = logging.getLogger("oxbow_mission")


def main(argv: list[str] | None = None) -> None:
    """Serve until asked to end; exits with status 4 where the store cannot be had, 1 where it fails."""
    options = _options(argv)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s %(name)s: %(message)s")
    lifetime = Lifetime(options.parent)
    try:
        with Database(options.home, SCHEMA, on_lost=lifetime.end) as database:
            # The store comes first: a mission that cannot be kept must not be taken in.
            store = Store(database)
            bus = Bus.join(options.connect, lambda: lifetime.over)
            if bus is not None:
                with bus, Registry(store, bus, max(1, options.workers // 2)) as registry:
                    _serve(bus, registry, options, lifetime)
            database.require_intact()
    except OxbowError as error:
        _log.error("%s", error)
        sys.exit(4 if isinstance(error, Unavailable) else 1)


def _serve(bus: Bus, registry: Registry, options: argparse.Namespace, lifetime: Lifetime) -> None:
    vitals = Vitals(bus, options.instance, registry.store.waiting)
    reports = Reports(registry.store.database, registry.store)
    with (
        Planner(registry, bus, vitals, options.workers, options.memory_mb, lifetime.end) as planner,
        Checks(options.memory_mb) as checks,
        MissionService(bus, registry, reports, checks, options.instance),
    ):
        _log.info("serves missions kept in %s", options.home)
        lifetime.wait()
    if planner.failed:
        raise Internal("missions could not be kept; see the log", where=str(options.home))


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="oxbow_mission", description="Serve missions on the bus.")
    parser.add_argument("--connect", default=DEFAULT_ENDPOINT, help="the router's endpoint (default: %(default)s)")
    parser.add_argument(
        "--home", type=Path, default=_default_home(), help="where missions are kept (default: %(default)s)"
    )
    parser.add_argument(
        "--workers",
        type=int,
        default=8,
        help="missions planned at the same time, at most half of them one client's (default: %(default)s)",
    )
    parser.add_argument(
        "--memory-mb", type=int, default=4096, help="what a helper process may take (default: %(default)s)"
    )
    parser.add_argument(
        "--instance", default=f"pid{os.getpid()}", help="the name on the bus (default: %(default)s)"
    )
    parser.add_argument("--parent", type=int, help="end when this parent process has ended")
    options = parser.parse_args(argv)
    if options.workers < 1:
        parser.error(f"--workers is {options.workers}; expected 1 or more")
    return options


def _default_home() -> Path:
    return Path(os.environ.get("OXBOW_HOME") or platformdirs.user_state_path("oxbow"))


if __name__ == "__main__":
    main()
