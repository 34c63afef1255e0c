"""Pseudo-coordinates, and clusters on them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist, pdist, squareform

from oxbow.errors import InvalidRequest
from oxbow_assignment.targets.clustering import (
    cluster_by_radius,
    fading_weights,
    fuzzy_c_means,
    k_means,
    mean_distances,
)
from oxbow_assignment.targets.pseudo_coordinates import pseudo_coordinates

quick = settings(max_examples=25)
seeds = st.integers(0, 10_000)


def plane(seed, count, side=1_000.0):
    return np.random.default_rng(seed).uniform(0.0, side, (count, 2))


def in_plane(points):
    return pseudo_coordinates(cdist(points, points))


def blobs(seed, k, size=8):
    """k groups of targets, far apart on a circle."""
    angles = np.arange(k) * 2 * np.pi / k
    middles = 5_000.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.repeat(middles, size, axis=0) + plane(seed, k * size, 300.0), np.repeat(np.arange(k), size)


def same_partition(labels, others):
    return len(set(zip(labels.tolist(), others.tolist(), strict=True))) == len(set(labels)) == len(set(others))


@quick
@given(seed=seeds, count=st.integers(1, 30))
def test_places_keep_the_distances_between_columns(seed, count):
    points = plane(seed, count)
    distances = cdist(points, points)
    coordinates = pseudo_coordinates(distances)
    apart = squareform(pdist(coordinates.places)) if count > 1 else np.zeros((1, 1))
    root_mean_square = np.sqrt(((distances[:, None] - distances[None, :]) ** 2).mean(axis=2))
    assert np.allclose(apart, root_mean_square, atol=0.5)
    assert (apart <= distances + 0.5).all()
    assert 0.0 <= coordinates.stress < 0.5


def test_stress_is_nothing_where_all_are_equally_far_apart():
    coordinates = pseudo_coordinates(100.0 * (1.0 - np.eye(6)))
    assert coordinates.stress == pytest.approx(0.0, abs=1e-6)


def test_targets_on_two_sides_of_a_wall_are_in_different_clusters():
    """Figure 4 of the report: near as the crow flies, far along the route."""
    west = np.column_stack([np.full(6, 45.0), np.linspace(0, 100, 6)])
    east = west + np.array([10.0, 0.0])
    round_the_end = [50.0, 2_000.0]
    there, back = cdist(west, [round_the_end]), cdist([round_the_end], east)
    distances = np.block([[cdist(west, west), there + back], [(there + back).T, cdist(east, east)]])
    for cluster in (k_means, fuzzy_c_means):
        labels = cluster(pseudo_coordinates(distances), 2).labels
        assert same_partition(labels, np.repeat([0, 1], 6))


@pytest.mark.parametrize("cluster", [k_means, fuzzy_c_means])
@quick
@given(seed=seeds, k=st.integers(2, 6))
def test_groups_far_apart_are_found(cluster, seed, k):
    points, groups = blobs(seed, k)
    assert same_partition(cluster(in_plane(points), k, seed=seed).labels, groups)


@pytest.mark.parametrize("cluster", [k_means, fuzzy_c_means])
@quick
@given(seed=seeds, count=st.integers(1, 25), data=st.data())
def test_as_many_clusters_as_asked_for_and_none_empty(cluster, seed, count, data):
    k = data.draw(st.integers(1, count))
    clusters = cluster(in_plane(plane(seed, count)), k, seed=seed)
    assert sorted(set(clusters.labels.tolist())) == list(range(k))
    assert np.allclose(clusters.memberships.sum(axis=1), 1.0)


@pytest.mark.parametrize("cluster", [k_means, fuzzy_c_means])
def test_targets_in_one_place_can_be_clustered(cluster):
    clusters = cluster(in_plane(np.zeros((5, 2))), 3)
    assert sorted(set(clusters.labels.tolist())) == [0, 1, 2]
    assert np.isfinite(clusters.memberships).all()


@quick
@given(seed=seeds, count=st.integers(2, 30), k=st.integers(1, 5))
def test_k_means_stands_still(seed, count, k):
    coordinates = in_plane(plane(seed, count))
    clusters = k_means(coordinates, min(k, count), seed=seed)
    again = k_means(coordinates, clusters.count, centres=clusters.centres)
    assert (again.labels == clusters.labels).all()
    assert (cdist(coordinates.places, clusters.centres).argmin(axis=1) == clusters.labels).all()


@quick
@given(seed=seeds, count=st.integers(1, 40), radius=st.floats(10.0, 1_000.0))
def test_no_target_is_farther_from_its_cluster_than_the_radius(seed, count, radius):
    coordinates = in_plane(plane(seed, count))
    clusters = cluster_by_radius(coordinates, radius)
    away = mean_distances(coordinates, clusters)[np.arange(count), clusters.labels]
    assert (away <= radius).all()


@quick
@given(seed=seeds, count=st.integers(1, 20))
def test_the_radius_decides_how_many_clusters_there_are(seed, count):
    coordinates = in_plane(plane(seed, count))
    assert cluster_by_radius(coordinates, 0.0).count == count
    assert cluster_by_radius(coordinates, 2_000.0).count == 1


@quick
@given(seed=seeds, count=st.integers(2, 20), k=st.integers(1, 4))
def test_the_mean_route_is_the_largest_difference_of_columns(seed, count, k):
    """What makes metres of route of the radius: see `mean_distances`."""
    points = plane(seed, count)
    distances = cdist(points, points)
    clusters = k_means(pseudo_coordinates(distances), min(k, count), seed=seed)
    means = mean_distances(pseudo_coordinates(distances), clusters)
    for cluster in range(clusters.count):
        column = distances[:, clusters.labels == cluster].mean(axis=1)
        assert np.allclose(means[:, cluster], np.abs(distances - column[:, None]).max(axis=0))


def test_weights_fade_smoothly_from_one_to_zero():
    since = np.linspace(-10.0, 130.0, 200)
    weights = fading_weights(since, 100.0)
    assert fading_weights(np.array([np.nan, 0.0, 50.0, 100.0, 1e9]), 100.0) == pytest.approx(
        [1.0, 1.0, 0.5, 0.0, 0.0]
    )
    assert (np.diff(weights) <= 0.0).all()
    assert np.abs(np.diff(weights, 2)).max() < 1e-3


@quick
@given(seed=seeds)
def test_clusters_do_not_churn_after_a_visit(seed):
    """A visited target's centre moves in small steps as its weight fades, not at once; no other changes."""
    points, groups = blobs(seed, 4, size=10)
    coordinates = in_plane(points)
    first = k_means(coordinates, 4, seed=seed)
    weights, clusters, steps = np.ones(40), first, []
    for since in np.linspace(0.0, 100.0, 21):
        weights[0] = fading_weights(np.array([since]), 100.0)[0]
        moved = k_means(coordinates, 4, weights=weights, centres=clusters.centres)
        steps.append(np.linalg.norm(moved.centres - clusters.centres, axis=1).max())
        clusters = moved
    weights[0] = 0.0
    at_once = k_means(coordinates, 4, weights=weights, centres=first.centres)
    jump = np.linalg.norm(at_once.centres - first.centres, axis=1).max()
    assert same_partition(first.labels, groups)
    assert (clusters.labels == first.labels).all()
    assert jump > 1.0
    assert max(steps) <= 0.2 * jump
    assert np.allclose(clusters.centres, at_once.centres)


def test_a_target_that_has_faded_away_founds_no_cluster():
    points = np.vstack([plane(1, 10, 50.0), [[900.0, 900.0]]])
    weights = np.ones(11)
    assert cluster_by_radius(in_plane(points), 100.0, weights=weights).count == 2
    weights[10] = 0.0
    assert cluster_by_radius(in_plane(points), 100.0, weights=weights).count == 1


@pytest.mark.parametrize(
    ("ask", "says"),
    [
        (lambda c: k_means(c, 0), "k: is 0; expected 1 to 5"),
        (lambda c: k_means(c, 6), "k: is 6; expected 1 to 5"),
        (lambda c: k_means(c, 2, weights=np.full(5, 2.0)), "weights: expected 5 numbers from 0 to 1"),
        (lambda c: k_means(c, 2, weights=np.ones(4)), "weights: expected 5"),
        (lambda c: cluster_by_radius(c, -1.0), "radius_m: is -1.0 m"),
        (lambda c: cluster_by_radius(c, np.nan), "radius_m: is nan m"),
        (lambda _: fading_weights(np.zeros(1), 0.0), "fade_s: is 0.0 s"),
    ],
)
def test_bad_requests_are_named(ask, says):
    with pytest.raises(InvalidRequest, match=says):
        ask(in_plane(plane(1, 5)))


@pytest.mark.parametrize(
    ("distances", "says"),
    [
        (np.empty((0, 0)), "at least one target"),
        (np.array([[0.0, np.inf], [np.inf, 0.0]]), "expected finite distances"),
        (np.array([[0.0, 1.0], [2.0, 0.0]]), "the same there and back"),
        (np.array([[0.0, -1.0], [-1.0, 0.0]]), "a number >= 0"),
        (np.array([[0.0, np.nan], [np.nan, 0.0]]), "a number >= 0"),
        (np.zeros((2, 3)), "expected a square matrix"),
    ],
)
def test_bad_distances_are_named(distances, says):
    with pytest.raises(InvalidRequest, match=says):
        pseudo_coordinates(distances)
