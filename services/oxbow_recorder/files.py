"""Where recordings are kept, and where they are written until they are whole."""

from __future__ import annotations

import hashlib
import logging
import re
import time
from pathlib import Path

from oxbow.errors import InvalidRequest
from oxbow_recorder.address import RecordedRun

__all__ = ["holds", "part_path", "recording_id", "recording_path", "sweep"]

ABANDONED_S = 24 * 3600.0
"""A part to which nothing was added for this long is abandoned: the recorder that wrote it was killed."""

_HEAD_BYTES = 2**18
"""The part of a recording in which its id stands, after 64 KiB of blueprint."""

_PART = re.compile(r"\.[A-Za-z0-9_.-]+\.part\.rrd")
_log = logging.getLogger("oxbow_recorder")


def recording_path(folder: Path, run: RecordedRun) -> Path:
    """Where the recording of a run ends up; an older one of its mission is replaced as a whole.

    Parameters
    ----------
    folder
        Where recordings are kept.
    run
        The run.

    Returns
    -------
    Path
        ``FOLDER/{mission}.rrd``.

    Raises
    ------
    InvalidRequest
        The mission's id would lead out of the folder.
    """
    return _within(folder, f"{run.mission_id}.rrd")


def part_path(folder: Path, run: RecordedRun) -> Path:
    """Where the recording of a run is written until it is finished.

    Parameters
    ----------
    folder
        Where recordings are kept.
    run
        The run.

    Returns
    -------
    Path
        A hidden file in the same folder, so that finishing it is a rename.

    Raises
    ------
    InvalidRequest
        The mission's id would lead out of the folder.
    """
    # Names of files are limited to 255 bytes: two ids of 128 characters are too long for one.
    digest = hashlib.sha256(run.run_id.encode()).hexdigest()[:16]
    return _within(folder, f".{run.mission_id}.{digest}.part.rrd")


def recording_id(run: RecordedRun) -> str:
    """The id by which viewers distinguish recordings, found in the head of its file; none is part of another."""
    return f"{run.mission_id} ({run.run_id})"


def holds(path: Path, run: RecordedRun) -> bool:
    """Whether there is a recording of this very run, perhaps by another process.

    Parameters
    ----------
    path
        The file, which need not exist.
    run
        The run.

    Returns
    -------
    bool
        False also where there is no file, or it cannot be read.
    """
    try:
        with path.open("rb") as file:
            return recording_id(run).encode() in file.read(_HEAD_BYTES)
    except OSError:
        return False


def _within(folder: Path, name: str) -> Path:
    path = folder / name
    # Ids are checked where they come in; this is the last line, next to the file system.
    if path.parent.resolve() != folder.resolve():
        raise InvalidRequest(f"is {name!r}; expected the name of a file", where="recording")
    return path


def sweep(folder: Path) -> None:
    """Remove what killed recorders left behind long ago."""
    oldest_s = time.time() - ABANDONED_S
    for path in folder.glob(".*"):
        try:
            if _PART.fullmatch(path.name) and path.is_file() and path.stat().st_mtime < oldest_s:
                path.unlink()
                _log.info("removed %s, which was left behind", path)
        except OSError as error:
            _log.warning("%s cannot be removed: %s", path, error)
