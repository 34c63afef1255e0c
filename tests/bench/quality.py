"""How good the plans are, by the project's own certificate: its examples, and real lakes where there are some."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from oxbow.contracts import CERTIFY, CONTOUR, DECOMPOSE, PATH, Method, Role
from oxbow.errors import OxbowError
from oxbow.mission.file import PlanOptions, read_mission
from oxbow.planning.pipeline import plan_mission
from oxbow_cli.evaluation import evaluate
from oxbow_cli.local import local_call
from tests.bench.bounded import Bounded
from tests.bench.results import Figure, Goal, Section, middle
from tests.bench.stages import TimedCall
from tests.support.project import ROOT

__all__ = ["measure"]

EXAMPLES = ROOT / "docs" / "examples"
REAL_LAKES = ROOT.parent / "shared" / "data" / "missions"
LIMIT_S = 60.0

PARTS = tuple(endpoint.stage for endpoint in (CONTOUR, DECOMPOSE, PATH, CERTIFY))
"""The stages of a mission for one vehicle: their seconds are columns too."""

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
    *PARTS,
    "seconds",
)


@dataclass(frozen=True)
class Bars:
    """What a method's plans of real lakes are to reach: on every lake, and in the middle of all."""

    worst_q: float
    median_q: float
    worst_p95: float
    median_p95: float
    worst_s: float
    median_s: float | None = None


BARS = {
    Method.SPACE_FILLING_CURVE: Bars(2.2, 1.45, 1.25, 1.08, worst_s=40.0, median_s=10.0),
    Method.TRANSECT: Bars(2.4, 1.6, 1.5, 1.15, worst_s=25.0, median_s=6.0),
    Method.TOUR: Bars(3.0, 1.8, 1.6, 1.25, worst_s=60.0),
}


def measure() -> Iterator[Section]:
    """A table of the examples, and one of the real lakes for every method, with its goals."""
    with Bounded() as bounded:
        yield Section("Quality: the project's examples", _rows(bounded, EXAMPLES, Method.SPACE_FILLING_CURVE))
        if REAL_LAKES.is_dir():
            for method in Method:
                rows = _rows(bounded, REAL_LAKES, method)
                goals = [*_rules(rows), *(_goals(rows, BARS[method]) if method in BARS else ())]
                yield Section(f"Quality: real lakes, {method}", rows, goals)


def _rows(bounded: Bounded, folder: Path, method: Method) -> list[dict[str, Figure]]:
    files = sorted(folder.glob("*.json"))
    return [_row(bounded, file, method) for file in files if _is_survey(file)]


def _is_survey(file: Path) -> bool:
    """Whether a mission is to cover all of the water: of passes over hot spots alone, q would tell nothing."""
    return Role.MASTER in read_mission(file).mission_type.roles


def _row(bounded: Bounded, file: Path, method: Method) -> dict[str, Figure]:
    try:
        return {"mission": file.stem, **bounded.run(LIMIT_S, _judged, file, method)}
    except (OxbowError, TimeoutError) as error:
        return {"mission": f"{file.stem}: {error}", **dict.fromkeys(COLUMNS, "")}


def _judged(file: Path, method: Method) -> dict[str, Figure]:
    mission = read_mission(file)
    call = TimedCall(local_call())
    started = time.perf_counter()
    planned = plan_mission(mission, PlanOptions(method=method), call=call)
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
        *(call.seconds.get(stage, 0.0) for stage in PARTS),
        seconds,
    )
    return dict(zip(COLUMNS, figures, strict=True))


def _column(rows: Sequence[dict[str, Figure]], name: str) -> list[float]:
    return [figure for row in rows if not isinstance(figure := row[name], str)]


def _rules(rows: Sequence[dict[str, Figure]]) -> list[Goal]:
    """What every plan keeps to, whatever the method."""
    return [
        Goal("missions planned", len(_column(rows, "q")), at_least=len(rows)),
        Goal("least is_simple", min(_column(rows, "simple")), at_least=1),
        Goal("most outside", max(_column(rows, "outside m")), " m", at_most=0.01),
        Goal("most unsafe", max(_column(rows, "unsafe m")), " m", at_most=0.01),
        Goal("farthest end", max(_column(rows, "ends m")), " m", at_most=1.0),
        Goal("least length ratio", min(_column(rows, "length")), at_least=0.95),
        Goal("most length ratio", max(_column(rows, "length")), at_most=1.0),
        Goal("least judged area", min(_column(rows, "judged")), at_least=0.99),
    ]


def _goals(rows: Sequence[dict[str, Figure]], bars: Bars) -> Iterator[Goal]:
    """How good, and how fast."""
    yield Goal("worst q", max(_column(rows, "q")), at_most=bars.worst_q)
    yield Goal("median q", middle(rows, "q"), at_most=bars.median_q)
    yield Goal("worst p95 ratio", max(_column(rows, "p95")), at_most=bars.worst_p95)
    yield Goal("median p95 ratio", middle(rows, "p95"), at_most=bars.median_p95)
    yield Goal("longest planning time", max(_column(rows, "seconds")), " s", at_most=bars.worst_s)
    if bars.median_s is not None:
        yield Goal("median planning time", middle(rows, "seconds"), " s", at_most=bars.median_s)
