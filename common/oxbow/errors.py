"""The one family of errors that Oxbow raises, and the form in which they travel.

Every error has a closed `code`, a message that names the offending field and value and says what would
be accepted, and `where`: the field, vertex or stage it came from.
"""

from __future__ import annotations

import enum
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import ClassVar

import msgspec

__all__ = [
    "Busy",
    "Cancelled",
    "DeadlineExceeded",
    "ErrorCode",
    "ErrorReply",
    "Infeasible",
    "Internal",
    "InvalidInput",
    "InvalidMission",
    "InvalidOption",
    "InvalidRequest",
    "OxbowError",
    "Unavailable",
    "about_mission",
    "error_text",
    "renamed",
]


class ErrorCode(enum.StrEnum):
    """What went wrong, as a closed set; the command's exit status follows from it."""

    INVALID_MISSION = "invalid_mission"
    INVALID_REQUEST = "invalid_request"
    INVALID_OPTION = "invalid_option"
    INFEASIBLE = "infeasible"
    UNAVAILABLE = "unavailable"
    BUSY = "busy"
    TIMEOUT = "timeout"
    CANCELLED = "cancelled"
    INTERNAL = "internal"


class OxbowError(Exception):
    """Base of all errors that Oxbow raises on purpose."""

    code: ClassVar[ErrorCode] = ErrorCode.INTERNAL

    def __init__(self, message: str, where: str = "") -> None:
        super().__init__(message, where)
        self.message = message
        self.where = where

    def __str__(self) -> str:
        return f"{self.where}: {self.message}" if self.where else self.message


def error_text(error: BaseException) -> str:
    """Kind and text of an unexpected exception, even of one whose own `str` fails."""
    return "".join(traceback.format_exception_only(error)).strip()


@contextmanager
def about_mission() -> Iterator[None]:
    """Report a request that breaks its contract as a fault of the mission that it was made from."""
    try:
        yield
    except InvalidRequest as error:
        raise InvalidMission(error.message, error.where) from error


@contextmanager
def renamed(fields: Mapping[str, str]) -> Iterator[None]:
    """Rename the fields in errors raised within to the names that the user knows them by.

    Parameters
    ----------
    fields
        The user's name of each field; other fields keep theirs.
    """
    try:
        yield
    except OxbowError as error:
        raise type(error)(error.message, fields.get(error.where, error.where)) from error


class InvalidInput(OxbowError):
    """Base of the errors of whoever asked: what they gave breaks a rule, and would break it again."""


class InvalidMission(InvalidInput):
    """A mission breaks a rule of the Mission File."""

    code = ErrorCode.INVALID_MISSION


class InvalidRequest(InvalidInput):
    """A message, a key or an argument of a function breaks its contract."""

    code = ErrorCode.INVALID_REQUEST


class InvalidOption(InvalidInput):
    """An option of a command, a setting of a process or a file that one of them names cannot be used."""

    code = ErrorCode.INVALID_OPTION


class Infeasible(OxbowError):
    """The input is well formed, but no plan can satisfy it."""

    code = ErrorCode.INFEASIBLE


class Unavailable(OxbowError):
    """No service answered, after every retry that the deadline allowed."""

    code = ErrorCode.UNAVAILABLE


class Busy(OxbowError):
    """The service's queue is full: try again later."""

    code = ErrorCode.BUSY


class DeadlineExceeded(OxbowError):
    """The deadline passed before an answer came."""

    code = ErrorCode.TIMEOUT


class Cancelled(OxbowError):
    """The caller has withdrawn the request."""

    code = ErrorCode.CANCELLED


class Internal(OxbowError):
    """A fault of Oxbow itself."""

    code = ErrorCode.INTERNAL


BY_CODE: dict[ErrorCode, type[OxbowError]] = {
    kind.code: kind
    for kind in (
        InvalidMission,
        InvalidRequest,
        InvalidOption,
        Infeasible,
        Unavailable,
        Busy,
        DeadlineExceeded,
        Cancelled,
        Internal,
    )
}


MOST_TEXT = 10_000
"""The most characters of an error's message that are sent."""


class ErrorReply(msgspec.Struct, frozen=True, kw_only=True):
    """An error as it travels on the bus (JSON)."""

    code: ErrorCode
    message: str
    where: str = ""

    @classmethod
    def of(cls, error: OxbowError) -> ErrorReply:
        """An error in a form that can be sent, whatever text it quotes."""
        return cls(code=error.code, message=_sendable(error.message), where=_sendable(error.where))

    def error(self) -> OxbowError:
        """The exception to raise at the caller's side."""
        return BY_CODE[self.code](self.message, self.where)


def _sendable(text: str) -> str:
    """`text` without lone surrogates, which UTF-8 cannot encode, and cut off where it is too long to be read."""
    shown = text if len(text) <= MOST_TEXT else f"{text[:MOST_TEXT]}... ({len(text)} characters)"
    return shown.encode(errors="replace").decode()
