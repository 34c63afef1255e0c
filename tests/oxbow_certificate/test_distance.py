"""Distance to a path, by the tree and without it."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, box

from oxbow_certificate.axes import coordinates_along, long_side, main_direction
from oxbow_certificate.distance import PathDistance

quick = settings(max_examples=20)
walks = st.lists(st.tuples(st.floats(-100, 100), st.floats(-100, 100)), min_size=2, max_size=12, unique=True)


@quick
@given(walks, st.floats(-1e5, 1e5))
def test_distance_is_shapelys(walk, shift):
    path = LineString(np.array(walk) + shift)
    places = np.random.default_rng(1).uniform(-200, 200, (200, 2)) + shift
    expected = shapely.distance(path, shapely.points(places))
    assert PathDistance(path, 10.0)(places) == pytest.approx(expected, abs=1e-7)


def tangle() -> LineString:
    """A long leg, and a tight turn of many waypoints at its end, as smoothing leaves one."""
    turn = np.linspace(0, np.pi, 3000)
    return LineString([(0, 0), *np.column_stack([1000 + np.sin(turn), 1 - np.cos(turn)]), (0, 2)])


def test_distance_is_shapelys_where_waypoints_are_dense():
    path = tangle()
    places = np.random.default_rng(1).uniform([950, -50], [1050, 50], (500, 2))
    distance = PathDistance(path, 10.0)
    assert distance(places) == pytest.approx(shapely.distance(path, shapely.points(places)), abs=1e-9)
    # Such places are what the R-tree is for: it has been asked.
    assert "_rtree" in vars(distance)


def test_bounds_are_no_less_than_the_distance_and_mostly_equal():
    path = LineString([(x, y) for y in range(0, 100, 10) for x in ((0, 100) if y % 20 else (100, 0))])
    places = np.random.default_rng(3).uniform(-20, 120, (5000, 2))
    distance = PathDistance(path, 10.0)
    bound_m, distance_m = distance.bounds(places), distance(places)
    assert (bound_m >= distance_m).all()
    assert np.mean(bound_m > distance_m) < 0.1


def test_more_places_than_one_query_takes_keep_their_order():
    places = np.random.default_rng(4).uniform(0, 10, (120_001, 2))
    distance_m = PathDistance(LineString([(0, 0), (10, 0)]), 5.0)(places)
    assert distance_m == pytest.approx(places[:, 1], abs=1e-9)


@quick
@given(st.floats(-3, 3))
def test_axes_lie_along_rows_and_rectangles(angle):
    rows = np.array([(0, 0), (100, 0), (100, 5), (0, 5), (0, 10), (100, 10)])
    along = np.array([np.cos(angle), np.sin(angle)])
    back = coordinates_along(rows, np.array([np.cos(angle), -np.sin(angle)]))
    assert abs(main_direction(LineString(back)) @ along) == pytest.approx(1)
    rectangle = shapely.transform(
        box(0, 0, 30, 10), lambda xy: coordinates_along(xy, np.array([along[0], -along[1]]))
    )
    assert abs(long_side(rectangle) @ along) == pytest.approx(1)
    assert coordinates_along(back, along) == pytest.approx(rows, abs=1e-9)
