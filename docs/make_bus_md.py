"""Make docs/bus.md from the contracts: every key, message and an example in JSON."""

from __future__ import annotations

import enum
import inspect
import json
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from shapely import LineString, Point, box
from shapely.geometry.base import BaseGeometry

from oxbow.bus import DEFAULT_ENDPOINT
from oxbow.contracts import (
    ANY_LAYER,
    ANY_LIVE,
    INTROSPECTION,
    MAX_REQUEST_BYTES,
    PLAN_KEY,
    STAGES,
    Assignment,
    AssignRequest,
    Cell,
    Certificate,
    CertifyRequest,
    Conformance,
    ContourRequest,
    CriticalKind,
    CriticalPoint,
    DecomposeRequest,
    Decomposition,
    DroppedPart,
    Endpoint,
    FreeSpace,
    HeadingScore,
    HotSpot,
    LeftSpot,
    Method,
    MissionKey,
    MissionState,
    MissionStatus,
    PathPlan,
    PathRequest,
    Role,
    Share,
    Sortie,
    SpacingStep,
    Track,
    Variogram,
    VariogramModel,
    Vehicle,
    WeightedArea,
    any_introspection_key,
    layer_key,
    live_key,
)
from oxbow.envelope import Envelope
from oxbow.errors import ErrorCode, ErrorReply
from oxbow.introspection import Info, Ping, Stats
from oxbow.recording import Layer, LayerKind, Stamped
from oxbow.submission import SubmissionParameters

__all__ = ["bus_md"]

TARGET = Path(__file__).with_name("bus.md")
TIME_S = 1_760_000_000.0

INTRODUCTION = f"""\
# The bus

Generated from `common/oxbow/contracts.py` by `python docs/make_bus_md.py`; a test compares the two.

Oxbow's processes meet on [Zenoh](https://zenoh.io) 1.x, each in `client` mode at one router, by default
`{DEFAULT_ENDPOINT}`: the embedded one of `oxbow up`, or a `zenohd`. Whatever speaks Zenoh can take part.

- A DSS and guidance speak **JSON** (`application/json`); Oxbow's own processes speak **MessagePack**
  (`application/msgpack`) with the same fields. In MessagePack, geometries are WKB and arrays are
  `[dtype, shape, bytes]`; the examples below show them as WKT and as lists of numbers.
- Unless a field says otherwise, geometry is planar, in metres in the mission's local frame: x east, y north. A
  `Place` is such a point, `[x, y]`.
- Ids are made of `A-Z a-z 0-9 _ . -`. No request is larger than {MAX_REQUEST_BYTES // 2**20} MiB.
- An error is an error reply with an `ErrorReply` in JSON; any other encoding marks an error of Zenoh's own.
- A query that has no reply at all was lost: ask again. Requests may be repeated under one `request_id`.
- A stage with several replicas has a key for each. The caller chooses one that is alive, the one with the fewest
  of its requests, and asks another where the first is busy or lost. `oxbow.bus.Bus.call` does all of this.
- Chunks that begin with `@` are matched by no wildcard: `oxbow/v1/stage/*/*` asks stages to work, and
  `{any_introspection_key("ping")}` asks them how they are.
"""

SQUARE = box(0.0, 0.0, 100.0, 60.0)
SPACE = FreeSpace(free=box(5.0, 5.0, 95.0, 55.0), water=SQUARE, tolerance_m=1.0, compression=0.25)
DECOMPOSITION = Decomposition(
    heading_rad=0.0,
    cells=(
        Cell(
            floor=np.array([[5.0, 5.0], [95.0, 5.0]]),
            ceiling=np.array([[5.0, 55.0], [95.0, 55.0]]),
            start=0,
            end=1,
        ),
    ),
    critical_points=(
        CriticalPoint(kind=CriticalKind.OPEN, place=(5.0, 5.0)),
        CriticalPoint(kind=CriticalKind.CLOSE, place=(95.0, 5.0)),
    ),
    scores=(HeadingScore(heading_rad=0.0, predicted_cost=0.052),),
)
PATH = LineString([(5.0, 5.0), (5.0, 55.0), (50.0, 55.0), (50.0, 15.0), (95.0, 15.0), (95.0, 5.0), (5.0, 5.0)])
SORTIE = LineString([(5.0, 5.0), (20.0, 25.0), (40.0, 25.0), (5.0, 5.0)])

EXAMPLES: dict[type[msgspec.Struct], msgspec.Struct] = {
    type(example): example
    for example in (
        Envelope(
            request_id="0f5c1c2e",
            deadline_s=TIME_S + 60.0,
            mission_id="lake",
            run_id="77ab30d1",
            origin=(46.09, 1.9),
        ),
        ErrorReply(code=ErrorCode.INFEASIBLE, message="nothing is left of the water", where="Safety"),
        ContourRequest(outline=SQUARE, zones=(box(40.0, 20.0, 60.0, 40.0),), safety_m=5.0, spacing_m=20.0),
        DroppedPart(
            area_m2=42.0, reason="apart from the largest water", place=(3.0, 4.0), outline=box(0, 0, 6, 7)
        ),
        SPACE,
        AssignRequest(
            free=SPACE.free,
            vehicles=(Vehicle(name="tern", length_m=2_000.0, start=(5.0, 5.0), recovery=(5.0, 5.0)),),
            hot_spots=(HotSpot(name="features[0]", area=box(20.0, 20.0, 40.0, 30.0), value=12.0),),
            swath_m=10.0,
        ),
        Assignment(
            sorties=(
                Sortie(
                    vehicle="tern",
                    path=SORTIE,
                    hot_spots=("features[0]",),
                    length_m=SORTIE.length,
                    duration_s=SORTIE.length,
                ),
            ),
            treated_share=(1.0,),
            makespan_s=SORTIE.length,
        ),
        DecomposeRequest(free=SPACE.free, spacing_m=20.0),
        DECOMPOSITION,
        PathRequest(
            space=SPACE, decomposition=DECOMPOSITION, launch=(5.0, 5.0), recovery=(5.0, 5.0), length_m=20_000.0
        ),
        PathPlan(path=PATH, spacing_m=45.0, steps=(SpacingStep(spacing_m=45.0, length_m=PATH.length),)),
        CertifyRequest(outline=SQUARE, safety_m=5.0, path=PATH, launch=(5.0, 5.0), recovery=(5.0, 5.0)),
        Certificate(
            length_m=280.0,
            duration_s=280.0,
            waypoints=7,
            is_simple=True,
            crossings=0,
            outside_m=0.0,
            unsafe_m=0.0,
            components=1,
            free_area_m2=4500.0,
            judged_area=1.0,
            cover_radius_m=(40.0, 40.4),
            least_radius_m=7.7,
            q=5.24,
            mean_distance_m=9.8,
            p95_distance_m=27.3,
            mean_ratio=2.55,
            p95_ratio=3.54,
            p99_distance_m=35.3,
            p99_ratio=4.59,
            least_leg_distance_m=10.0,
            discrepancy=0.25,
            discrepancy_ratio=1.7,
            directional_evenness=0.44,
            turns=5,
            worst_gap=(92.2, 55.0),
        ),
        MissionStatus(
            mission_id="lake",
            revision=1,
            state=MissionState.PLANNING,
            stage="path",
            fraction=0.5,
            time_s=TIME_S,
        ),
        SubmissionParameters(id="lake", seed=3, deadline_s=60.0),
        Ping(stage="path", instance="r1", pid=4242, uptime_s=12.5),
        Info(
            stage="path",
            instance="r1",
            version="0.1.0",
            handler="oxbow_path.service:handle",
            started_s=TIME_S,
            worker_pid=4243,
        ),
        Stats(
            stage="path",
            instance="r1",
            served=120,
            failed=2,
            busy=0,
            queued=1,
            mean_s=0.8,
            p95_s=1.6,
            worker_restarts=0,
            session_rss_bytes=48 * 10**6,
            worker_rss_bytes=110 * 10**6,
        ),
        Stamped(
            mission_id="lake",
            origin=(46.09, 1.9),
            request_id="77ab30d1",
            time_s=TIME_S,
            layer=Layer(stage="path", name="launch", geometries=(Point(5.0, 5.0),), labels=("launch",)),
        ),
    )
}

INNER = (
    DroppedPart,
    CriticalPoint,
    Cell,
    HeadingScore,
    WeightedArea,
    SpacingStep,
    Vehicle,
    HotSpot,
    Share,
    Sortie,
    LeftSpot,
    Variogram,
    Track,
    Conformance,
    Layer,
)
"""Messages that only occur inside others, and need no example of their own."""


def bus_md() -> str:
    """The text of docs/bus.md."""
    parts = [INTRODUCTION, "## Keys\n", _keys(), "## Missions, in JSON\n", *_missions(), "## Stages\n", *_stages()]
    parts += ["## Layers\n", *_layers(), "## Errors\n", _message(ErrorReply), "## Closed sets\n", _closed_sets()]
    return "\n".join(parts)


def _keys() -> str:
    rows = [
        (_mission("request"), "put or query, JSON Mission File", "DSS → mission"),
        (_mission("status"), "publication and query, `MissionStatus`", "mission → DSS"),
        (_mission("plan"), "publication and query of the latest: the completed Mission File", "mission → DSS"),
        (str(MissionKey("{id}", "plan", "{revision}")), "query: a plan of the history", "DSS → mission"),
        (_mission("report"), "put, JSON: vehicle state, track, obstacles, blooms found", "guidance → mission"),
        (_mission("replan"), "publication and query of the latest, as `plan`", "mission → guidance"),
        (str(MissionKey("{id}", "replan", "{revision}")), "query: a replan of the history", "guidance → mission"),
        (PLAN_KEY, "query: Mission File in, completed Mission File out", "DSS → mission"),
        (_stage(), "query with an `Envelope` attached", "mission → stages"),
        *((f"{_stage()}/@{what}", "query, JSON", "operators → stages") for what in INTROSPECTION),
        (_filled(live_key("STAGE", "INSTANCE")), "liveliness token", "every service"),
        (_filled(layer_key("ID", "STAGE", "NAME")), "put, `Stamped`", "stages → recorder, and whoever draws"),
    ]
    return _table(("key expression", "kind", "who"), [(f"`{key}`", kind, who) for key, kind, who in rows])


def _missions() -> Iterator[str]:
    yield textwrap.dedent(
        f"""\
        A Mission File is described in [mission-file.md](mission-file.md). Put to `{_mission("request")}`, it is
        answered by the mission's status alone; asked of the same key, by a `MissionStatus` in reply too; asked of
        `{PLAN_KEY}`, by the completed Mission File, once it is there. A query may carry the parameters below:
        `{PLAN_KEY}?{SubmissionParameters(id="lake", seed=3, deadline_s=60.0).text}`.
        """
    )
    yield _message(SubmissionParameters)
    yield _message(MissionStatus)


def _stages() -> Iterator[str]:
    yield "A request to a stage travels with an `Envelope` (JSON) as the query's attachment.\n"
    yield _message(Envelope)
    seen: set[type] = set()
    for endpoint in STAGES:
        yield f"### Stage `{endpoint.stage}`\n"
        key = _filled(endpoint.instance_key("INSTANCE"))
        yield f"`{key}`: {_link(endpoint.request)} → {_link(endpoint.reply)}.\n"
        for kind in _kinds_of(endpoint):
            if kind not in seen:
                seen.add(kind)
                yield _message(kind, level=4)
    yield "### What a stage tells about itself\n"
    yield (
        "`@schema` replies a JSON Schema of both messages. All replicas of all stages are asked with"
        f" `{any_introspection_key('stats')}`; who is alive is the liveliness of `{ANY_LIVE}`.\n"
    )
    for kind in (Ping, Info, Stats):
        yield _message(kind, level=4)


def _layers() -> Iterator[str]:
    yield (
        f"What a stage shows of its work, for recorders and viewers: subscribe to `{ANY_LAYER}`. Layers are sent"
        " after all other traffic, and dropped rather than waited for. Without a subscriber, or in a request"
        " without a mission, none is made.\n"
    )
    yield _message(Stamped)
    yield _message(Layer)


def _closed_sets() -> str:
    sets: tuple[type[enum.StrEnum], ...] = (
        Method,
        Role,
        CriticalKind,
        VariogramModel,
        MissionState,
        LayerKind,
        ErrorCode,
    )
    return _table(("type", "values"), [(f"`{kind.__name__}`", ", ".join(f"`{v}`" for v in kind)) for kind in sets])


def _kinds_of(endpoint: Endpoint[Any, Any]) -> Iterator[type[msgspec.Struct]]:
    """The request, the reply and the messages inside them that are explained nowhere else."""
    for kind in (endpoint.request, endpoint.reply):
        yield kind
        annotations = " ".join(_annotations(kind).values())
        yield from (inner for inner in INNER if re.search(rf"\b{inner.__name__}\b", annotations))


def _message(kind: type[msgspec.Struct], level: int = 3) -> str:
    meaning, fields = _docstring(kind)
    rows = []
    for field in msgspec.structs.fields(kind):
        annotation = _annotations(kind)[field.name].replace("|", "\\|")
        rows.append((f"`{field.encode_name}`", f"`{annotation}`", _default(field), fields.get(field.name, "")))
    columns = 4 if fields else 3
    table = _table(("field", "type", "default", "meaning")[:columns], [row[:columns] for row in rows])
    parts = [f"{'#' * level} {kind.__name__}\n", meaning + "\n", table]
    if kind in EXAMPLES:
        parts.append(f"```json\n{_json(EXAMPLES[kind])}\n```\n")
    return "\n".join(parts)


def _docstring(kind: type) -> tuple[str, dict[str, str]]:
    """What a numpydoc docstring says of the class, and of each of its parameters."""
    meaning, _, parameters = inspect.cleandoc(kind.__doc__ or "").partition("\nParameters\n----------\n")
    fields: dict[str, str] = {}
    for names, text in re.findall(r"^(\w[\w, ]*)\n((?:    .*\n?)+)", parameters + "\n", flags=re.MULTILINE):
        for name in names.split(", "):
            fields[name] = " ".join(text.split())
    return meaning.strip(), fields


def _annotations(kind: type) -> dict[str, str]:
    """The types of all fields as the source writes them, inherited ones included."""
    merged: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        merged.update(inspect.get_annotations(base))
    return merged


def _default(field: msgspec.structs.FieldInfo) -> str:
    if field.required:
        return ""
    value = field.default if field.default is not msgspec.NODEFAULT else field.default_factory()
    return f"`{json.dumps(value)}`"


def _json(message: msgspec.Struct) -> str:
    text = json.dumps(msgspec.to_builtins(message, enc_hook=_readable), indent=2, ensure_ascii=False)
    return re.sub(r"\[[-\d.,\s\[\]]+\](?=,?\n)", lambda numbers: _in_one_line(numbers[0]), text)


def _in_one_line(numbers: str) -> str:
    return json.dumps(json.loads(numbers))


def _readable(value: Any) -> Any:
    if isinstance(value, BaseGeometry):
        return value.wkt
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(type(value).__name__)


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def _link(kind: type) -> str:
    return f"[{kind.__name__}](#{kind.__name__.lower()})"


def _mission(what: str) -> str:
    return str(MissionKey("{id}", what))


def _stage() -> str:
    return _filled(Endpoint("STAGE", ContourRequest, FreeSpace).instance_key("INSTANCE"))


def _filled(key: str) -> str:
    """A key with its capital chunks as placeholders."""
    return re.sub(r"[A-Z]{2,}", lambda match: "{" + match.group().lower() + "}", key)


if __name__ == "__main__":
    TARGET.write_text(bus_md(), encoding="utf-8")
