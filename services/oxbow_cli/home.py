"""Where Oxbow keeps what outlives a command."""

from __future__ import annotations

from pathlib import Path

import platformdirs

__all__ = ["home_folder", "recordings_folder"]


def home_folder(home: Path | None) -> Path:
    """The folder given (``--home`` or ``OXBOW_HOME``), or else the user's state folder."""
    return home or platformdirs.user_state_path("oxbow")


def recordings_folder(home: Path | None) -> Path:
    """Where recordings are kept, one file per mission."""
    return home_folder(home) / "recordings"
