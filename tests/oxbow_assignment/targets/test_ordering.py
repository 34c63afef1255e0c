"""The order of one vehicle's targets."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from oxbow_assignment.targets.ordering import (
    EXACT_MOST,
    best_path,
    exact_path,
    improved_path,
    inserted_path,
    path_length,
)

quick = settings(max_examples=25)


def distances_between(seed, rows, is_plane=True):
    random = np.random.default_rng(seed)
    if is_plane:
        points = random.uniform(0.0, 1_000.0, (rows, 2))
        return cdist(points, points)
    distances = np.triu(random.uniform(0.0, 1_000.0, (rows, rows)), 1)
    return distances + distances.T


def every_path(path):
    return (np.array([path[0], *order, path[-1]]) for order in permutations(path[1:-1]))


@quick
@given(seed=st.integers(0, 10_000), count=st.integers(0, 6), is_plane=st.booleans())
def test_the_exact_path_is_the_shortest_of_all(seed, count, is_plane):
    distances = distances_between(seed, count + 2, is_plane)
    path = np.arange(count + 2)
    shortest = min(path_length(distances, other) for other in every_path(path))
    assert path_length(distances, exact_path(distances, path)) == pytest.approx(shortest)


@quick
@given(seed=st.integers(0, 10_000), count=st.integers(0, 60), is_plane=st.booleans())
def test_a_path_keeps_its_ends_and_its_targets(seed, count, is_plane):
    distances = distances_between(seed, count + 4, is_plane)
    path = np.random.default_rng(seed).permutation(count + 4)[: count + 2]
    for order in (best_path, inserted_path, improved_path):
        ordered = order(distances, path)
        assert ordered[[0, -1]].tolist() == path[[0, -1]].tolist()
        assert sorted(ordered.tolist()) == sorted(path.tolist())


@quick
@given(seed=st.integers(0, 10_000), count=st.integers(2, 60), is_plane=st.booleans())
def test_improvement_never_lengthens_and_ends_where_nothing_improves(seed, count, is_plane):
    distances = distances_between(seed, count + 2, is_plane)
    path = np.arange(count + 2)
    improved = improved_path(distances, path)
    assert path_length(distances, improved) <= path_length(distances, path) + 1e-9
    assert (improved_path(distances, improved) == improved).all()


@quick
@given(seed=st.integers(0, 10_000))
def test_no_target_of_an_improved_path_is_better_off_beside_a_neighbour(seed):
    """What best-of-all-at-once finds, against moves made one by one."""
    count = 9
    distances = distances_between(seed, count + 2)
    path = improved_path(distances, np.arange(count + 2))
    length_m = path_length(distances, path)
    for i in range(1, count + 1):
        for j in range(i + 1, count + 1):
            turned = np.concatenate([path[:i], path[i : j + 1][::-1], path[j + 1 :]])
            assert path_length(distances, turned) >= length_m - 1e-6
        rest = np.delete(path, i)
        for place in range(1, count + 1):
            assert path_length(distances, np.insert(rest, place, path[i])) >= length_m - 1e-6


def test_the_heuristic_is_near_the_optimum():
    ratios = []
    for seed in range(30):
        distances = distances_between(seed, EXACT_MOST + 2)
        path = np.arange(EXACT_MOST + 2)
        heuristic = improved_path(distances, inserted_path(distances, path))
        ratios.append(path_length(distances, heuristic) / path_length(distances, exact_path(distances, path)))
    assert min(ratios) >= 1.0 - 1e-9
    assert np.median(ratios) < 1.02
    assert max(ratios) < 1.15


@pytest.mark.parametrize("count", [5, 20])
def test_targets_in_one_place_and_without_routes_are_ordered(count):
    path = np.arange(count + 2)
    assert sorted(best_path(np.zeros((count + 2, count + 2)), path).tolist()) == path.tolist()
    far = np.full((count + 2, count + 2), 1e9)
    np.fill_diagonal(far, 0.0)
    assert sorted(best_path(far, path).tolist()) == path.tolist()


def test_targets_on_a_line_are_visited_along_it():
    along = np.concatenate([[0.0], np.random.default_rng(0).permutation(np.arange(1.0, 41.0)), [41.0]])
    distances = np.abs(along[:, None] - along[None, :])
    assert path_length(distances, best_path(distances, np.arange(42))) == pytest.approx(41.0)
