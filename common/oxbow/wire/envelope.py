"""What travels beside a request: whose it is, and until when an answer is of use."""

from __future__ import annotations

import math
import time

import msgspec

from oxbow.contracts.ids import MOST_ID_CHARACTERS, checked_id, excerpt
from oxbow.errors import ErrorReply, InvalidMission
from oxbow.wire.strict_json import decode_json
from oxbow.wire.waits import MOST_WAIT_S

__all__ = ["Envelope", "StageError"]

MOST_ENVELOPE_BYTES = 2**16
"""Far more than one takes: it is read on the network thread."""


class Envelope(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The attachment of a query to a stage (JSON).

    Parameters
    ----------
    request_id
        One for each request; a retry keeps it, so that a stage may answer twice but need not work twice.
    deadline_s
        Unix time after which nobody waits for the answer; at most seven days ahead.
    mission_id
        The mission that the request belongs to; without one, the stage shows no layers.
    run_id
        The run of that mission: its requests and their layers share it.
    origin
        Latitude and longitude (degrees, WGS84) of the origin of the mission's planar frame.
    part
        The vehicle or the role that the request is about, where a mission has several: its layers are told apart.

    Raises
    ------
    InvalidMission
        An id is none (`oxbow.contracts.ids`), a number is not finite or out of bounds, or `part` is too long.
    """

    request_id: str
    deadline_s: float
    mission_id: str = ""
    run_id: str = ""
    origin: tuple[float, float] | None = None
    part: str = ""

    def __post_init__(self) -> None:
        checked_id(self.request_id, "request_id")
        for field in ("mission_id", "run_id"):
            if getattr(self, field):
                checked_id(getattr(self, field), field)
        if len(self.part) > MOST_ID_CHARACTERS:
            raise InvalidMission(
                f"is {excerpt(self.part)}; expected at most {MOST_ID_CHARACTERS} characters", where="part"
            )
        if not (math.isfinite(self.deadline_s) and self.remaining_s() <= MOST_WAIT_S):
            raise InvalidMission(
                f"is {self.deadline_s!r}; expected Unix time in s, at most {MOST_WAIT_S:g} s from now",
                where="deadline_s",
            )
        if self.origin is not None and not (abs(self.origin[0]) <= 90.0 and abs(self.origin[1]) <= 540.0):
            raise InvalidMission(f"is {self.origin!r}; expected latitude and longitude in degrees", where="origin")

    @classmethod
    def decode(cls, data: bytes) -> Envelope:
        """Read an envelope; `InvalidMission` where the bytes are none, or too many."""
        if len(data) > MOST_ENVELOPE_BYTES:
            raise InvalidMission(f"is {len(data)} bytes; at most {MOST_ENVELOPE_BYTES}", where="attachment")
        return decode_json(data, cls, "attachment")

    def remaining_s(self) -> float:
        """Seconds until the deadline; negative once it has passed."""
        return self.deadline_s - time.time()


class StageError(ErrorReply, frozen=True, kw_only=True):
    """An error as a stage replies it (JSON); a reply that is no error has the request's id attached.

    Parameters
    ----------
    request_id
        The request that it answers; empty where the request had no id that could be read.
    """

    request_id: str = ""

    @classmethod
    def about(cls, request_id: str, error: ErrorReply) -> StageError:
        return cls(code=error.code, message=error.message, where=error.where, request_id=request_id)
