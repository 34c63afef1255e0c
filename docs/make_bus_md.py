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
from bus_examples import EXAMPLES
from shapely.geometry.base import BaseGeometry

from oxbow.bus import DEFAULT_ENDPOINT
from oxbow.contracts import (
    ANY_LAYER,
    ANY_LIVE,
    INTROSPECTION,
    MAX_REQUEST_BYTES,
    PLAN_KEY,
    STAGES,
    Approach,
    Cell,
    Conformance,
    ContourRequest,
    CriticalKind,
    CriticalPoint,
    DangerZone,
    Draw,
    DroppedPart,
    Endpoint,
    Fault,
    FreeSpace,
    HeadingScore,
    HotSpot,
    LeftSpot,
    Leg,
    Method,
    MiddleLine,
    MissionKey,
    MissionState,
    MissionStatus,
    Per,
    Role,
    Rule,
    Share,
    Sortie,
    SpacingStep,
    Track,
    Variogram,
    VariogramModel,
    Vehicle,
    WeightedArea,
    any_introspection_key,
    introspection_key,
    layer_key,
    live_key,
)
from oxbow.errors import ErrorCode, ErrorReply
from oxbow.ids import MOST_ID_CHARACTERS
from oxbow.planning.submission import SubmissionParameters
from oxbow.wire.envelope import Envelope, StageError
from oxbow.wire.introspection import Info, Ping, Stats, Supervised, Supervision
from oxbow.wire.recording import Layer, LayerKind, Stamped

__all__ = ["bus_md"]

TARGET = Path(__file__).with_name("bus.md")

INTRODUCTION = f"""\
# The bus

Generated from `common/oxbow/contracts/` by `python docs/make_bus_md.py`; a test compares the two.

Oxbow's processes meet on [Zenoh](https://zenoh.io) 1.x, each in `client` mode at one router, by default
`{DEFAULT_ENDPOINT}`: the embedded one of `oxbow up`, or a `zenohd`. Whatever speaks Zenoh can take part.

- A DSS and guidance speak **JSON** (`application/json`); Oxbow's own processes speak **MessagePack**
  (`application/msgpack`) with the same fields. In MessagePack, geometries are WKB and arrays are
  `[dtype, shape, bytes]`; the examples below show them as WKT and as lists of numbers.
- Unless a field says otherwise, geometry is planar, in metres in the mission's local frame: x east, y north. A
  `Place` is such a point, `[x, y]`.
- Ids are 1 to {MOST_ID_CHARACTERS} of `A-Z a-z 0-9 _ . -`, the first of them not `.`.
- No request is larger than {MAX_REQUEST_BYTES // 2**20} MiB.
- An error is an error reply with an `ErrorReply` in JSON; any other encoding marks an error of Zenoh's own.
- Publications arrive at most once, and anyone may publish: follow a plan only as the history has it, and ask for
  what is new there after each publication, after each loss of the link, and at intervals, as `oxbow.Client` does.
- A query without any reply was lost: ask again. Requests may be repeated under one `request_id`.
- A stage with several replicas has a key for each. The caller chooses one that is alive, the one with the fewest
  of its requests, and asks another if the first is busy or lost. `oxbow.bus.client.Bus.call` does all of this.
- Chunks that begin with `@` are matched by no wildcard: `oxbow/v1/stage/*/*` asks stages to work, and
  `{any_introspection_key("ping")}` asks them, the mission service and the recorder for their state.
- A query may have the parameters that are named here, each once. The mission service refuses any other, except
  those that begin with `_`, which are Zenoh's own.
- A key of a mission that is not among those below, such as `{MissionKey("lake", "bogus")}`, is nobody's: a query
  to it has no reply, as if it was lost.
"""

INNER = (
    DroppedPart,
    CriticalPoint,
    Cell,
    HeadingScore,
    WeightedArea,
    SpacingStep,
    Vehicle,
    HotSpot,
    DangerZone,
    Share,
    Approach,
    MiddleLine,
    Sortie,
    LeftSpot,
    Variogram,
    Track,
    Conformance,
    Leg,
    Fault,
    Layer,
    Supervised,
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
        (
            str(MissionKey("{id}", "plan", "{revision}")),
            "query: a plan of the history, or `*?after=3`: those of later revisions",
            "DSS → mission",
        ),
        (_mission("cancel"), "put or query, empty; replies `MissionStatus`", "DSS → mission"),
        (_mission("report"), "put, JSON: vehicle state, track, obstacles, blooms found", "guidance → mission"),
        (_mission("replan"), "publication and query of the latest, as `plan`", "mission → guidance"),
        (
            str(MissionKey("{id}", "replan", "{revision}")),
            "query: a replan of the history, as `plan`",
            "guidance → mission",
        ),
        (PLAN_KEY, "query: Mission File in, completed Mission File out", "DSS → mission"),
        (_stage(), "query with an `Envelope` attached", "mission → stages"),
        *((f"{_stage()}/@{what}", "query, JSON", "operators → stages") for what in INTROSPECTION),
        (
            _filled(introspection_key("supervisor", "INSTANCE", "processes")),
            "query, JSON",
            "operators → `oxbow up`",
        ),
        (
            _filled(live_key("STAGE", "INSTANCE")),
            "liveliness token",
            "every service, and every client as `client`",
        ),
        (_filled(layer_key("ID", "STAGE", "NAME")), "put, `Stamped`", "stages → recorder, and whoever draws"),
    ]
    return _table(("key expression", "kind", "who"), [(f"`{key}`", kind, who) for key, kind, who in rows])


def _missions() -> Iterator[str]:
    yield textwrap.dedent(
        f"""\
        The Mission File is described in [mission-file.md](mission-file.md). If one is put to
        `{_mission("request")}`, the mission's status is published. A query to the same key is also replied to
        with a `MissionStatus`, and a query to `{PLAN_KEY}` with the completed Mission File, once there is one. A
        put to `{_mission("cancel")}` ends whatever of the mission waits or is being planned: it has `failed`, with
        the error `cancelled`. A query may carry the parameters below:
        `{PLAN_KEY}?{SubmissionParameters(id="lake", seed=3, deadline_s=60.0).text}`.
        """
    )
    yield _message(SubmissionParameters)
    yield _message(MissionStatus)


def _stages() -> Iterator[str]:
    yield (
        "A request to a stage travels with an `Envelope` (JSON) as the query's attachment. A reply has the"
        " request's id attached, and an error carries it as a `StageError`: nothing else is an answer. Another"
        " request under the same id is refused. An unknown key below an instance's is answered with an error,"
        " unless one of its chunks begins with `@`: such a key has no reply.\n"
    )
    yield _message(Envelope)
    yield _message(StageError)
    seen: set[type] = set()
    for endpoint in STAGES:
        yield f"### Stage `{endpoint.stage}`\n"
        key = _filled(endpoint.instance_key("INSTANCE"))
        yield f"`{key}`: {_link(endpoint.request)} → {_link(endpoint.reply)}.\n"
        for kind in _kinds_of(endpoint):
            if kind not in seen:
                seen.add(kind)
                yield _message(kind, level=4)
    yield "### What a stage reports about itself\n"
    yield (
        "`@schema` replies with a JSON Schema of both messages. All replicas of all stages are asked with"
        f" `{any_introspection_key('stats')}`; the liveliness of `{ANY_LIVE}` shows which are alive.\n"
    )
    for kind in (Ping, Info, Stats, Supervision, Supervised):
        yield _message(kind, level=4)


def _layers() -> Iterator[str]:
    yield (
        f"What a stage shows of its work, for recorders and viewers: subscribe to `{ANY_LAYER}`. Layers are sent"
        " after all other traffic, and are dropped rather than waited for. Without a subscriber, or for a request"
        " without a mission, none are made.\n"
    )
    yield _message(Stamped)
    yield _message(Layer)


def _closed_sets() -> str:
    sets: tuple[type[enum.StrEnum], ...] = (
        Method,
        Draw,
        Role,
        Per,
        CriticalKind,
        Rule,
        VariogramModel,
        MissionState,
        LayerKind,
        ErrorCode,
    )
    return _table(("type", "values"), [(f"`{kind.__name__}`", ", ".join(f"`{v}`" for v in kind)) for kind in sets])


def _kinds_of(endpoint: Endpoint[Any, Any]) -> Iterator[type[msgspec.Struct]]:
    """The request, the reply and the messages inside them."""
    return iter(dict.fromkeys((*_with_inner(endpoint.request), *_with_inner(endpoint.reply))))


def _with_inner(kind: type[msgspec.Struct]) -> Iterator[type[msgspec.Struct]]:
    yield kind
    annotations = " ".join(_annotations(kind).values())
    for inner in INNER:
        if re.search(rf"\b{inner.__name__}\b", annotations):
            yield from _with_inner(inner)


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
    """What a numpydoc docstring says about the class, and about each of its parameters."""
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
