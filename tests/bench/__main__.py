"""Measure Oxbow: ``python -m tests.bench [SECTION ...]``, all sections where none is named.

``python -m tests.bench against REVISION`` compares with another revision.

Prints a table for each, and keeps the figures in `out/bench.json`. A goal that is missed is said, and is no
failure: how fast a machine is, is no property of the project.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from functools import partial

from rich.console import Console

from tests.bench import against, assignment, meshes, quality, routes, stack, stages
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
    console = Console(width=None if Console().is_terminal else 170)
    for name, measure in _asked().items():
        started = time.monotonic()
        tables = []
        for table in measure():
            show(table, console)
            tables.append(table)
        keep({name: tables}, RESULTS)
        console.print(f"[dim]{name}: {time.monotonic() - started:.0f} s; kept in {RESULTS}[/dim]\n")


def _asked() -> dict[str, Callable[[], Iterator[Section]]]:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description="Measure Oxbow.")
    parser.add_argument(
        "sections", nargs="*", metavar="SECTION", help=f"{', '.join(SECTIONS)}; or: against REVISION"
    )
    names = parser.parse_args().sections or list(SECTIONS)
    if names[0] == "against" and len(names) == 2:
        return {f"against {names[1]}": partial(against.measure_against, names[1])}
    if unknown := set(names) - set(SECTIONS):
        parser.error(f"no section {', '.join(sorted(unknown))}; expected some of {', '.join(SECTIONS)}")
    return {name: SECTIONS[name] for name in names}


if __name__ == "__main__":
    main()
