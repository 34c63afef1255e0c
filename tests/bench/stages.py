"""Planning time by stage, in one process, against the size of the problem."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import FrameType
from typing import TypeVar

from oxbow.contracts import STAGES, Call, Endpoint, Message
from oxbow.errors import OxbowError
from oxbow.mission.file import Mission, mission_json, parse_mission
from oxbow.planning.pipeline import plan_mission
from oxbow_cli.local import local_call
from tests.bench.bounded import Bounded
from tests.bench.lakes import lake
from tests.bench.results import Figure, Section

__all__ = ["TimedCall", "measure"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

LIMIT_S = 120.0
"""Of one plan; one that takes longer is stopped, and its row tells how far it came."""

VERTICES = (1_000, 10_000, 100_000, 1_000_000)
ISLANDS = (1, 10, 100, 1_000)
SPACINGS = (6.0, 19.0, 60.0, 190.0)
"""About 10^2, 10^3, 10^4 and 10^5 waypoints."""


@dataclass
class TimedCall:
    """A call that notes the seconds of each stage."""

    call: Call
    seconds: dict[str, float] = field(default_factory=dict)

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R:
        started = time.perf_counter()
        try:
            return self.call(endpoint, request, part=part)
        finally:
            before_s = self.seconds.get(endpoint.stage, 0.0)
            self.seconds[endpoint.stage] = before_s + time.perf_counter() - started


def measure() -> Iterator[Section]:
    """Three tables: against vertices, islands and waypoints."""
    with Bounded() as bounded:
        yield Section(
            "Planning time by stage, s: vertices (no islands, 40 spacings across)",
            [_row(bounded, {"vertices": n}, n, 0, 40.0) for n in VERTICES],
            note="`edges`: reading the file, checking the site, completing and writing the file",
        )
        yield Section(
            "Planning time by stage, s: islands (10 000 vertices, 40 spacings across)",
            [_row(bounded, {"islands": k}, 10_000, k, 40.0) for k in ISLANDS],
        )
        yield Section(
            "Planning time by stage, s: waypoints (1 000 vertices, 4 islands)",
            [_row(bounded, {"spacings": s}, 1_000, 4, s) for s in SPACINGS],
        )


def _row(
    bounded: Bounded, size: dict[str, Figure], vertices: int, islands: int, spacings: float
) -> dict[str, Figure]:
    columns = ("waypoints", "edges", *(endpoint.stage for endpoint in STAGES), "total", "q")
    mission = lake(vertices, islands, spacings=spacings)
    try:
        return size | dict.fromkeys(columns, "") | bounded.run(2 * LIMIT_S, _timed_plan, mission)
    except TimeoutError:
        return size | dict.fromkeys(columns, "") | {"total": f"> {2 * LIMIT_S:g}"}


def _timed_plan(mission: Mission) -> dict[str, Figure]:
    """The times of one plan; after `LIMIT_S`, the stage at work is stopped as soon as it returns to Python."""
    call = TimedCall(local_call())
    document = mission_json(mission)
    signal.signal(signal.SIGALRM, _stop)
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    started = time.perf_counter()
    try:
        planned = plan_mission(parse_mission(document), call=call)
        mission_json(planned)
    except TimeoutError:
        *done, at_work = call.seconds.items()
        return {**dict(done), at_work[0]: f"> {at_work[1]:.3g}", "total": f"> {LIMIT_S:g}"}
    except OxbowError as error:
        return {**call.seconds, "total": error.code}
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    total_s = time.perf_counter() - started
    assert planned.plan is not None
    return {
        "waypoints": len(planned.master_path or ()),
        "edges": total_s - sum(call.seconds.values()),
        **call.seconds,
        "total": total_s,
        "q": planned.plan.certificate.q,
    }


def _stop(_number: int, _frame: FrameType | None) -> None:
    raise TimeoutError
