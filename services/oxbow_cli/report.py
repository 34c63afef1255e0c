"""Output of the command: a progress bar on stderr, tables and JSON on stdout."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from oxbow.contracts import Conformance, Leg, Measures, Method, MissionState
from oxbow.geometry.frame import Position
from oxbow_cli.streams import print_utf8

if TYPE_CHECKING:
    from oxbow.mission.plan import PlanRecord
    from oxbow_cli.comparison import Comparison
    from oxbow_cli.evaluation import Evaluation
    from oxbow_cli.planning import PlannedMission, Progress
    from oxbow_cli.status import Process, StackStatus

__all__ = [
    "comparison_document",
    "plan_document",
    "print_comparison",
    "print_evaluation",
    "print_json",
    "print_plan",
    "print_status",
    "progress_bar",
]

MOST_DROPPED = 3

Rows = Iterable[tuple[str, str]]


def _console() -> Console:
    """Stdout, where the name of a site or an error is plain text, whatever it contains."""
    return Console(markup=False, emoji=False, highlight=False)


def print_json(document: Any) -> None:
    """Write a document to stdout as indented JSON."""
    print_utf8(msgspec.json.format(msgspec.json.encode(document, enc_hook=_path_text), indent=2) + b"\n")


def _path_text(path: Path) -> str:
    """A path as text; bytes that are not text are escaped."""
    return os.fspath(path).encode(errors="backslashreplace").decode()


@contextmanager
def progress_bar(shown: bool) -> Iterator[Progress]:
    """A bar on stderr while a mission is planned; none if `shown` is false or stderr is not a terminal."""
    console = Console(stderr=True)
    if not (shown and console.is_terminal):
        yield lambda _stage, _fraction: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415 - 20 ms

    columns = (TextColumn("{task.description:13}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda stage, fraction: bar.update(task, description=stage, completed=fraction)


def plan_document(planned: PlannedMission, file: Path) -> dict[str, Any]:
    """The document that `oxbow plan --json` prints.

    Parameters
    ----------
    planned
        The completed mission.
    file
        Where it was written.

    Returns
    -------
    dict of str to object
        ``file``, ``recording`` (None without one) and ``Plan``, for `print_json`.
    """
    return {"file": file, "recording": planned.recording, "Plan": planned.mission.plan}


def print_plan(planned: PlannedMission, file: Path) -> None:
    """Write a plan's table to stdout, and where its files are: one per line, never wrapped, for copying.

    Parameters
    ----------
    planned
        The completed mission.
    file
        Where it was written.
    """
    plan = planned.mission.plan
    assert plan is not None
    _console().print(_plan_table(planned.mission.site_name or file.name, plan))
    print(f"mission file  {file}")
    if planned.recording is not None:
        print(f"recording     {planned.recording} (oxbow inspect {shlex.quote(str(planned.recording))})")


def _plan_table(site: str, plan: PlanRecord) -> Table:
    """A plan in the measures that matter most to a user."""
    certificate = plan.certificate
    rows = [
        *(() if plan.mission_id is None else [("mission", f"{plan.mission_id}, revision {plan.revision}")]),
        *(_survey_rows(plan) if _surveys(plan) else _treatment_rows(plan)),
        ("length", f"{_length(plan.length_m)} of {_length(plan.max_length_m)} ({_share(plan)})"),
        ("duration", _duration(plan.duration_s)),
        ("waypoints", f"{certificate.waypoints}"),
        *(_quality_rows(certificate) if _surveys(plan) else _reach_rows(plan)),
        # A way home may cross the way out where hot spots are treated between them.
        ("conforms", _conformance(certificate.is_simple if _surveys(plan) else None, certificate, _legs(plan))),
        *(
            ()
            if certificate.danger is None
            else [("danger", f"{certificate.danger:.1%} probability of harm on the way")]
        ),
        *_fleet_rows(plan),
        *(("dropped", text) for text in _dropped(plan)),
        *(("warning", warning) for warning in plan.warnings),
    ]
    return _table(f"Plan of {site}", rows)


def _surveys(plan: PlanRecord) -> bool:
    """Whether the plan's own measures are those of a survey; otherwise, they are a treatment's."""
    return plan.treatment is None or plan.slave_certificate is not None


def _survey_rows(plan: PlanRecord) -> Rows:
    yield "method", f"{plan.method}, seed {plan.seed}"
    if plan.method is Method.TRANSECT:
        # Directions of transects are lines, not arrows: a heading and its opposite are one.
        several = "each share its own"
        yield "heading", several if plan.heading_deg is None else f"{plan.heading_deg % 180:.1f} deg"
    yield "spacing", f"{plan.spacing_m:.1f} m"


def _treatment_rows(plan: PlanRecord) -> Rows:
    yield "method", f"passes over hot spots, seed {plan.seed}"
    yield "swath", f"{plan.spacing_m:.1f} m"


def _quality_rows(found: Measures) -> Rows:
    low_m, high_m = found.cover_radius_m
    yield "water", f"{found.free_area_m2 / 1e6:.3f} km2, {found.judged_area:.1%} in parts that it enters"
    yield (
        "farthest water",
        f"{low_m:.1f} to {high_m:.1f} m from the path; least possible {found.least_radius_m:.1f} m",
    )
    yield "q", f"{found.q:.2f} (farthest / least possible); {found.p95_ratio:.2f} for 95 % of the water"


def _reach_rows(plan: PlanRecord) -> Rows:
    """How far from the passes the hot spots reach; the least radius of a path is no yardstick for that."""
    low_m, high_m = plan.certificate.cover_radius_m
    text = f"{low_m:.1f} to {high_m:.1f} m from a pass; half a swath is {plan.spacing_m / 2:.1f} m"
    yield "farthest treated", text


def _fleet_rows(plan: PlanRecord) -> Rows:
    """A row for each vehicle, then for each hot spot, further sortie, and hot spot left."""
    for vehicle in () if plan.fleet is None else plan.fleet.vehicles:
        way = f"{_length(vehicle.length_m)} of {_length(vehicle.max_length_m)}, {_duration(vehicle.duration_s)}"
        task = f"treats {', '.join(vehicle.hot_spots)}" if vehicle.hot_spots else "surveys"
        if not vehicle.hot_spots and vehicle.area_m2 is not None:
            task += f" {vehicle.area_m2 / 1e6:.3f} km2"
        danger = vehicle.certificate.danger
        risk = "" if danger is None else f"; danger {danger:.1%}"
        ashore_m, unsafe_m = _lengths(vehicle.certificate.legs)
        legs = f"; legs {ashore_m:.2f} m over land, {unsafe_m:.0f} m within Safety" if unsafe_m else ""
        yield vehicle.name, f"{vehicle.role}: {way}; {task}{risk}{legs}"
    if plan.treatment is None:
        return
    for spot in plan.treatment.hot_spots:
        yield spot.hot_spot, f"value {spot.value:g}, {spot.treated_share:.1%} treated"
    for sortie in plan.treatment.further:
        yield "further sortie", f"{sortie.vehicle}: {', '.join(sortie.hot_spots)}, {_length(sortie.length_m)}"
    for left in plan.treatment.left:
        yield "left", f"{left.hot_spot}: {left.reason}"


def print_evaluation(site: str, found: Evaluation) -> None:
    """Write every measure of an evaluation to stdout, under its name.

    Parameters
    ----------
    site
        The title of the table: the site or the file.
    found
        The evaluation.
    """
    rows = ((name, _figure(value)) for name, value in msgspec.structs.asdict(found).items())
    console = _console()
    console.print(_table(f"Evaluation of {site}", rows))
    # A single path has its measures in the table above already.
    for vehicle in found.vehicles if len(found.vehicles) > 1 else ():
        rows = ((name, _figure(value)) for name, value in msgspec.structs.asdict(vehicle).items())
        console.print(_table(f"Path of {vehicle.name}", rows))


def comparison_document(files: tuple[Path, Path], found: Comparison) -> dict[str, Any]:
    """The document that `oxbow evaluate --compare --json` prints.

    Parameters
    ----------
    files
        The two files.
    found
        Their comparison, in the same order.

    Returns
    -------
    dict of str to object
        ``files``, and the fields of the comparison, for `print_json`.
    """
    return {"files": files} | msgspec.structs.asdict(found)


def print_comparison(files: tuple[Path, Path], found: Comparison) -> None:
    """Write two evaluations side by side to stdout, the better value marked, and by which measures each is better.

    Parameters
    ----------
    files
        The two files.
    found
        Their comparison, in the same order.
    """
    table = _grid("Comparison; * is better, by more than 1 %", left=("measure",), right=())
    for file in files:
        table.add_column(str(file), justify="right", overflow="fold")
    for name in found.first.__struct_fields__:
        ours, theirs = (_figure(getattr(one, name)) for one in (found.first, found.second))
        table.add_row(
            name, _marked(ours, name in found.first_better), _marked(theirs, name in found.second_better)
        )
    console = _console()
    console.print(table)
    for difference in found.differences:
        console.print(f"warning: not the same mission: {difference}", soft_wrap=True)
    if found.differences:
        console.print("Only what does not depend on the mission is compared.")
    sides = (found.first_better, found.first_breaks), (found.second_better, found.second_breaks)
    for file, (better, breaks) in zip(files, sides, strict=True):
        console.print(f"{file}: {'; '.join(breaks) or 'keeps every rule'}", soft_wrap=True)
        console.print(f"    better at {', '.join(better) or 'nothing'}", soft_wrap=True)


def _marked(text: str, is_better: bool) -> Text:
    return Text(f"* {text}", style="bold") if is_better else Text(text)


def print_status(found: StackStatus) -> None:
    """Write a stack's processes and missions to stdout."""
    processes = _grid(f"Processes on {found.endpoint}", left=("service", "instance"), right=_PROCESS_FIGURES)
    for process in found.processes:
        processes.add_row(process.service, process.instance, *_process_cells(process))
    for service in found.missing:
        processes.add_row(service, "none")
    troubled = _grid("Started again", left=("process", "trouble now"), right=("starts", "pid"))
    for each in found.supervised:
        # Every process has been started once; more than that is worth a row.
        if each.trouble or each.starts > 1:
            troubled.add_row(each.name, each.trouble, str(each.starts), str(each.pid))
    missions = _grid("Missions", left=("mission", "state", "at work", "error"), right=("revision", "done"))
    for mission in found.missions:
        error = f"{mission.error.where}: {mission.error.message}" if mission.error else ""
        done = 1.0 if mission.state is MissionState.DONE else mission.fraction
        missions.add_row(
            mission.mission_id, mission.state.value, mission.stage, error, str(mission.revision), f"{done:.0%}"
        )
    _console().print(processes, *([troubled] if troubled.row_count else []), missions)


_PROCESS_FIGURES = ("up", "served", "failed", "queued", "mean", "p95", "MiB")


def _process_cells(process: Process) -> tuple[str, ...]:
    ping, stats = process.ping, process.stats
    if ping is None or stats is None:
        return ("silent",)
    counts = map(str, (stats.served, stats.failed, stats.queued))
    # A process that has served nothing yet has no mean: a dash, not 0 s.
    seconds = (f"{stats.mean_s:.2f} s", f"{stats.p95_s:.2f} s") if stats.served else ("-", "-")
    memory = f"{(stats.session_rss_bytes + stats.worker_rss_bytes) / 2**20:.0f}"
    return (f"{ping.uptime_s:.0f} s", *counts, *seconds, memory)


def _grid(title: str, left: tuple[str, ...], right: tuple[str, ...]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE, padding=(0, 1, 0, 0))
    for number, name in enumerate(left):
        table.add_column(name, overflow="fold", no_wrap=number == 0)
    for name in right:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _table(title: str, rows: Rows) -> Table:
    table = Table(title=title, show_header=False, title_justify="left", title_style="bold")
    table.add_column(style="cyan", no_wrap=True)
    table.add_column(overflow="fold")
    for name, text in rows:
        table.add_row(name, text)
    return table


def _conformance(is_simple: bool | None, found: Conformance, own_legs: Sequence[Leg]) -> str:
    """Whether the rules are kept, and what legs need; `is_simple` is None if a path may cross itself."""
    simple = {None: "", True: "never crosses itself; ", False: "CROSSES ITSELF; "}[is_simple]
    ashore_m, unsafe_m = _lengths(own_legs)
    legs = f"; on its legs {ashore_m:.2f} m over land, {unsafe_m:.0f} m within Safety" if unsafe_m else ""
    # What legs need over land is part of all that lies outside: it is reported by itself.
    outside_m = max(found.outside_m - ashore_m, 0.0)
    return f"{simple}{outside_m:.2f} m outside, {found.unsafe_m:.2f} m within Safety{legs}"


def _legs(plan: PlanRecord) -> tuple[Leg, ...]:
    """The legs of all paths that the plan's own certificate is about."""
    if plan.fleet is None:
        return plan.certificate.legs
    # That of several paths has no legs: each vehicle has its own. Those that it is about come first.
    vehicles = plan.fleet.vehicles
    own = (vehicle for vehicle in vehicles if vehicle.role is vehicles[0].role)
    return tuple(leg for vehicle in own for leg in vehicle.certificate.legs)


def _lengths(legs: Sequence[Leg]) -> tuple[float, float]:
    """Metres of legs over land, and metres nearer to the shore than Safety."""
    return sum(leg.ashore_m for leg in legs), sum(leg.unsafe_m for leg in legs)


def _dropped(plan: PlanRecord) -> Iterator[str]:
    """The largest parts of the water that the plan leaves out; the file lists all."""
    parts = sorted(plan.dropped, key=lambda part: -part.area_m2)
    for part in parts[:MOST_DROPPED]:
        yield f"{part.area_m2:.0f} m2 at {_place(part.place)}: {part.reason}"
    if rest := parts[MOST_DROPPED:]:
        yield f"{sum(part.area_m2 for part in rest):.0f} m2 in {len(rest)} smaller parts"


def _share(plan: PlanRecord) -> str:
    return f"{plan.length_m / plan.max_length_m:.1%}"


def _length(length_m: float) -> str:
    return f"{length_m / 1000:.2f} km"


def _duration(duration_s: float) -> str:
    hours, minutes = divmod(round(duration_s / 60), 60)
    return f"{hours} h {minutes:02d} min"


def _place(place: Position) -> str:
    return f"{place.lat:.6f}, {place.long:.6f}"


def _figure(value: Any) -> str:
    """A measure as text: six digits, bounds with two dots between them, a dash for None."""
    if value is None:
        return "-"
    if isinstance(value, Position):
        return _place(value)
    if isinstance(value, tuple) and all(isinstance(each, msgspec.Struct) for each in value):
        return str(len(value))
    if isinstance(value, tuple):
        return " .. ".join(map(_figure, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
