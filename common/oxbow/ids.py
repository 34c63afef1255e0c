"""Ids from outside that go into keys and file names: short, and without characters that have a meaning there."""

from __future__ import annotations

import re

from oxbow.errors import InvalidRequest

__all__ = ["MOST_ID_CHARACTERS", "checked_id", "excerpt"]

MOST_ID_CHARACTERS = 128
"""Zenoh panics on keys of some 65 530 characters, and file systems take names of 255."""

_SHOWN_CHARACTERS = 40
_ID = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]*")


def checked_id(text: str, where: str = "id") -> str:
    """`text`, if it is fit for one chunk of a key expression and for the name of a file.

    Parameters
    ----------
    text
        An id from outside.
    where
        The field that it comes from, for the error.

    Returns
    -------
    str
        The text as it was given: nothing is trimmed or replaced.

    Raises
    ------
    InvalidRequest
        It is empty, too long, begins with ``.`` or ``@``, or has a character that is not accepted.
    """
    # The length first: no pattern is matched against megabytes from outside.
    if len(text) <= MOST_ID_CHARACTERS and _ID.fullmatch(text):
        return text
    accepted = f"expected 1 to {MOST_ID_CHARACTERS} of A-Z a-z 0-9 _ . -"
    if text.startswith((".", "@")):
        accepted = f"{accepted}, none that begins with {text[0]!r}"
    raise InvalidRequest(f"is {excerpt(text)}; {accepted}", where=where)


def excerpt(text: str) -> str:
    """`text` in quotes for an error message, its end cut off where it is long."""
    if len(text) <= MOST_ID_CHARACTERS:
        return repr(text)
    return f"{text[:_SHOWN_CHARACTERS]!r}... ({len(text)} characters)"
