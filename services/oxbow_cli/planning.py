"""The ways to plan a mission: in this process, on a stack that is up, or on one started for the purpose."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TypeVar

import msgspec

from oxbow.bus.router import free_endpoint
from oxbow.client import Client
from oxbow.contracts import Call, Endpoint, Message, MissionStatus
from oxbow.errors import DeadlineExceeded
from oxbow.mission.file import Mission
from oxbow.mission.files import move_into_place
from oxbow.mission.plan import PlanOptions
from oxbow.planning.pipeline import expected_calls, plan_mission
from oxbow.site.site import Site
from oxbow_cli.exits import DEBUG
from oxbow_cli.interrupts import ending
from oxbow_cli.local import local_call
from oxbow_cli.scratch import scratch_folder
from oxbow_cli.stack import StackSettings, running_stack

__all__ = ["PlannedMission", "PlanningJob", "Progress", "plan_embedded", "plan_here", "plan_on"]

CONNECT_S = 3.0
"""How long a router and a mission service may take to answer; running ones do so in milliseconds."""

_log = logging.getLogger(__name__)

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

Progress = Callable[[str, float], None]
"""Called with the stage at work and the fraction of the mission that is done, 0 to 1."""


@dataclass(frozen=True)
class PlanningJob:
    """A mission to plan.

    Parameters
    ----------
    mission
        The mission.
    options
        How to plan it.
    timeout_s
        After how many seconds to give up.
    progress
        Called whenever there is progress.
    keep
        Called with the completed mission as soon as there is one, before anything else can fail.
    """

    mission: Mission
    options: PlanOptions
    timeout_s: float
    progress: Progress
    keep: Callable[[Mission], None]


@dataclass(frozen=True)
class PlannedMission:
    """A completed mission, and its recording; None if there is none in reach."""

    mission: Mission
    recording: Path | None = None


def plan_here(job: PlanningJob) -> PlannedMission:
    """Plan in this process, without a bus and without a recording; only from the main thread.

    Raises
    ------
    DeadlineExceeded
        There is no plan within the job's time.
    """
    with _deadline(job.timeout_s):
        site = Site.of(job.mission)
        call = _Reported(local_call(), job.progress, expected_calls(site))
        planned = plan_mission(job.mission, job.options, call=call, site=site)
    job.keep(planned)
    return PlannedMission(planned)


def plan_on(job: PlanningJob, endpoint: str) -> PlannedMission:
    """Plan on a running stack; its recorder keeps the recording.

    Parameters
    ----------
    job
        What to plan.
    endpoint
        Where the stack's router listens.

    Returns
    -------
    PlannedMission
        Without a recording: that is with the stack, perhaps on another machine.

    Raises
    ------
    DeadlineExceeded
        There is no plan within the job's time.
    """

    def note(status: MissionStatus) -> None:
        job.progress(status.stage or status.state, status.fraction)

    with _named_timeout(job.timeout_s), Client(endpoint, timeout_s=CONNECT_S) as client:
        planned = client.plan(
            job.mission,
            timeout_s=job.timeout_s,
            on_status=note,
            **msgspec.structs.asdict(job.options),
        )
    # Kept before the stack stops: what fails from here on must not cost the plan.
    job.keep(planned)
    return PlannedMission(planned)


def plan_embedded(job: PlanningJob, recording: Path | None, recordings: Path) -> PlannedMission:
    """Plan on a stack that is started for this plan and stopped afterwards.

    Parameters
    ----------
    job
        What to plan.
    recording
        Where the recording goes; None for the folder `recordings`, under the mission's ID.
    recordings
        The folder of recordings that are not given a place.

    Returns
    -------
    PlannedMission
        With its recording, where that could be kept.

    Raises
    ------
    DeadlineExceeded
        There is no plan within the job's time.
    Unavailable
        The stack did not start.
    """
    with ending.orderly(), scratch_folder() as scratch:
        # A store of its own: the user's may be held by a stack that is up.
        settings = StackSettings(endpoint=free_endpoint(), home=scratch, recordings=scratch)
        with running_stack(settings, output=None if DEBUG in os.environ else subprocess.DEVNULL):
            planned = plan_on(job, settings.endpoint).mission
        # The recorder has closed its file by now. If it failed, the plan is worth having even so.
        assert planned.plan is not None
        made = scratch / f"{planned.plan.mission_id}.rrd"
        return PlannedMission(planned, _kept_recording(made, recording or recordings / made.name))


def _kept_recording(made: Path, target: Path) -> Path | None:
    """Where a recording is kept; None, with a warning, if it cannot be: the plan itself is already kept."""
    if not made.exists():
        return None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with ending.holding_signals():
            move_into_place(made, target)
    except OSError as error:
        _log.warning("warning: the recording cannot be kept as %s: %s", target, error.strerror or error)
        return None
    return target


class _Reported:
    """A call that reports progress before each stage."""

    def __init__(self, call: Call, progress: Progress, expected: int) -> None:
        self.call = call
        self.progress = progress
        self.expected = expected
        self.made = 0

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R:
        self.progress(endpoint.stage, min(self.made / self.expected, 1.0))
        self.made += 1
        return self.call(endpoint, request, part=part)


@contextmanager
def _named_timeout(timeout_s: float) -> Iterator[None]:
    """Report a time that was too short under the option that set it."""
    try:
        yield
    except DeadlineExceeded as error:
        raise _too_late(timeout_s) from error


def _too_late(timeout_s: float) -> DeadlineExceeded:
    return DeadlineExceeded(f"no plan within {timeout_s:g} s", where="--timeout")


@contextmanager
def _deadline(timeout_s: float) -> Iterator[None]:
    """Raise `DeadlineExceeded` in the main thread after `timeout_s`.

    By an alarm, since the algorithms run in this very thread.
    """

    def give_up(_number: int, _frame: FrameType | None) -> None:
        raise _too_late(timeout_s)

    signal.signal(signal.SIGALRM, give_up)
    # The handler runs between two bytecodes: a long call into GEOS delays it, but cannot escape it.
    signal.setitimer(signal.ITIMER_REAL, timeout_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
