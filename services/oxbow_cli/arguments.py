"""Arguments of the command line, converted to what the library takes."""

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
from oxbow.contracts import MOST_DEADLINE_S, Draw, Method, RouteMethod
from oxbow.errors import InvalidOption, InvalidRequest, OxbowError, renamed
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
"""The least time limit: a shorter alarm could round to none at all."""


def endpoint(text: str, where: str) -> str:
    """The address where a router listens, checked.

    Parameters
    ----------
    text
        Expected as ``tcp/HOST:PORT``.
    where
        The option that gave it, for errors.

    Returns
    -------
    str
        The text itself.
    """
    require_endpoint(text, where)
    return text


def position(text: str, where: str) -> Position:
    """A position written ``LAT,LONG`` in degrees.

    Parameters
    ----------
    text
        What was written.
    where
        The option that gave it, for errors.

    Returns
    -------
    Position
        Its range is checked with the mission.

    Raises
    ------
    InvalidOption
        The text is not two numbers.
    """
    try:
        lat, long = map(float, text.split(","))
    except ValueError as error:
        raise InvalidOption(
            f"is {text!r}; expected LAT,LONG in degrees, such as 44.6,-73.3", where=where
        ) from error
    return Position(lat=lat, long=long)


def plan_options(
    method: str,
    *,
    seed: int,
    heading_deg: float | None,
    time_limit_s: float | None,
    smooth: bool,
    draw: str,
    router: str,
) -> PlanOptions:
    """The options of a plan.

    Parameters
    ----------
    method
        The name of a `Method`.
    seed
        Seed of everything random.
    heading_deg
        Of transects, in degrees clockwise from north; None for the best one.
    time_limit_s
        How long to improve the path, in seconds; None for a fixed amount of work.
    smooth
        Whether corners are rounded.
    draw
        The name of a `Draw`.
    router
        The name of a `RouteMethod`.

    Returns
    -------
    PlanOptions
        With the heading in radians, and names as the enumerations' members.

    Raises
    ------
    InvalidOption
        A name is unknown, or a number is not finite or out of bounds; names the option.
    """
    if heading_deg is not None and not math.isfinite(heading_deg):
        raise InvalidOption(f"is {heading_deg!r}; expected degrees clockwise from north", where="--heading")
    try:
        return PlanOptions(
            method=_one_of(Method, method, "--method"),
            seed=seed,
            heading_rad=None if heading_deg is None else math.radians(heading_deg),
            time_limit_s=time_limit_s,
            smooth=smooth,
            draw=_one_of(Draw, draw, "--draw"),
            router=_one_of(RouteMethod, router, "--router"),
        )
    except InvalidRequest as error:
        raise InvalidOption(error.message, where=_OPTIONS[error.where]) from error


_OPTIONS = {"seed": "--seed", "heading_rad": "--heading", "time_limit_s": "--time-limit"}
"""What the user knows the fields of `PlanOptions` by that a message checks itself."""


def _one_of(names: type[E], text: str, where: str) -> E:
    if text not in set(names):
        raise InvalidOption(f"is {text!r}; expected {' or '.join(names)}", where=where)
    return names(text)


def with_prior(mission: Mission, prior: Path | None) -> Mission:
    """The mission with the prior model of a file instead of its own.

    Parameters
    ----------
    mission
        The mission.
    prior
        GeoJSON or a raster; None leaves the mission as it is.

    Returns
    -------
    Mission
        The mission itself where `prior` is None.

    Raises
    ------
    InvalidOption
        The file cannot be read, or is no prior model.
    """
    return mission if prior is None else msgspec.structs.replace(mission, prior_model=read_prior(prior))


def replica_counts(texts: Iterable[str]) -> dict[str, int]:
    """The number of processes of each stage that is not to have a single one.

    By default, the path stage has one per processor and at least two, so that a long mission holds up no other.

    Parameters
    ----------
    texts
        Each written ``STAGE=N``; of several for one stage, the last counts.

    Raises
    ------
    InvalidOption
        A text has another form.
    """
    counts = {"path": max(2, os.cpu_count() or 1)}
    for text in texts:
        stage, _, count = text.partition("=")
        # Whether the stage exists, and the count is at least 1, is for `StackSettings` to check.
        if not count.isdecimal():
            raise InvalidOption(f"is {text!r}; expected STAGE=N, such as path=2", where="--replicas")
        counts[stage] = int(count)
    return counts


def require_compatible(
    *, local: bool, connect: str | None, record: Path | None, time_limit_s: float | None, timeout_s: float
) -> None:
    """Refuse options that contradict one another, and times that are out of bounds.

    Parameters
    ----------
    local, connect, record
        Options of `oxbow plan`.
    time_limit_s, timeout_s
        The same, in seconds, `LEAST_S` to `MOST_DEADLINE_S`; the time limit is to be less than the timeout.

    Raises
    ------
    InvalidOption
        Names the option.
    """
    _require_seconds("--timeout", timeout_s)
    if time_limit_s is not None:
        _require_seconds("--time-limit", time_limit_s)
    # The limit is for improving alone; what comes before and after it needs some of the timeout, too.
    if time_limit_s is not None and time_limit_s >= timeout_s:
        raise InvalidOption(
            f"is {time_limit_s:g} s; expected less than --timeout, {timeout_s:g} s", "--time-limit"
        )
    if local and connect is not None:
        raise InvalidOption("plans in this process; give either --local or --connect", where="--local")
    if record is not None and (local or connect is not None):
        raise InvalidOption(
            f"is {str(record)!r}; only a plan with neither --local nor --connect makes its own recording",
            where="--record",
        )
    if record is not None and record.suffix != ".rrd":
        raise InvalidOption(f"is {str(record)!r}; expected a name that ends in .rrd", where="--record")


def _require_seconds(where: str, value: float) -> None:
    if not LEAST_S <= value <= MOST_DEADLINE_S:
        raise InvalidOption(f"is {value!r}; expected seconds, {LEAST_S:g} to {MOST_DEADLINE_S:g}", where=where)


def read(path: Path) -> Mission:
    """The mission in a file; an error about the file as a whole is reported under the file's name."""
    # Fields keep their names; only the file itself is called by its path.
    with renamed({"Mission File": str(path)}):
        return read_mission(path)


@contextmanager
def naming(file: str) -> Iterator[None]:
    """Add the name of the file to errors about it, for a command that takes several."""
    try:
        yield
    except OxbowError as error:
        raise type(error)(error.message, file if error.where == file else f"{file}: {error.where}") from error
