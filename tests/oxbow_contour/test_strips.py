import itertools

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from oxbow_contour.strips import deviations, strip_ends


def ragged_ring(seed: int, count: int, roughness: float) -> np.ndarray:
    """A closed ring that backtracks, doubles back and crosses itself: strips must hold whatever they are given."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = 100 * np.column_stack([np.cos(angle), np.sin(angle)]) + roughness * rng.standard_normal((count, 2))
    return np.vstack([ring, ring[:1]])


rings = st.builds(ragged_ring, st.integers(0, 2**32 - 1), st.integers(3, 300), st.sampled_from([0, 0.01, 1, 30]))
tolerances = st.sampled_from([0.0, 1e-9, 0.01, 0.5, 3.0, 40.0, 1e6])


@settings(max_examples=150)
@given(rings, tolerances)
def test_every_strip_holds_its_points(ring, tolerance_m):
    ends = strip_ends(ring, tolerance_m)
    for first, last in itertools.pairwise(ends):
        edge = shapely.LineString(ring[[first, last]])
        assert shapely.distance(edge, shapely.points(ring[first : last + 1])).max() <= tolerance_m * (1 + 1e-9)


@settings(max_examples=150)
@given(rings, tolerances)
def test_ends_rise_from_the_first_point_to_the_last_and_span_an_area(ring, tolerance_m):
    ends = strip_ends(ring, tolerance_m)
    assert ends[0] == 0
    assert ends[-1] == len(ring) - 1
    assert (np.diff(ends) > 0).all()
    assert shapely.convex_hull(shapely.LineString(ring[ends])).area > 0


@settings(max_examples=100)
@given(rings, tolerances)
def test_deviations_are_distances_to_the_edges(ring, tolerance_m):
    ends = strip_ends(ring, tolerance_m)
    expected = [
        shapely.distance(shapely.LineString(ring[[a, b]]), shapely.points(ring[a : b + 1])).max()
        for a, b in itertools.pairwise(ends)
    ]
    np.testing.assert_allclose(deviations(ring, ends[:-1], ends[1:]), expected, atol=1e-9)


def test_no_tolerance_keeps_every_point():
    ring = ragged_ring(1, 50, 1.0)
    assert len(strip_ends(ring, 0.0)) == len(ring)


def test_a_straight_run_becomes_one_edge():
    x = np.linspace(0, 100, 1001)
    ring = np.vstack([np.column_stack([x, 0.01 * np.sin(x)]), [[100, 100], [0, 100], [0, 0]]])
    assert len(strip_ends(ring, 0.1)) == 5


def test_a_smooth_curve_needs_few_strips():
    # A chord of length sqrt(8 r h) strays h from a circle of radius r; the cone uses 0.8 of the tolerance.
    angle = np.linspace(0, 2 * np.pi, 100_001)
    ring = 1000 * np.column_stack([np.cos(angle), np.sin(angle)])
    fewest = 2 * np.pi * 1000 / np.sqrt(8 * 1000 * 1.0)
    assert len(strip_ends(ring, 1.0)) < 1.6 * fewest


@pytest.mark.parametrize("step", [1e-6, 1e-3, 1.0])
def test_a_shore_that_backtracks_within_the_tolerance_is_still_simplified(step):
    rng = np.random.default_rng(0)
    x = np.linspace(0, 1000, 20_000) + step * rng.uniform(-1, 1, 20_000)
    ring = np.vstack(
        [np.column_stack([x, step * rng.uniform(-1, 1, 20_000)]), [[1000, 500], [0, 500]], [[x[0], 0]]]
    )
    assert len(strip_ends(ring, 4 * step)) < 0.02 * len(ring)
