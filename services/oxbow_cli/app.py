"""The commands, their options and their help.

Each command imports what it needs when it runs, so that `--help`, and a client of a running stack, do not pay for
importing the algorithms.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from oxbow.bus import DEFAULT_ENDPOINT
from oxbow_cli.exits import DEBUG
from oxbow_cli.interrupts import ending

__all__ = ["app"]

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)

MissionFile = Annotated[Path, typer.Argument(metavar="FILE", help="The Mission File.", show_default=False)]
Home = Annotated[
    Path | None,
    typer.Option(
        envvar="OXBOW_HOME", help="Where missions and recordings are kept; by default the user's state folder."
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print("oxbow", version("oxbow"))
        raise typer.Exit


@app.callback()
def oxbow(
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks and the services' logs.")] = False,
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Plan coverage missions for survey boats.

    Exit status: 0 done, 2 invalid input, 3 infeasible, 4 unavailable or timed out, 1 a fault of Oxbow's own.
    """
    if debug:
        os.environ[DEBUG] = "1"


@app.command()
def plan(
    file: MissionFile,
    method: Annotated[
        str, typer.Option(help="SpaceFillingCurve, Tour, Transect or Watershed.")
    ] = "SpaceFillingCurve",
    prior: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Where sampling matters more: GeoJSON or a raster, instead of FILE's PriorModel."
        ),
    ] = None,
    connect: Annotated[
        str | None, typer.Option(metavar="ENDPOINT", help="Plan on the stack that listens there.")
    ] = None,
    local: Annotated[bool, typer.Option("--local", help="Plan in this process, without a bus.")] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Where to write the completed Mission File, instead of FILE itself."),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE.rrd", help="Where to write the recording, instead of under --home."),
    ] = None,
    heading: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Heading of the transects, clockwise from north; by default the best one."
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of everything random; the same seed gives the same plan.")
    ] = 0,
    time_limit: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            help="Improve the path for at most this many seconds, instead of a fixed amount of work.",
        ),
    ] = None,
    smooth: Annotated[bool, typer.Option("--smooth", help="Round the path's corners.")] = False,
    draw: Annotated[
        str, typer.Option(help="How SpaceFillingCurve draws its inputs: low-discrepancy or convex-combination.")
    ] = "low-discrepancy",
    router: Annotated[
        str,
        typer.Option(
            help="How slaves' ways between hot spots are found: visibility (the shortest), funnel (the quickest to"
            " plan), tessellation, or incenters (well off the shore)."
        ),
    ] = "visibility",
    timeout: Annotated[
        float, typer.Option(metavar="S", help="Give up after this many seconds; at most a day.")
    ] = 300.0,
    home: Home = None,
    json: AsJson = False,
) -> None:
    """Plan the path of a Mission File, and complete the file.

    Without `--connect` or `--local`, a router and the services are started for this one plan, as separate
    processes on a free port, and then stopped. The file is replaced in one step; on any failure it stays as it
    was.

    Examples:

    - `oxbow plan lake.json`: plan, complete the file, keep a recording
    - `oxbow plan lake.json -o planned.json --heading 45`
    - `oxbow plan lake.json --connect tcp/127.0.0.1:7447`: on a stack that `oxbow up` keeps running
    - `oxbow plan lake.json --prior blooms.geojson --time-limit 10`
    """
    from oxbow.mission.file import mission_json
    from oxbow_cli import report
    from oxbow_cli.arguments import (
        endpoint,
        plan_options,
        read,
        require_compatible,
        with_prior,
    )
    from oxbow_cli.destination import Destination, writing
    from oxbow_cli.home import recordings_folder
    from oxbow_cli.planning import PlanningJob, plan_embedded, plan_here, plan_on

    require_compatible(local=local, connect=connect, record=record, time_limit_s=time_limit, timeout_s=timeout)
    completed = Destination.of(output or file, inputs=[prior])
    mission = with_prior(read(file), prior)
    if record is not None:
        with writing(record):
            record.parent.mkdir(parents=True, exist_ok=True)
        Destination.of(record, inputs=[file, completed.path, prior])
    options = plan_options(
        method,
        seed=seed,
        heading_deg=heading,
        time_limit_s=time_limit,
        smooth=smooth,
        draw=draw,
        router=router,
    )
    with report.progress_bar(shown=not json) as progress:
        job = PlanningJob(
            mission, options, timeout, progress, keep=lambda planned: completed.keep(mission_json(planned))
        )
        if local:
            planned = plan_here(job)
        elif connect is not None:
            planned = plan_on(job, endpoint(connect, "--connect"))
        else:
            planned = plan_embedded(job, record, recordings_folder(home))
    if json:
        report.print_json(report.plan_document(planned, completed.path))
    else:
        report.print_plan(planned, completed.path)


@app.command()
def up(
    listen: Annotated[str, typer.Option(metavar="ENDPOINT", help="Where the router listens.")] = DEFAULT_ENDPOINT,
    replicas: Annotated[
        list[str] | None, typer.Option(metavar="STAGE=N", help="Number of processes of a stage; may be repeated.")
    ] = None,
    home: Home = None,
) -> None:
    """Start a router and the services, and keep them running until Ctrl-C or SIGTERM.

    Each stage has one process; the path stage has one per processor, but at least two, so that a long mission does
    not hold up all others. A process that dies is restarted. Plan on the stack with `oxbow plan --connect`,
    or with `oxbow.Client` from Python.

    Example: `oxbow up --listen tcp/127.0.0.1:7447 --replicas path=4`
    """
    import logging

    from oxbow.runtime.lifetime import Lifetime
    from oxbow_cli.arguments import endpoint, replica_counts
    from oxbow_cli.destination import writing
    from oxbow_cli.home import home_folder, recordings_folder
    from oxbow_cli.stack import StackSettings, running_stack

    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s: %(message)s")
    settings = StackSettings(
        endpoint=endpoint(listen, "--listen"),
        home=home_folder(home),
        recordings=recordings_folder(home),
        replicas=replica_counts(replicas or ()),
    )
    with writing(settings.home):
        settings.home.mkdir(parents=True, exist_ok=True)
    with ending.orderly(), running_stack(settings):
        print("ready:", settings.endpoint, flush=True)
        Lifetime().wait()


@app.command()
def status(
    connect: Annotated[str, typer.Option(metavar="ENDPOINT", help="Where the router listens.")] = DEFAULT_ENDPOINT,
    json: AsJson = False,
) -> None:
    """Show the processes of a stack and the state of its missions.

    Example: `oxbow status --connect tcp/127.0.0.1:7447`
    """
    from oxbow_cli import report
    from oxbow_cli.arguments import endpoint
    from oxbow_cli.status import status_of

    found = status_of(endpoint(connect, "--connect"))
    if json:
        report.print_json(found)
    else:
        report.print_status(found)


@app.command()
def evaluate(
    file: Annotated[Path | None, typer.Argument(metavar="FILE", help="The Mission File.")] = None,
    compare: Annotated[
        tuple[Path, Path] | None, typer.Option(metavar="A B", help="Compare two Mission Files side by side.")
    ] = None,
    json: AsJson = False,
) -> None:
    """Judge the path in a completed Mission File, whoever made it, or compare two.

    Measures how well the path covers the water, with certified bounds, and whether it keeps the rules. A
    comparison marks the better value of each measure, and reports where the two missions differ.

    Examples:

    - `oxbow evaluate lake.json --json`
    - `oxbow evaluate --compare lake-a.json lake-b.json`
    """
    from oxbow.errors import InvalidOption
    from oxbow_cli import report
    from oxbow_cli.arguments import naming, read
    from oxbow_cli.comparison import compare as compare_paths
    from oxbow_cli.evaluation import evaluate

    if (file is None) == (compare is None):
        raise InvalidOption("expected one Mission File, or two after --compare", where="FILE")
    if compare is not None:
        missions = []
        for path in compare:
            with naming(str(path)):
                missions.append(read(path))
        comparison = compare_paths(*missions, names=(str(compare[0]), str(compare[1])))
        if json:
            report.print_json(report.comparison_document(compare, comparison))
        else:
            report.print_comparison(compare, comparison)
    elif file is not None:
        found = evaluate(read(file))
        if json:
            report.print_json(found)
        else:
            report.print_evaluation(file.name, found)


@app.command(name="import")
def import_site(
    site: Annotated[Path, typer.Argument(metavar="SITE.geojson", help="A polygon in WGS84 degrees.")],
    launch: Annotated[str, typer.Option(metavar="LAT,LONG", help="Where the vehicle is launched.")],
    recovery: Annotated[
        str | None, typer.Option(metavar="LAT,LONG", help="Where it is recovered; by default the launch point.")
    ] = None,
    safety: Annotated[float, typer.Option(help="Least distance from the shore and the zones, in metres.")] = 0.0,
    length: Annotated[float, typer.Option(help="Greatest length of the path, in metres.")] = 20_000.0,
    spacing: Annotated[
        float | None, typer.Option(help="Least distance between parallel segments, in metres.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="The site's name; by default the feature's own.")] = None,
    part: Annotated[
        int | None, typer.Option(help="Which polygon to use if there are several, counted from 0.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file to write, instead of stdout.")
    ] = None,
) -> None:
    """Make a Mission File from GeoJSON: the exterior is the outline, holes are forbidden zones.

    Example: `oxbow import site.geojson --launch 44.6035,-73.3912 --safety 10 -o lake.json`
    """
    from oxbow.contracts import MAX_REQUEST_BYTES
    from oxbow.errors import renamed
    from oxbow.mission.file import mission_json
    from oxbow.mission.files import read_bytes
    from oxbow.site.geojson import DOCUMENT, mission_from_geojson
    from oxbow_cli.arguments import position
    from oxbow_cli.destination import Destination
    from oxbow_cli.streams import print_utf8

    destination = None if output is None else Destination.of(output, inputs=[site])
    with renamed({DOCUMENT: str(site), f"{DOCUMENT}.type": f"{site}: type"}):
        imported = mission_from_geojson(
            read_bytes(site, MAX_REQUEST_BYTES),
            launch=position(launch, "--launch"),
            recovery=None if recovery is None else position(recovery, "--recovery"),
            site_name=name,
            safety_m=safety,
            length_m=length,
            minimal_spatial_rate_m=spacing,
            part=part,
        )
    for note in imported.notes:
        print(f"note: {note}", file=sys.stderr)
    document = mission_json(imported.mission)
    if destination is None:
        print_utf8(document)
    else:
        destination.write(document)


@app.command()
def picture(
    file: MissionFile,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="PNG|SVG", help="The picture to write.")],
    gaps: Annotated[
        bool, typer.Option("--gaps", help="Colour the water by its distance to the path, and mark the worst gap.")
    ] = False,
) -> None:
    """Draw a completed Mission File.

    Examples:

    - `oxbow picture lake.json -o lake.png`
    - `oxbow picture lake.json --gaps -o gaps.png`
    """
    from oxbow_cli.arguments import read
    from oxbow_cli.destination import Destination, writing
    from oxbow_cli.gaps import draw_gaps
    from oxbow_cli.picture import draw

    Destination.of(output, inputs=[file])
    mission = read(file)
    with writing(output):
        (draw_gaps if gaps else draw)(mission, output)


@app.command()
def inspect(
    mission: Annotated[str, typer.Argument(metavar="ID", help="A mission's ID, or the path of a recording.")],
    home: Home = None,
) -> None:
    """Open the recording of a mission, stage by stage, in the rerun viewer.

    Example: `oxbow inspect lake-1f00ab42`
    """
    from oxbow_cli.home import recordings_folder
    from oxbow_cli.viewer import find_recording, open_recording

    raise typer.Exit(open_recording(find_recording(mission, recordings_folder(home))))
