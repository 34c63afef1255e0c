"""Writing to stdout and stderr, whatever characters these can show."""

from __future__ import annotations

import io
import sys

__all__ = ["print_utf8", "tolerate_any_text"]


def tolerate_any_text() -> None:
    """Write characters that a terminal's encoding lacks as escapes, instead of raising an exception."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def print_utf8(document: bytes) -> None:
    """Write a document to stdout byte by byte: JSON is UTF-8, whatever the terminal's encoding is."""
    sys.stdout.flush()
    sys.stdout.buffer.write(document)
    sys.stdout.buffer.flush()
