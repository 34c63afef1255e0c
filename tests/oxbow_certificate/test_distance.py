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
    assert PathDistance(path)(places) == pytest.approx(expected, abs=1e-7)


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
