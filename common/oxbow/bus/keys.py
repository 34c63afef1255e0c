"""Which keys may be handed to zenoh."""

from __future__ import annotations

from oxbow.errors import InvalidRequest
from oxbow.ids import excerpt

__all__ = ["MOST_KEY_BYTES", "require_key"]

MOST_KEY_BYTES = 4096
"""The key of an id of 128 characters, percent-encoded, is far shorter."""


def require_key(key: str) -> None:
    """Refuse a key at which zenoh would panic, and take the whole session with it.

    Raises
    ------
    InvalidRequest
        It is longer than `MOST_KEY_BYTES`, or is not Unicode.
    """
    # A lone surrogate cannot be encoded: let through to be counted, and refused below with a message.
    size = len(key.encode(errors="surrogatepass"))
    if size > MOST_KEY_BYTES or any("\ud800" <= character <= "\udfff" for character in key):
        raise InvalidRequest(
            f"is {excerpt(key)}, {size} bytes; expected at most {MOST_KEY_BYTES} bytes of Unicode", where="key"
        )
