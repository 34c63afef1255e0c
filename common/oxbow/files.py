"""Whole files: read within a limit, replaced in one step."""

from __future__ import annotations

import os
import secrets
import stat
from pathlib import Path

from oxbow.errors import InvalidMission

__all__ = ["read_bytes", "write_atomically"]


def read_bytes(path: Path, limit: int) -> bytes:
    """A file's content; `InvalidMission` where it cannot be read or holds more than `limit` bytes."""
    try:
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except OSError as error:
        raise InvalidMission(f"cannot be read: {error.strerror}", where=str(path)) from error
    if len(data) > limit:
        raise InvalidMission(f"is larger than {limit} bytes", where=str(path))
    return data


def write_atomically(path: Path, data: bytes) -> None:
    """Replace a file's content in one step: readers see the old content or the new, never a part.

    The new content is complete and on the disk before it takes the old one's place. A symbolic link keeps
    pointing to the file it points to, and the file keeps its permissions.

    Raises
    ------
    OSError
        The file cannot be written, or is no regular file; the old content stays, and nothing is left behind.
    """
    target = path.resolve()
    if target.exists() and not target.is_file():
        raise OSError(f"{path} is not a regular file")
    scratch = target.with_name(f".oxbow-{secrets.token_hex(8)}.tmp")
    try:
        with scratch.open("xb") as file:
            file.write(data)
            file.flush()
            if target.exists():
                os.fchmod(file.fileno(), stat.S_IMODE(target.stat().st_mode))
            os.fsync(file.fileno())
        scratch.replace(target)
    finally:
        scratch.unlink(missing_ok=True)
    _sync_folder(target.parent)


def _sync_folder(folder: Path) -> None:
    """Make the replacement itself outlive a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
