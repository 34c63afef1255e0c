"""What the mission service and its helper processes say to each other, over a pipe (MessagePack)."""

from __future__ import annotations

import msgspec

from oxbow.errors import ErrorReply

STAGE = "mission"
"""What the service calls itself in layers and errors."""

__all__ = [
    "STAGE",
    "Answer",
    "Ask",
    "Check",
    "Checked",
    "FromHelper",
    "HelperFailed",
    "Plan",
    "Planned",
    "Ready",
    "Said",
    "Show",
    "ToHelper",
    "Told",
]


class Ready(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A helper process has loaded what it needs."""


class Check(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Read a Mission File and the parameters of its query, and check its geometry."""

    document: bytes
    parameters: dict[str, str]


class Checked(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """What a request is kept as: see `oxbow.planning.submission.Submission`."""

    mission_id: str
    client: str
    document: bytes
    parameters: bytes
    fingerprint: str
    deadline_s: float


class Plan(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Plan a revision of a mission; layers are wanted where `show` is set."""

    mission_id: str
    revision: int
    run_id: str
    document: bytes
    parameters: bytes
    show: bool


class Ask(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Ask a stage, by an encoded request; `fraction` is the share of the run that is done."""

    stage: str
    payload: bytes
    part: str
    fraction: float
    origin: tuple[float, float]


class Answer(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A stage's encoded reply, or why there is none."""

    payload: bytes = b""
    error: ErrorReply | None = None


class Show(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A layer to publish."""

    name: str
    payload: bytes
    droppable: bool


class Planned(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The completed Mission File."""

    document: bytes


class HelperFailed(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The error that a check or a run ended in."""

    error: ErrorReply


class Told(msgspec.Struct, frozen=True, kw_only=True):
    """What the mission service says, about the order of this number."""

    order: int
    what: Check | Plan | Answer


class Said(msgspec.Struct, frozen=True, kw_only=True):
    """What a helper process says, about the order of this number: what is about another is no answer."""

    order: int
    what: Ready | Checked | Ask | Show | Planned | HelperFailed


ToHelper = Check | Plan | Answer
FromHelper = Ready | Checked | Ask | Show | Planned | HelperFailed
