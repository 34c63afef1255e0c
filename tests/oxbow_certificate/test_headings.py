"""Directional evenness and turns."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, affinity

from oxbow_certificate.headings import count_turns, directional_evenness

quick = settings(max_examples=30)
CORNER = [(0, 0), (100, 0), (100, 100)]


def star(directions: int) -> LineString:
    """A closed path that runs as far in each of some directions, evenly apart."""
    angles = np.arange(directions) * math.pi / directions
    steps = np.column_stack([np.cos(angles), np.sin(angles)])
    return LineString(np.cumsum(np.vstack([[(0, 0)], steps, -steps]), axis=0))


def round_turn(radius_m: float, angle_rad: float, count: int) -> LineString:
    """A leg, an arc to the left in `count` steps, and another leg."""
    angles = np.linspace(0, angle_rad, count + 1)
    arc = np.column_stack([radius_m * np.sin(angles), radius_m * (1 - np.cos(angles))])
    last = arc[-1] + 100 * np.array([math.cos(angle_rad), math.sin(angle_rad)])
    return LineString(np.vstack([[(-100, 0)], arc, [last]]))


walks = st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100)), min_size=3, max_size=15, unique=True)


@pytest.mark.parametrize("directions", [1, 2, 3, 5, 12])
def test_directions_sampled_alike(directions):
    assert directional_evenness(star(directions)) == pytest.approx(1 - 1 / directions, abs=1e-9)


def test_a_circle_has_no_direction():
    assert directional_evenness(LineString(Point(0, 0).buffer(1, quad_segs=64).exterior.coords)) > 0.99


def test_to_and_fro_is_one_direction():
    assert directional_evenness(LineString([(0, 0), (100, 30), (0, 0), (100, 30)])) == pytest.approx(0, abs=1e-7)


def test_the_longer_way_counts_for_more():
    links = [directional_evenness(LineString([(0, 0), (100, 0), (100, link)])) for link in (1, 10, 30, 60, 100)]
    assert links == sorted(links)
    assert links[-1] == pytest.approx(0.5)


@quick
@given(walks, st.floats(0, 6.28), st.floats(0.01, 100))
def test_headings_do_not_depend_on_how_a_path_lies(walk, angle, scale):
    path = LineString(walk)
    there = affinity.scale(affinity.rotate(path, angle, use_radians=True), scale, scale).reverse()
    assert 0 <= directional_evenness(path) <= 1
    assert directional_evenness(there) == pytest.approx(directional_evenness(path), abs=1e-6)
    assert directional_evenness(path.segmentize(7.0)) == pytest.approx(directional_evenness(path), abs=1e-6)


@pytest.mark.parametrize(
    ("path", "turns"),
    [
        ([(0, 0), (100, 0)], 0),
        (CORNER, 1),
        ([(0, 0), (100, 0), (100, 0), (100, 100)], 1),
        ([(0, 0), (100, 0), (200, 70)], 0),
        ([(0, 0), (100, 0), (0, 0)], 1),
        ([(0, 0), (100, 0), (100, 20), (0, 20), (0, 40), (100, 40)], 4),
        ([(0, 0), (100, 0), (100, 4), (0, 4)], 1),
        ([(0, 0), (100, 0), (100, 4), (200, 4)], 2),
        ([(0, 0), (50, 50), (100, 0), (150, 50), (200, 0)], 3),
        ([(0, 0), (100, 0), (104, 2), (106, 6), (106, 100)], 1),
    ],
    ids=["straight", "corner", "twice", "bend", "back", "meander", "hairpin", "step", "zigzag", "cut corner"],
)
def test_turns(path, turns):
    path = LineString(path)
    mirrored = affinity.scale(path, 1, -1)
    cut = path.segmentize(1.7)
    assert [count_turns(each, 10.0) for each in (path, mirrored, cut, cut.reverse())] == [turns] * 4


@pytest.mark.parametrize("count", [6, 20, 300])
def test_a_round_turn_is_one_and_a_gentle_curve_is_none(count):
    assert count_turns(round_turn(10.0, math.pi, count), 10.0) == 1
    assert count_turns(round_turn(10.0, math.pi / 2, count), 10.0) == 1
    assert count_turns(round_turn(10.0, 0.7, count), 10.0) == 0
    assert count_turns(round_turn(400.0, math.pi, 10 * count), 10.0) == 0


@quick
@given(walks, st.floats(0, 6.28))
def test_turns_do_not_depend_on_how_a_path_lies(walk, angle):
    path = LineString(walk)
    assert count_turns(affinity.rotate(path, angle, use_radians=True), 0.01) == count_turns(path, 0.01)
