"""What a stage's session process and its worker process say to each other, over a pipe (MessagePack).

Everything that the worker says of a job carries the job's request id: what has another id is no answer to it.
"""

from __future__ import annotations

import msgspec

from oxbow.errors import ErrorReply
from oxbow.wire.envelope import Envelope

__all__ = ["MOST_MESSAGE_BYTES", "Described", "Done", "Failed", "FromWorker", "Job", "Shown"]

MOST_MESSAGE_BYTES = 2**28
"""More than any message takes: the largest reply, with its ids."""


class Job(msgspec.Struct, frozen=True, kw_only=True):
    """A request for the worker; layers are wanted where `show` is set."""

    envelope: Envelope
    payload: bytes
    show: bool


class Described(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The worker is ready: what it serves, under which keys.

    The session process learns the keys from here, since importing the contracts would cost it numpy and shapely.
    """

    stage: str
    version: str
    instance_key: str
    live_key: str
    introspection_keys: dict[str, str]
    layers_key: str
    most_request_bytes: int
    schema: bytes


class Shown(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A layer to publish."""

    request_id: str
    key: str
    payload: bytes


class Done(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The encoded reply to a job."""

    request_id: str
    payload: bytes


class Failed(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The error that a job ended in."""

    request_id: str
    error: ErrorReply


FromWorker = Described | Shown | Done | Failed
