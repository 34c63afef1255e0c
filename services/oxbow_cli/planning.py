"""The ways to plan a Mission File: in this process, on a stack that is up, or on one started for the purpose."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

from oxbow.contracts import STAGES, Endpoint, Message
from oxbow.errors import DeadlineExceeded
from oxbow.mission import Mission
from oxbow.pipeline import Call, plan_mission
from oxbow.plan import PlanOptions

__all__ = ["Progress", "plan_here"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

Progress = Callable[[str, float], None]
"""Called with the stage that is at work and the fraction of the mission that is done."""


def plan_here(mission: Mission, options: PlanOptions, timeout_s: float, progress: Progress) -> Mission:
    """Plan in this process, without a bus."""
    from oxbow_cli.local import local_call  # noqa: PLC0415 - the algorithms, which a client does not import

    with _deadline(timeout_s):
        return plan_mission(mission, options, call=_Reported(local_call(), progress))


class _Reported:
    """A call that tells the progress before each stage."""

    def __init__(self, call: Call, progress: Progress) -> None:
        self.call = call
        self.progress = progress
        self.order = [endpoint.stage for endpoint in STAGES]

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /) -> R:
        self.progress(endpoint.stage, self.order.index(endpoint.stage) / len(self.order))
        return self.call(endpoint, request)


@contextmanager
def _deadline(timeout_s: float) -> Iterator[None]:
    """Raise `DeadlineExceeded` in the main thread after `timeout_s`."""

    def give_up(_number: int, _frame: FrameType | None) -> None:
        raise DeadlineExceeded(f"no plan within {timeout_s:g} s", where="--timeout")

    signal.signal(signal.SIGALRM, give_up)
    signal.setitimer(signal.ITIMER_REAL, timeout_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
