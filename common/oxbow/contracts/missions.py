"""What a DSS learns about its missions, in JSON."""

from __future__ import annotations

import enum

from oxbow.contracts.message import Message
from oxbow.errors import ErrorReply

__all__ = ["DEFAULT_DEADLINE_S", "MOST_DEADLINE_S", "MissionState", "MissionStatus"]

DEFAULT_DEADLINE_S = 300.0
"""Seconds that planning one mission may take, without its wait for a free planner: enough for twenty vehicles."""

MOST_DEADLINE_S = 86_400.0
"""The most that one mission may request: a day."""


class MissionState(enum.StrEnum):
    """How far a mission's revision has come; `DONE` and `FAILED` are final."""

    ACCEPTED = "accepted"
    PLANNING = "planning"
    DONE = "done"
    FAILED = "failed"

    @property
    def is_final(self) -> bool:
        """Whether no other state can follow."""
        return self in (MissionState.DONE, MissionState.FAILED)


class MissionStatus(Message, frozen=True, kw_only=True):
    """Where a mission stands.

    Parameters
    ----------
    mission_id, revision
        The request concerned: each new content under one id is a new revision, counted from 1. A refused request
        has revision 0, and nothing of it is kept.
    state
        Accepted requests are on disk: each of them ends `done` or `failed`, whatever crashes.
    stage
        The stage at work while `planning`.
    fraction
        The share of the stages that are done, 0 to 1.
    error
        Why it `failed`.
    time_s
        Unix time of this state.
    """

    mission_id: str
    revision: int
    state: MissionState
    stage: str = ""
    fraction: float = 0.0
    error: ErrorReply | None = None
    time_s: float
