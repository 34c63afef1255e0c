"""The command as a user runs it: a process of its own, in a folder of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.warm_commands import WarmCommands

OXBOW = (sys.executable, "-m", "oxbow_cli")

LAT, LONG = 44.6, -73.4
M_LAT, M_LONG = 1 / 111_132, 1 / 79_400
"""Degrees a metre at the pond, about."""


def place(x_m: float, y_m: float) -> dict[str, float]:
    """A position near the pond's south-west corner."""
    return {"lat": LAT + y_m * M_LAT, "long": LONG + x_m * M_LONG}


def make_pond(**fields: Any) -> dict[str, Any]:
    """A pond of 400 m by 300 m with an island, and a path of 6 km to plan in it."""
    outline = [(0, 0), (200, -20), (400, 0), (400, 300), (180, 320), (0, 300)]
    island = [(150, 120), (220, 110), (230, 170), (160, 180)]
    return {
        "MissionType": "map",
        "SiteName": "Pond",
        "LaunchPoint": place(30, 40),
        "BoundingBox": [place(x, y) for x, y in outline],
        "ForbiddenZones": [[place(x, y) for x, y in island]],
        "Master_length": 6000.0,
        "Safety": 5.0,
        "note": "kept",
    } | fields


def make_rows(step_m: float = 20.0) -> list[dict[str, float]]:
    """A hand-made path through the pond, rows apart by `step_m`: it crosses the island, and its own way home."""
    path = [place(30, 40)]
    for row in range(int(260 / step_m)):
        y = 20 + row * step_m
        path += [place(x, y) for x in ((20, 380) if row % 2 == 0 else (380, 20))]
    return [*path, place(30, 40)]


@pytest.fixture
def pond() -> Callable[..., dict[str, Any]]:
    """Make a Mission File, with fields replaced."""
    return make_pond


@pytest.fixture
def rows() -> list[dict[str, float]]:
    return make_rows()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder that holds the pond's Mission File, pond.json, with a path that is soon planned."""
    (tmp_path / "pond.json").write_text(json.dumps(make_pond(Master_length=2500.0)))
    return tmp_path


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """No screen, no terminal's width, and a home that is the test's own."""
    kept = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return {**kept, "OXBOW_HOME": str(tmp_path / "home"), "COLUMNS": "160", "NO_COLOR": "1"}


@pytest.fixture(scope="session")
def warm_commands() -> Iterator[WarmCommands]:
    with WarmCommands() as commands:
        yield commands


@pytest.fixture
def oxbow(
    folder: Path,
    environment: dict[str, str],
    warm_commands: WarmCommands,
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run the command to its end; with an environment of its own, from the interpreter's first line on."""

    def run(*arguments: object, **more: str) -> subprocess.CompletedProcess[str]:
        given = [str(argument) for argument in arguments]
        if not more:
            output = tmp_path_factory.mktemp("output")
            return warm_commands.run(given, cwd=folder, env=environment, output=output)
        return subprocess.run(
            [*OXBOW, *given],
            cwd=folder,
            env=environment | more,
            capture_output=True,
            text=True,
            timeout=100,
            check=False,
        )

    return run
