"""Whole files: read within a limit, replaced in one step."""

from __future__ import annotations

import os
import secrets
import shutil
import stat
from pathlib import Path

from oxbow.errors import InvalidOption

__all__ = ["move_into_place", "read_bytes", "write_atomically"]

_PIPE_BYTES = 65_536


def read_bytes(path: Path, limit: int) -> bytes:
    """A file's content.

    Of a pipe, what is written to it until its end; a device, or a pipe that nobody writes to, is refused rather
    than waited for.

    Parameters
    ----------
    path
        A file or a pipe.
    limit
        The most bytes to accept.

    Returns
    -------
    bytes
        All of it; empty for an empty file.

    Raises
    ------
    InvalidOption
        It cannot be read, or holds more than `limit` bytes.
    """
    try:
        # To open a pipe that has no writer would wait for one otherwise.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        with open(descriptor, "rb") as file:  # noqa: PTH123 - what is open already
            data = _begun(descriptor, str(path))
            # What follows may wait for a writer: it is there, and its end of file will come.
            os.set_blocking(descriptor, True)
            data += file.read(limit + 1 - len(data))  # one byte more shows that the file is too large
    except OSError as error:
        raise InvalidOption(f"cannot be read: {error.strerror}", where=str(path)) from error
    if len(data) > limit:
        raise InvalidOption(f"is larger than {limit} bytes", where=str(path))
    return data


def _begun(descriptor: int, name: str) -> bytes:
    """What a pipe holds now; nothing of a regular file. What could be waited for without end is refused."""
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISCHR(mode) or stat.S_ISBLK(mode):
        raise InvalidOption("cannot be read: is a device; expected a file", where=name)
    if not stat.S_ISFIFO(mode):
        return b""
    try:
        data = os.read(descriptor, _PIPE_BYTES)
    except BlockingIOError:  # there is a writer
        return b""
    if not data:
        raise InvalidOption("cannot be read: is a pipe that nobody writes to", where=name)
    return data


def write_atomically(path: Path, data: bytes) -> None:
    """Replace a file's content in one step: readers see the old content or the new, never a part.

    The new content is complete and on the disk before it takes the old one's place. A symbolic link keeps
    pointing to the file it points to, and the file keeps its permissions.

    Parameters
    ----------
    path
        The file, which need not exist; its folder must.
    data
        All of its new content.

    Raises
    ------
    OSError
        The file cannot be written, or is no regular file; the old content stays, and nothing is left behind.
    """
    target = path.resolve()
    if target.exists() and not target.is_file():
        raise OSError(f"{path} is not a regular file")
    # In the same folder: only within one file system is a rename a single step.
    scratch = target.with_name(f".oxbow-{secrets.token_hex(8)}.tmp")
    try:
        with scratch.open("xb") as file:
            file.write(data)
            file.flush()
            if target.exists():
                os.fchmod(file.fileno(), stat.S_IMODE(target.stat().st_mode))
            # Before the rename: some file systems put the new name on the disk before the new content.
            os.fsync(file.fileno())
        scratch.replace(target)
    finally:
        scratch.unlink(missing_ok=True)
    _sync_folder(target.parent)


def move_into_place(source: Path, target: Path) -> None:
    """Move a file, to another file system too, in one step for those who read the target.

    Parameters
    ----------
    source
        The file to move, which is gone afterwards.
    target
        Where it goes; a file there is replaced.

    Raises
    ------
    OSError
        It cannot be moved; what was there stays, and nothing is left beside it.
    """
    # Beside the target first: `shutil.move` copies across file systems, and readers must not see half a copy.
    scratch = target.with_name(f".oxbow-{secrets.token_hex(8)}.tmp")
    try:
        shutil.move(source, scratch)
        scratch.replace(target)
    finally:
        scratch.unlink(missing_ok=True)


def _sync_folder(folder: Path) -> None:
    """Make the replacement itself outlive a power cut: a rename changes the folder, which has its own cache."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
