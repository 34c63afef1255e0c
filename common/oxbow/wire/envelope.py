"""What accompanies a request: the mission that it belongs to, and until when an answer is of use."""

from __future__ import annotations

import math
import time

import msgspec

from oxbow.errors import ErrorReply, InvalidRequest
from oxbow.ids import MOST_ID_CHARACTERS, checked_id, excerpt
from oxbow.wire.strict_json import decode_json
from oxbow.wire.waits import MOST_WAIT_S

__all__ = ["Envelope", "StageError"]

MOST_ENVELOPE_BYTES = 2**16
"""Far more than an envelope needs. It is decoded on the network thread, which a large one would hold up."""


class Envelope(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The attachment of a query to a stage (JSON).

    Parameters
    ----------
    request_id
        Unique per request; a retry keeps it, so that a stage may answer twice but need not work twice.
    deadline_s
        Unix time after which nobody waits for the answer; at most seven days ahead.
    mission_id
        The mission that the request belongs to; without it, the stage shows no layers.
    run_id
        The run of that mission: its requests and their layers share it.
    origin
        Latitude and longitude (degrees, WGS84) of the origin of the mission's planar frame.
    part
        The vehicle or the role that the request is about, where a mission has several; it separates their layers.

    Raises
    ------
    InvalidRequest
        An id is not accepted (`oxbow.ids`), a number is not finite or out of bounds, or `part` is too
        long.
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
            raise InvalidRequest(
                f"is {excerpt(self.part)}; expected at most {MOST_ID_CHARACTERS} characters", where="part"
            )
        # A deadline that has passed is valid: the request was late, not wrong, and is answered as such.
        if not (math.isfinite(self.deadline_s) and self.remaining_s() <= MOST_WAIT_S):
            raise InvalidRequest(
                f"is {self.deadline_s!r}; expected Unix time in s, at most {MOST_WAIT_S:g} s from now",
                where="deadline_s",
            )
        if self.origin is not None and not (abs(self.origin[0]) <= 90.0 and abs(self.origin[1]) <= 540.0):
            raise InvalidRequest(f"is {self.origin!r}; expected latitude and longitude in degrees", where="origin")

    @classmethod
    def decode(cls, data: bytes) -> Envelope:
        """The envelope that bytes encode.

        Raises
        ------
        InvalidRequest
            The bytes are not an envelope, or too many.
        """
        # Before anything is decoded: the size is all that is known of it.
        if len(data) > MOST_ENVELOPE_BYTES:
            raise InvalidRequest(f"is {len(data)} bytes; at most {MOST_ENVELOPE_BYTES}", where="attachment")
        return decode_json(data, cls, "attachment")

    def remaining_s(self) -> float:
        """Seconds until the deadline; negative once it has passed."""
        return self.deadline_s - time.time()


class StageError(ErrorReply, frozen=True, kw_only=True):
    """An error as a stage replies it (JSON). Replies that are not errors carry the request's id as an attachment.

    Parameters
    ----------
    request_id
        The request that it answers; empty where the request had no id that could be read.
    """

    request_id: str = ""

    @classmethod
    def about(cls, request_id: str, error: ErrorReply) -> StageError:
        """An error in reply to a request.

        Parameters
        ----------
        request_id
            The request that failed; empty where its id could not be read.
        error
            What went wrong.

        Returns
        -------
        StageError
            With the code, message and place of `error`.
        """
        return cls(code=error.code, message=error.message, where=error.where, request_id=request_id)
