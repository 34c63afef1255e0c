"""The spacing of a path: the least for which it is no longer than the mission allows."""

import pytest
from shapely import LineString, box

from oxbow.errors import Infeasible
from oxbow_path.walk.circuit import plan_circuit
from oxbow_path.walk.region import Walk
from oxbow_path.walk.spacing import Budget, fit_spacing
from oxbow_path.walk.trial import Pattern, Trial
from tests.support.path_requests import lake, request


def trial_of(length_m: float, spacing_m: float) -> Trial:
    pattern = Pattern(spacing_m, 1.5, 0.25)
    line = LineString([(0, 0), (length_m, 0)])
    nothing = plan_circuit(request(lake(1)).decomposition.cells, (), trim_m=1.0, inset_m=1.0)
    return Trial(pattern, nothing, Walk(box(0, 0, 1, 1)), line)


@pytest.mark.parametrize("power", [0.6, 1.0, 1.6])
def test_the_spacing_loop_finds_the_length(power):
    budget = Budget(limit_m=1000.0)
    fit = fit_spacing(
        lambda pattern: trial_of(30_000.0 / pattern.spacing_m**power, pattern.spacing_m), 10.0, budget
    )
    assert budget.is_enough(fit.chosen)
    assert len(fit.trials) <= 6


def test_the_spacing_loop_keeps_the_least_spacing():
    budget = Budget(limit_m=1000.0, least_spacing_m=80.0)
    fit = fit_spacing(lambda pattern: trial_of(30_000.0 / pattern.spacing_m, pattern.spacing_m), 10.0, budget)
    assert [trial.pattern.spacing_m for trial in fit.trials] == [80.0]


def test_where_nothing_fits_the_shortest_path_is_named():
    def never_short(pattern: Pattern) -> Trial:
        return trial_of(2000.0 + 1e5 / pattern.spacing_m, pattern.spacing_m)

    with pytest.raises(
        Infeasible, match=r"is 1000 m; expected more than 2002\.\d m: the shortest .* is 2000\.\d m"
    ):
        fit_spacing(never_short, 10.0, Budget(limit_m=1000.0), widest_m=1e4)
