"""Real lakes beside the checkout, and their independent judge: tests that use them run where they are.

The project does not own them, and works without: a clone that stands alone skips these tests and no others.
"""

import importlib.util
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

from tests.support.project import ROOT

__all__ = ["MISSIONS", "REFEREE", "mission_file", "needs_missions", "needs_referee", "referee"]

_SHARED = ROOT / "../shared"
MISSIONS = sorted((_SHARED / "data/missions").glob("*.json"))
REFEREE = _SHARED / "referee/referee.py"

needs_missions = pytest.mark.skipif(not MISSIONS, reason="no real lakes beside the checkout")
needs_referee = pytest.mark.skipif(
    not (MISSIONS and REFEREE.exists()), reason="no real lakes and no judge of them beside the checkout"
)


def mission_file(name: str) -> Path:
    """The Mission File of one lake, as ``N43.9W070.5``."""
    return _SHARED / f"data/missions/lake-{name}.json"


@cache
def referee() -> ModuleType:
    """The judge, which knows nothing of this project."""
    spec = importlib.util.spec_from_file_location("referee", REFEREE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
