"""A path method is a function and a row in a table: one that is added here is checked as all others are."""

from oxbow.contracts import Method
from oxbow_path.conformance import require_conforming
from oxbow_path.service import METHODS, handle
from oxbow_path.task import Display, MethodPlan, Task
from oxbow_path.walk.pattern import try_transects
from oxbow_path.walk.trial import Pattern
from tests.support.path_requests import lake, request


def wide_rows(task: Task, display: Display) -> MethodPlan:
    """Transects as coarse as can be: not good, but a path."""
    trial = try_transects(task.waters, Pattern(4 * task.spacing_m))
    display.lines("rows", [trial.path])
    return MethodPlan(trial.path, trial.pattern.spacing_m, trial.pattern.reach_m, ())


def test_a_method_that_is_added_is_planned_by(monkeypatch):
    monkeypatch.setitem(METHODS, Method.TRANSECT, wide_rows)
    layers = []
    asked = request(lake(4), spacings=25, method=Method.TRANSECT)
    plan = handle(asked, layers.append)
    require_conforming(plan.path, asked)
    assert {"rows", "path"} <= {layer.name for layer in layers}
