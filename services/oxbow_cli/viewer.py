"""Opening a recording in the viewer, which runs as a program of its own and is not imported."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from oxbow.contracts import checked_id
from oxbow.errors import InvalidOption

__all__ = ["find_recording", "open_recording"]

MOST_NAMED = 20
"""At most this many recordings are named in an error."""

_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


def find_recording(name: str, folder: Path) -> Path:
    """The recording of a mission.

    Parameters
    ----------
    name
        A mission's ID, or the path of a recording, which ends in .rrd.
    folder
        Where recordings are kept.

    Returns
    -------
    Path
        Of a file that exists.

    Raises
    ------
    InvalidOption
        There is no such recording, or the name is not an ID; names some that exist.
    """
    # An id has passed `checked_id`, so that it cannot lead out of the folder; a path is the user's own.
    path = Path(name) if name.endswith(".rrd") else folder / f"{checked_id(name, where='ID')}.rrd"
    try:
        if path.is_file():
            return path
        kept = sorted(file.stem for file in path.parent.glob("*.rrd") if not file.name.startswith("."))
    except OSError as error:
        raise InvalidOption(f"cannot be read: {error.strerror}", where=name) from error
    others = f" and {len(kept) - MOST_NAMED} more" if len(kept) > MOST_NAMED else ""
    there = f"; there are {', '.join(kept[:MOST_NAMED])}{others}" if kept else ""
    raise InvalidOption(f"no recording at {path}{there}", where=name)


def open_recording(path: Path) -> int:
    """Show a recording in the rerun viewer until it is closed; return the viewer's exit status.

    Without a screen, it only says how to open the recording.
    """
    command = [sys.executable, "-m", "rerun", str(path)]
    print(path)
    if sys.platform != "darwin" and not any(map(os.environ.get, _SCREENS)):
        print("no screen; copy the file to a machine with one, and open it with: rerun", path.name)
        print("or serve it to a browser from this machine with:", *command, "--serve-web")
        return 0
    return subprocess.run(command, check=False).returncode
