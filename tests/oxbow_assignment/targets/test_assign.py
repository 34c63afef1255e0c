"""Targets shared out among vehicles, and the joint optimiser."""

from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oxbow.contracts import Role, Vehicle
from oxbow.errors import InvalidRequest, Unavailable
from oxbow_assignment.targets import joint
from oxbow_assignment.targets.assign import Clustering, ClusterMethod, assign
from oxbow_assignment.targets.assignment import assignment_of
from oxbow_assignment.targets.clustering import k_means
from oxbow_assignment.targets.matching import match
from oxbow_assignment.targets.problem import Objective, Problem
from oxbow_assignment.targets.pseudo_coordinates import pseudo_coordinates
from tests.support.target_scenes import problem, random_problem, require_sound, vehicle

quick = settings(max_examples=20)
seeds = st.integers(0, 10_000)
needs_pyvrp = pytest.mark.skipif(not joint.is_available(), reason="needs the extra `fleet`")

CLUSTERINGS = (
    Clustering(),
    Clustering(method=ClusterMethod.FUZZY_C_MEANS, k=3),
    Clustering(method=ClusterMethod.RADIUS, radius_m=150.0),
)


def optimum(scene):
    """The best of all assignments: which vehicle has each target, in every order."""
    best = (0.0, np.inf)
    orders = {}
    for owners in product(range(-1, len(scene.vehicles)), repeat=scene.count):
        durations = []
        for index, boat in enumerate(scene.vehicles):
            own = tuple(target for target, owner in enumerate(owners) if owner == index)
            if (index, own) not in orders:
                orders[index, own] = shortest(scene, index, own)
            durations.append(orders[index, own] / boat.speed_mps)
        value = -sum(scene.values[target] for target, owner in enumerate(owners) if owner >= 0)
        cost = max(durations) if scene.objective is Objective.MAKESPAN else sum(durations)
        if np.isfinite(cost):
            best = min(best, (value, cost))
    return -best[0], best[1]


def shortest(scene, index, targets):
    if not targets:
        return 0.0
    if not scene.has_role[index, list(targets)].all():
        return np.inf
    paths = (scene.path(index, order) for order in permutations(targets))
    length_m = min(scene.distances[path[:-1], path[1:]].sum() for path in paths)
    return length_m if length_m <= scene.vehicles[index].length_m else np.inf


@pytest.mark.parametrize("clustering", CLUSTERINGS)
@pytest.mark.parametrize("objective", list(Objective))
@quick
@given(
    seed=seeds,
    targets=st.integers(0, 40),
    vehicles=st.integers(1, 5),
    length_m=st.sampled_from([400.0, 1_500.0, 1e5]),
)
def test_every_assignment_is_sound(objective, clustering, seed, targets, vehicles, length_m):
    scene = random_problem(seed, targets, vehicles, length_m=length_m, objective=objective)
    require_sound(scene, assign(scene, clustering).assignment)


@quick
@given(seed=seeds, targets=st.integers(1, 30), data=st.data())
def test_roles_and_values_are_kept_to(seed, targets, data):
    roles = tuple(data.draw(st.lists(st.sampled_from([None, *Role]), min_size=targets, max_size=targets)))
    values = np.random.default_rng(seed).uniform(0.1, 10.0, targets)
    fleet = [vehicle((300.0 * i, 0.0), name=f"{i}", role=list(Role)[i % 2], length_m=2_000.0) for i in range(3)]
    places = np.random.default_rng(seed).uniform(0.0, 1_000.0, (targets, 2))
    scene = problem(places, fleet, roles=roles, values=values)
    require_sound(scene, assign(scene).assignment)


@pytest.mark.parametrize("objective", list(Objective))
def test_clusters_come_near_the_optimum_of_small_scenes(objective):
    gaps = []
    for seed in range(25):
        scene = random_problem(seed, 5, 2, objective=objective)
        assignment = assign(scene).assignment
        value, cost_s = optimum(scene)
        assert assignment.value == value
        assert assignment.cost_s >= cost_s - 1e-6
        gaps.append(assignment.cost_s / cost_s - 1.0)
    assert np.median(gaps) <= 0.02
    assert np.mean(gaps) <= 0.08


def test_scarce_range_goes_to_value():
    for seed in range(10):
        values = np.random.default_rng(seed).uniform(1.0, 5.0, 5)
        scene = random_problem(seed, 5, 2, length_m=1_200.0, values=values)
        value, _ = optimum(scene)
        assert assign(scene).assignment.value >= 0.7 * value


def test_an_assignment_does_not_depend_on_anything_but_the_problem_and_the_seed():
    scene = random_problem(3, 50, 4)
    assert assign(scene).assignment == assign(scene).assignment


def test_two_groups_go_to_the_vehicles_beside_them():
    west, east = np.random.default_rng(0).uniform(0.0, 100.0, (2, 10, 2))
    fleet = [vehicle((5_100.0, 50.0), name="east"), vehicle((0.0, 50.0), name="west")]
    tours = assign(problem(np.vstack([west, east + np.array([5_000.0, 0.0])]), fleet)).assignment.tours
    assert set(tours[1].targets) == set(range(10))
    assert set(tours[0].targets) == set(range(10, 20))


def test_the_match_is_the_cheapest_of_all():
    """The Hungarian method on mean costs, against every assignment of clusters."""
    for seed in range(10):
        scene = random_problem(seed, 20, 4)
        targets = np.arange(20)
        clusters = k_means(pseudo_coordinates(scene.distances[:20, :20]), 4, seed=seed)
        means = np.array(
            [scene.distances[np.ix_(scene.starts, targets[clusters.labels == c])].mean(axis=1) for c in range(4)]
        ).T
        costs = means / scene.speeds_mps[:, None]
        owners = match(scene, clusters, targets)
        cheapest = min(costs[list(order), range(4)].sum() for order in permutations(range(4)))
        assert costs[owners, range(4)].sum() == pytest.approx(cheapest)


@pytest.mark.parametrize(("clusters", "busy"), [(2, 2), (9, 4)])
def test_fewer_and_more_clusters_than_vehicles_are_matched(clusters, busy):
    scene = random_problem(1, 30, 4)
    found = k_means(pseudo_coordinates(scene.distances[:30, :30]), clusters)
    owners = match(scene, found, np.arange(30))
    assert owners.shape == (clusters,)
    counts = np.bincount(owners, minlength=4)
    assert (counts > 0).sum() == busy
    assert counts.max() - counts[counts > 0].min() <= 1


def test_a_faster_vehicle_does_more_of_the_work():
    places = np.random.default_rng(0).uniform(0.0, 1_000.0, (40, 2))
    fleet = [vehicle(name="slow"), vehicle(name="fast", speed_mps=3.0)]
    slow, fast = assign(problem(places, fleet, objective=Objective.MAKESPAN)).assignment.tours
    assert fast.length_m > 2.0 * slow.length_m
    assert fast.duration_s == pytest.approx(slow.duration_s, rel=0.3)


def test_the_makespan_is_shared_where_the_total_is_not():
    places = np.random.default_rng(0).uniform(0.0, 1_000.0, (40, 2))
    fleet = [vehicle(name=name) for name in "abcd"]
    total = assign(problem(places, fleet)).assignment
    makespan = assign(problem(places, fleet, objective=Objective.MAKESPAN)).assignment
    assert makespan.makespan_s < 0.6 * total.makespan_s
    assert makespan.total_duration_s >= total.total_duration_s


@pytest.mark.parametrize(
    ("target", "role", "says", "detour_m"),
    [
        ((3_000.0, 0.0), None, "'boat' would travel 6000 m and may travel 1000 m", 6_000.0),
        ((10.0, 0.0), Role.MASTER, "asks for a master, and no vehicle is one", np.inf),
    ],
)
def test_a_target_that_nobody_can_visit_is_reported(target, role, says, detour_m):
    scene = problem([target, (100.0, 0.0)], [vehicle(length_m=1_000.0)], roles=(role, None))
    assignment = assign(scene).assignment
    assert assignment.tours[0].targets == (1,)
    (unserved,) = assignment.unserved
    assert unserved.target == 0
    assert says in unserved.reason
    assert unserved.detour_m == (pytest.approx(5_800.0) if np.isfinite(detour_m) else np.inf)


def test_a_target_without_a_route_is_reported():
    scene = problem([(50.0, 0.0), (100.0, 0.0)], [vehicle()])
    distances = scene.distances.copy()
    distances[0, 1:] = distances[1:, 0] = np.inf
    (unserved,) = assign(Problem(scene.vehicles, distances)).assignment.unserved
    assert unserved.target == 0
    assert "no route leads to it" in unserved.reason


def test_a_target_for_which_no_range_is_left_is_reported():
    scene = problem([(400.0, 0.0), (-400.0, 0.0)], [vehicle(length_m=1_000.0)])
    (unserved,) = assign(scene).assignment.unserved
    assert "lengthen the tour of 'boat' by 800 m, and 200 m are left" in unserved.reason


@pytest.mark.parametrize("objective", list(Objective))
def test_a_target_at_the_very_end_of_the_range_is_visited(objective):
    fleet = [vehicle((0.1, 0.2), name="here", length_m=1_000.0), vehicle((2_000.0, 0.2), name="there")]
    scene = problem([(500.1, 0.2), (0.1, 500.2)], [fleet[0]], objective=objective)
    assert len(assign(scene).assignment.tours[0].targets) == 1
    assert not assign(problem([(500.1, 0.2), (0.1, 500.2)], fleet, objective=objective)).assignment.unserved


def test_vehicles_without_a_route_between_them_each_serve_their_side():
    places = np.random.default_rng(0).uniform(0.0, 100.0, (12, 2))
    scene = problem(places, [vehicle(name="here"), vehicle(name="there")])
    distances = scene.distances.copy()
    sides = np.array([0, 1] * 6 + [0, 1] * 2)
    distances[sides[:, None] != sides[None, :]] = np.inf
    assignment = assign(Problem(scene.vehicles, distances)).assignment
    assert [set(tour.targets) for tour in assignment.tours] == [set(range(0, 12, 2)), set(range(1, 12, 2))]


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"length_m": 0.0}, "vehicle 'boat': length_m: is 0.0; expected a finite number, > 0"),
        ({"length_m": np.inf}, "vehicle 'boat': length_m: is inf"),
        ({"speed_mps": -1.0}, "vehicle 'boat': speed_mps: is -1.0"),
        ({"start": (np.nan, 0.0)}, "vehicle 'boat': start: is \\(nan, 0.0\\)"),
        ({"name": ""}, "name: is empty"),
    ],
)
def test_a_vehicle_that_cannot_be_is_named(fields, says):
    right = {"name": "boat", "length_m": 1.0, "start": (0.0, 0.0), "recovery": (0.0, 0.0)}
    with pytest.raises(InvalidRequest, match=says):
        Vehicle(**(right | fields))


@pytest.mark.parametrize(
    ("ask", "says"),
    [
        (lambda: Problem((), np.zeros((0, 0))), "vehicles: is empty"),
        (lambda: problem([], [vehicle(), vehicle()]), "2 vehicles are named 'boat'"),
        (lambda: Problem((vehicle(),), np.zeros((1, 1))), "has 1 rows; expected at least 2"),
        (lambda: problem([(1.0, 1.0)], [vehicle()], values=np.zeros(1)), "values: expected 1 finite numbers > 0"),
        (lambda: problem([(1.0, 1.0)], [vehicle()], roles=(None, None)), "roles: has 2; expected 1"),
        (lambda: Clustering(method=ClusterMethod.RADIUS), "radius_m: is None"),
        (lambda: Clustering(radius_m=3.0), "radius_m: is 3.0"),
        (lambda: Clustering(k=0), "k: is 0"),
        (lambda: Clustering(starts=0), "starts: is 0"),
        (lambda: Clustering(method=ClusterMethod.RADIUS, radius_m=1.0, k=2), "k: is 2"),
    ],
)
def test_bad_requests_are_named(ask, says):
    with pytest.raises(InvalidRequest, match=says):
        ask()


@needs_pyvrp
@pytest.mark.parametrize("objective", list(Objective))
def test_the_joint_optimiser_finds_the_optimum_of_small_scenes(objective):
    for seed in range(4):
        scene = random_problem(seed, 5, 2, length_m=2_500.0, objective=objective)
        found = joint.optimise(scene, patience=50)
        require_sound(scene, found)
        value, cost_s = optimum(scene)
        assert found.value == value
        assert found.cost_s == pytest.approx(cost_s, rel=joint.PRECISION)


@needs_pyvrp
@quick
@given(seed=seeds, targets=st.integers(0, 15), data=st.data(), length_m=st.sampled_from([700.0, 1e5]))
def test_the_joint_optimiser_keeps_to_ranges_and_roles(seed, targets, data, length_m):
    roles = tuple(data.draw(st.lists(st.sampled_from([None, *Role]), min_size=targets, max_size=targets)))
    fleet = [vehicle((300.0 * i, 0.0), name=f"{i}", role=list(Role)[i % 2], length_m=length_m) for i in range(3)]
    scene = problem(np.random.default_rng(seed).uniform(0.0, 1_000.0, (targets, 2)), fleet, roles=roles)
    require_sound(scene, joint.optimise(scene, patience=20))


@needs_pyvrp
def test_the_gap_to_the_joint_optimiser_is_told():
    scene = random_problem(1, 25, 3)
    solution = joint.solve(scene, patience=200)
    clustered = solution.clustered.assignment
    assert solution.joint is not None
    assert solution.gap.relative == pytest.approx(clustered.cost_s / solution.joint.cost_s - 1.0)
    assert solution.best.cost_s == min(clustered.cost_s, solution.joint.cost_s)
    assert joint.solve(scene, patience=200).joint == solution.joint


def test_why_there_is_no_gap_is_told(monkeypatch):
    scene = random_problem(1, 10, 2)
    assert joint.solve(scene, patience=None).gap == joint.Gap(None, joint.NOT_ASKED)
    monkeypatch.setattr(joint, "is_available", lambda: False)
    solution = joint.solve(scene)
    assert solution.best == solution.clustered.assignment
    assert solution.gap == joint.Gap(None, joint.MISSING)
    with pytest.raises(Unavailable, match="optional extra fleet"):
        joint.optimise(scene)


def test_assignments_that_serve_different_value_have_no_gap():
    scene = random_problem(1, 10, 2)
    nobody = assignment_of(scene, [scene.path(0, ()), scene.path(1, ())])
    assert joint.gap_to(nobody, assign(scene).assignment).relative is None
    assert joint.gap_to(nobody, nobody).relative == 0.0


def test_one_target_may_take_the_place_of_several_worth_less():
    scene = problem(
        [(100.0, 0.0), (110.0, 0.0), (-400.0, 0.0)],
        [vehicle(length_m=810.0)],
        values=np.array([1.0, 1.0, 3.0]),
    )
    assert assign(scene).assignment.tours[0].targets == (2,)
