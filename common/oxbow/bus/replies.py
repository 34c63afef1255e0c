"""Errors that come back from the bus, as exceptions."""

from __future__ import annotations

import zenoh

from oxbow.bus.query import JSON
from oxbow.errors import DeadlineExceeded, ErrorCode, InvalidRequest, OxbowError
from oxbow.wire.envelope import StageError
from oxbow.wire.strict_json import decode_json

__all__ = ["error_of", "error_of_reply", "is_timeout"]


def error_of(reply: zenoh.ReplyError, selector: str, timeout_s: float) -> OxbowError:
    """The exception that an error reply stands for.

    Parameters
    ----------
    reply
        Zenoh's time-out, or an error in JSON.
    selector
        What was asked, for errors.
    timeout_s
        How many seconds the answer was waited for, for errors.

    Returns
    -------
    OxbowError
        To be raised by the caller; `DeadlineExceeded` for zenoh's own time-out.
    """
    if is_timeout(reply):
        return DeadlineExceeded(f"no answer within {timeout_s:.1f} s", where=selector)
    return error_of_reply(reply, selector).error()


def is_timeout(reply: zenoh.ReplyError) -> bool:
    """Whether an error is zenoh's own, which is plain text; of these, only the time-out reaches a caller."""
    return str(reply.encoding) != JSON


def error_of_reply(reply: zenoh.ReplyError, selector: str) -> StageError:
    """The error that was replied; one that cannot be read is `internal`.

    Parameters
    ----------
    reply
        An error in JSON.
    selector
        What was asked, which is where an unreadable error is said to have happened.

    Returns
    -------
    StageError
        With the code `internal` where the reply was no such error.
    """
    try:
        return decode_json(reply.payload.to_bytes(), StageError, "error")
    except InvalidRequest as error:
        return StageError(
            code=ErrorCode.INTERNAL, message=f"replied an error that cannot be read: {error}", where=selector
        )
