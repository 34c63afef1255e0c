"""What happens when a vehicle is lost or a target is new."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oxbow.errors import InvalidRequest
from oxbow_assignment.targets.assign import assign
from oxbow_assignment.targets.problem import Objective, Problem
from oxbow_assignment.targets.reassignment import reassign
from tests.support.target_scenes import problem, random_problem, require_sound, vehicle

quick = settings(max_examples=20)
seeds = st.integers(0, 10_000)


def without_vehicle(scene, lost):
    rows = np.delete(np.arange(len(scene.distances)), [scene.starts[lost], scene.recoveries[lost]])
    fleet = tuple(boat for index, boat in enumerate(scene.vehicles) if index != lost)
    return Problem(fleet, scene.distances[np.ix_(rows, rows)], scene.objective)


def firsts(assignment):
    return {tour.vehicle: tour.targets[:1] for tour in assignment.tours}


@pytest.mark.parametrize("objective", list(Objective))
@quick
@given(seed=seeds, targets=st.integers(1, 25), length_m=st.sampled_from([1_500.0, 1e5]))
def test_the_targets_of_a_lost_vehicle_are_shared_out(objective, seed, targets, length_m):
    scene = random_problem(seed, targets, 3, length_m=length_m, objective=objective)
    tours = [tour.targets for tour in assign(scene).assignment.tours]
    left = without_vehicle(scene, 1)
    found = reassign(left, [tours[0], tours[2]], hysteresis_s=20.0)
    require_sound(left, found.assignment)
    require_sound(left, found.kept)
    if length_m == 1e5:
        assert not found.assignment.unserved


@pytest.mark.parametrize("objective", list(Objective))
@quick
@given(seed=seeds, targets=st.integers(2, 25), hysteresis_s=st.sampled_from([0.0, 5.0, 50.0, 1e9]))
def test_a_current_target_changes_only_for_more_than_the_hysteresis(objective, seed, targets, hysteresis_s):
    """The first target of the scene is new."""
    scene = random_problem(seed, targets, 3, objective=objective)
    random = np.random.default_rng(seed)
    tours = [part.tolist() for part in np.array_split(random.permutation(np.arange(1, targets)), 3)]
    found = reassign(scene, tours, hysteresis_s=hysteresis_s)
    require_sound(scene, found.assignment)
    gain_s = found.kept.cost_s - found.assignment.cost_s
    now, kept = firsts(found.assignment), firsts(found.kept)
    for boat, tour in zip(scene.vehicles, tours, strict=True):
        if tour:
            assert kept[boat.name] == (tour[0],)
            assert (now[boat.name] != (tour[0],)) == (boat.name in found.changed)
    assert gain_s >= -1e-9
    assert not found.changed or gain_s > hysteresis_s * len(found.changed)
    assert hysteresis_s < 1e9 or not found.changed


def test_without_news_nothing_changes():
    scene = random_problem(1, 20, 3)
    before = assign(scene).assignment
    found = reassign(scene, [tour.targets for tour in before.tours], hysteresis_s=0.0)
    assert found.assignment == before
    assert not found.changed


def test_a_new_target_on_the_way_is_visited_first_if_that_is_worth_it():
    """Both vehicles lie west of their targets; the new one is just in front of the first vehicle."""
    fleet = [vehicle((0.0, 0.0), name="near"), vehicle((0.0, 500.0), name="far")]
    scene = problem([(1_000.0, 0.0), (1_000.0, 500.0), (500.0, 10.0)], fleet)
    eager = reassign(scene, [[0], [1]], hysteresis_s=1e-3)
    assert eager.assignment.tours[0].targets[0] == 2
    assert "near" in eager.changed
    assert eager.assignment.cost_s == pytest.approx(assign(scene).assignment.cost_s)
    steady = reassign(scene, [[0], [1]], hysteresis_s=1e6)
    assert steady.assignment.tours[0].targets[0] == 0
    assert steady.assignment.tours[1].targets[0] == 1


def test_a_current_target_gives_way_to_value():
    fleet = [vehicle((0.0, 0.0), length_m=900.0)]
    scene = problem([(400.0, 0.0), (-400.0, 0.0)], fleet, values=np.array([1.0, 5.0]))
    found = reassign(scene, [[0]], hysteresis_s=1e9)
    require_sound(scene, found.assignment)
    assert found.kept.tours[0].targets == (0,)


def test_a_current_target_out_of_reach_is_given_up():
    scene = problem([(400.0, 0.0), (100.0, 0.0)], [vehicle(length_m=500.0)])
    found = reassign(scene, [[0, 1]], hysteresis_s=10.0)
    assert found.assignment.tours[0].targets == (1,)
    assert [unserved.target for unserved in found.assignment.unserved] == [0]
    assert not found.changed


@pytest.mark.parametrize(
    ("tours", "hysteresis_s", "says"),
    [
        ([[0], [1]], -1.0, "hysteresis_s: is -1.0 s"),
        ([[0], [1]], np.nan, "hysteresis_s: is nan s"),
        ([[0]], 0.0, "tours: has 1; expected 2"),
        ([[0], [2]], 0.0, "tours: has target 2; expected 0 to 1"),
        ([[0], [0]], 0.0, "tours: visits target 0 2 times"),
    ],
)
def test_tours_that_do_not_fit_are_named(tours, hysteresis_s, says):
    with pytest.raises(InvalidRequest, match=says):
        reassign(random_problem(1, 2, 2), tours, hysteresis_s=hysteresis_s)
