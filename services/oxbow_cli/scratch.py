"""A folder for as long as a command needs it; what killed commands have left is removed by the next one."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["scratch_folder"]

_PREFIX = "oxbow-plan-"
_LEAST_AGE_S = 60.0
"""Younger folders stay: their owner may be about to lock them, and its children may still be ending."""


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A temporary folder, locked by this process for as long as it lives."""
    # Here and not at the end: a command that is killed cannot clean up, but the next one can.
    _sweep(Path(tempfile.gettempdir()))
    with tempfile.TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True) as name:
        descriptor = os.open(name, os.O_RDONLY | os.O_DIRECTORY)
        try:
            # The kernel releases the lock however the process ends: what is not locked is abandoned.
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            yield Path(name)
        finally:
            os.close(descriptor)


def _sweep(folder: Path) -> None:
    """Remove this user's folders of that name that no process holds a lock on."""
    with suppress(OSError):
        for entry in list(os.scandir(folder)):
            if entry.name.startswith(_PREFIX):
                with suppress(OSError):
                    _remove_left(entry)


def _remove_left(entry: os.DirEntry[str]) -> None:
    status = entry.stat(follow_symlinks=False)
    is_old = time.time() - status.st_mtime > _LEAST_AGE_S
    if not (entry.is_dir(follow_symlinks=False) and status.st_uid == os.getuid() and is_old):
        return
    # Others can write to the folder of temporary files as well: a symbolic link must not be followed out of it.
    descriptor = os.open(entry.path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(entry.path, ignore_errors=True)
    finally:
        os.close(descriptor)
