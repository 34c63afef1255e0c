"""MaxMin: the least distance between parallel legs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, affinity

from oxbow_certificate.legs import least_leg_distance

quick = settings(max_examples=20)
NOWHERE = Point()


def rows(heights, width=200.0) -> LineString:
    """Rows at some heights, walked to and fro."""
    return LineString([(x, y) for k, y in enumerate(heights) for x in ((0, width) if k % 2 == 0 else (width, 0))])


def square_spiral(pitch: float, turns: int) -> LineString:
    x, y, places = 0.0, 0.0, [(0.0, 0.0)]
    for k in range(4 * turns):
        step = pitch * (k // 2 + 1)
        x, y = x + step * math.cos(k * math.pi / 2), y + step * math.sin(k * math.pi / 2)
        places.append((x, y))
    return LineString(places)


@quick
@given(st.floats(4, 30), st.floats(0, 6.28), st.floats(-1e5, 1e5))
def test_rows_are_as_far_apart_as_they_were_laid(distance_m, angle, shift):
    path = rows(np.arange(0, 120, distance_m))
    path = affinity.translate(affinity.rotate(path, angle, origin=(0, 0), use_radians=True), shift, -shift)
    assert least_leg_distance(path, 10.0, NOWHERE) == pytest.approx(distance_m, rel=1e-6)


@quick
@given(st.floats(0.2, 4.8), st.integers(1, 8))
def test_one_leg_too_near_is_found(nearness_m, leg):
    heights = np.arange(0, 100, 10.0)
    heights[leg] = heights[leg - 1] + nearness_m
    assert least_leg_distance(rows(heights), 10.0, NOWHERE) == pytest.approx(nearness_m)


def test_a_spiral_is_as_wide_as_its_pitch():
    assert least_leg_distance(square_spiral(7.0, 6), 7.0, NOWHERE) == pytest.approx(7.0)


@pytest.mark.parametrize(
    "change", [LineString.reverse, lambda path: path.segmentize(0.7)], ids=["reversed", "cut"]
)
def test_how_a_path_is_written_does_not_matter(change):
    path = rows([0, 10, 17, 30])
    assert least_leg_distance(change(path), 10.0, NOWHERE) == pytest.approx(7.0)


@pytest.mark.parametrize(
    "path",
    [
        LineString([(0, 0), (200, 3)]),
        LineString([(0, 0), (100, 0), (200, 0.0), (300, 1)]),
        LineString([(0, 0), (100, 0), (100, 100), (150, 200)]),
        LineString([(0, 0), (60, 0), (60, 60), (0, 60), (0, -60)]),
        rows([0, 10]).buffer(500).exterior,
    ],
    ids=["straight", "straight, cut", "bends", "crossing at right angles", "ring wider than four spacings"],
)
def test_a_path_may_have_no_parallel_legs(path):
    assert least_leg_distance(path, 10.0, NOWHERE) is None


def test_the_end_of_a_ring_is_a_neighbour_of_its_start():
    ring = Point(0, 0).buffer(15, quad_segs=32).exterior
    assert least_leg_distance(LineString(ring.coords), 10.0, NOWHERE) == pytest.approx(30, rel=0.01)


def test_legs_meet_where_they_may():
    path = LineString([(0, 0), (300, 0), (300, 20), (50, 20), (50, 2), (0, 2)])
    assert least_leg_distance(path, 20.0, NOWHERE) == pytest.approx(2)
    assert least_leg_distance(path, 20.0, Point(0, 0).buffer(60)) == pytest.approx(20)


def test_a_tangle_is_measured_in_little_memory():
    walk = np.random.default_rng(3).random((1500, 2))
    assert 0 <= least_leg_distance(LineString(walk), 20.0, NOWHERE) < 0.01
