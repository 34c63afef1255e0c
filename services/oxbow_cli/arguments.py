"""What the command line gives, as what the library takes."""

from __future__ import annotations

import enum
import math
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import msgspec

from oxbow.bus.config import require_endpoint
from oxbow.contracts import MOST_DEADLINE_S, Draw, Method
from oxbow.errors import InvalidMission, OxbowError, renamed
from oxbow.geometry.frame import Position
from oxbow.mission.file import Mission, read_mission
from oxbow.mission.plan import PlanOptions
from oxbow.mission.prior_file import read_prior

E = TypeVar("E", bound=enum.StrEnum)

__all__ = [
    "endpoint",
    "naming",
    "plan_options",
    "position",
    "read",
    "replica_counts",
    "require_compatible",
    "with_prior",
]


LEAST_S = 0.001
"""Of a time limit: an alarm can be set for no less."""


def endpoint(text: str, where: str) -> str:
    """Where a router listens, as ``tcp/HOST:PORT``."""
    require_endpoint(text, where)
    return text


def position(text: str, where: str) -> Position:
    """A position written ``LAT,LONG`` in degrees."""
    try:
        lat, long = map(float, text.split(","))
    except ValueError as error:
        raise InvalidMission(f"is {text!r}; expected LAT,LONG in degrees, as 44.6,-73.3", where=where) from error
    return Position(lat=lat, long=long)


def plan_options(
    method: str, *, seed: int, heading_deg: float | None, time_limit_s: float | None, smooth: bool, draw: str
) -> PlanOptions:
    """How to plan."""
    if heading_deg is not None and not math.isfinite(heading_deg):
        raise InvalidMission(f"is {heading_deg!r}; expected degrees clockwise from north", where="--heading")
    return PlanOptions(
        method=_one_of(Method, method, "--method"),
        seed=seed,
        heading_rad=None if heading_deg is None else math.radians(heading_deg),
        time_limit_s=time_limit_s,
        smooth=smooth,
        draw=_one_of(Draw, draw, "--draw"),
    )


def _one_of(names: type[E], text: str, where: str) -> E:
    if text not in set(names):
        raise InvalidMission(f"is {text!r}; expected {' or '.join(names)}", where=where)
    return names(text)


def with_prior(mission: Mission, prior: Path | None) -> Mission:
    """The mission with the prior model of a file in place of its own, where there is such a file."""
    return mission if prior is None else msgspec.structs.replace(mission, prior_model=read_prior(prior))


def replica_counts(texts: Iterable[str]) -> dict[str, int]:
    """How many processes of each stage, each written ``STAGE=N``.

    Of the path stage, by default, one per processor and two at least: a mission that takes long holds up no other.
    """
    counts = {"path": max(2, os.cpu_count() or 1)}
    for text in texts:
        stage, _, count = text.partition("=")
        if not count.isdecimal():
            raise InvalidMission(f"is {text!r}; expected STAGE=N, as path=2", where="--replicas")
        counts[stage] = int(count)
    return counts


def require_compatible(
    *, local: bool, connect: str | None, record: Path | None, time_limit_s: float | None, timeout_s: float
) -> None:
    """Refuse options that contradict one another, or ask for a time that is none."""
    _require_seconds("--timeout", timeout_s)
    if time_limit_s is not None:
        _require_seconds("--time-limit", time_limit_s)
    if time_limit_s is not None and time_limit_s >= timeout_s:
        raise InvalidMission(
            f"is {time_limit_s:g} s; expected less than --timeout, {timeout_s:g} s", "--time-limit"
        )
    if local and connect is not None:
        raise InvalidMission("plans in this process; give one of --local and --connect", where="--local")
    if record is not None and (local or connect is not None):
        raise InvalidMission(
            f"is {str(record)!r}; only a plan with neither --local nor --connect makes its own recording",
            where="--record",
        )
    if record is not None and record.suffix != ".rrd":
        raise InvalidMission(f"is {str(record)!r}; expected a name that ends in .rrd", where="--record")


def _require_seconds(where: str, value: float) -> None:
    if not LEAST_S <= value <= MOST_DEADLINE_S:
        raise InvalidMission(f"is {value!r}; expected seconds, {LEAST_S:g} to {MOST_DEADLINE_S:g}", where=where)


def read(path: Path) -> Mission:
    """The mission in a file; an error about the file as a whole has its name."""
    with renamed({"Mission File": str(path)}):
        return read_mission(path)


@contextmanager
def naming(file: str) -> Iterator[None]:
    """Name the file of which an error tells, where a command takes several."""
    try:
        yield
    except OxbowError as error:
        raise type(error)(error.message, file if error.where == file else f"{file}: {error.where}") from error
