"""How good the plans are, by the project's own certificate: its examples, and real lakes where there are some."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from bounded import Bounded
from results import Figure, Goal, Section, middle

from oxbow.errors import OxbowError
from oxbow.mission import read_mission
from oxbow.pipeline import plan_mission
from oxbow_cli.evaluation import evaluate
from oxbow_cli.local import local_call

__all__ = ["measure"]

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "examples"
REAL_LAKES = ROOT.parent / "shared" / "data" / "missions"
LIMIT_S = 60.0
COLUMNS = (
    "islands",
    "simple",
    "outside m",
    "unsafe m",
    "ends m",
    "length",
    "judged",
    "q",
    "mean",
    "p95",
    "seconds",
)


def measure() -> Iterator[Section]:
    """A table of the examples, and one of the real lakes, with its goals."""
    with Bounded() as bounded:
        yield Section("Quality: the project's examples", _rows(bounded, EXAMPLES))
        if REAL_LAKES.is_dir():
            rows = _rows(bounded, REAL_LAKES)
            yield Section("Quality: real lakes", rows, _goals(rows))


def _rows(bounded: Bounded, folder: Path) -> list[dict[str, Figure]]:
    return [_row(bounded, file) for file in sorted(folder.glob("*.json"))]


def _row(bounded: Bounded, file: Path) -> dict[str, Figure]:
    try:
        return {"mission": file.stem, **bounded.run(LIMIT_S, _judged, file)}
    except (OxbowError, TimeoutError) as error:
        return {"mission": f"{file.stem}: {error}", **dict.fromkeys(COLUMNS, "")}


def _judged(file: Path) -> dict[str, Figure]:
    mission = read_mission(file)
    call = local_call()
    started = time.perf_counter()
    planned = plan_mission(mission, call=call)
    seconds = time.perf_counter() - started
    found = evaluate(planned)
    figures = (
        len(mission.forbidden_zones),
        int(found.is_simple),
        found.outside_m,
        found.unsafe_m,
        max(found.starts_at_launch_m, found.ends_at_recovery_m),
        found.length_ratio,
        found.judged_area,
        found.q,
        found.mean_ratio,
        found.p95_ratio,
        seconds,
    )
    return dict(zip(COLUMNS, figures, strict=True))


def _goals(rows: Sequence[dict[str, Figure]]) -> list[Goal]:
    def column(name: str) -> list[float]:
        return [figure for row in rows if not isinstance(figure := row[name], str)]

    return [
        Goal("missions planned", len(column("q")), at_least=len(rows)),
        Goal("least is_simple", min(column("simple")), at_least=1),
        Goal("most outside", max(column("outside m")), " m", at_most=0.01),
        Goal("most unsafe", max(column("unsafe m")), " m", at_most=0.01),
        Goal("farthest end", max(column("ends m")), " m", at_most=1.0),
        Goal("least length ratio", min(column("length")), at_least=0.95),
        Goal("most length ratio", max(column("length")), at_most=1.0),
        Goal("least judged area", min(column("judged")), at_least=0.99),
        Goal("worst q", max(column("q")), at_most=3.0),
        Goal("median q", middle(rows, "q"), at_most=2.0),
        Goal("worst p95 ratio", max(column("p95")), at_most=1.6),
        Goal("median p95 ratio", middle(rows, "p95"), at_most=1.2),
        Goal("longest planning time", max(column("seconds")), " s", at_most=10.0),
        Goal("median planning time", middle(rows, "seconds"), " s", at_most=3.0),
    ]
