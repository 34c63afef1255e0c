"""Measure Oxbow: ``python -m tests.bench [SECTION ...]``, all sections where none is named.

Prints a table for each, and keeps the figures in `out/bench.json`. A goal that is missed is said, and is no
failure: how fast a machine is, is no property of the project.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator

from rich.console import Console

from tests.bench import assignment, meshes, quality, routes, stack, stages
from tests.bench.results import Section, keep, show
from tests.support.project import ROOT

SECTIONS: dict[str, Callable[[], Iterator[Section]]] = {
    "stages": stages.measure,
    "quality": quality.measure,
    "assignment": assignment.measure,
    "routes": routes.measure,
    "meshes": meshes.measure,
    "bus": stack.measure_bus,
    "start": stack.measure_start,
    "connect": stack.measure_connect,
    "load": stack.measure_load,
    "memory": stack.measure_memory,
}
RESULTS = ROOT / "out" / "bench.json"


def main() -> None:
    """Run the sections that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description="Measure Oxbow.")
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=", ".join(SECTIONS))
    names = parser.parse_args().sections or list(SECTIONS)
    if unknown := set(names) - set(SECTIONS):
        parser.error(f"no section {', '.join(sorted(unknown))}; expected some of {', '.join(SECTIONS)}")
    console = Console(width=None if Console().is_terminal else 170)
    for name in names:
        started = time.monotonic()
        tables = []
        for table in SECTIONS[name]():
            show(table, console)
            tables.append(table)
        keep({name: tables}, RESULTS)
        console.print(f"[dim]{name}: {time.monotonic() - started:.0f} s; kept in {RESULTS}[/dim]\n")


if __name__ == "__main__":
    main()
