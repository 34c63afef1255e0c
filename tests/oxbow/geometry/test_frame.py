import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oxbow.geometry.frame import Frame, geodesic_length_m


@settings(max_examples=50)
@given(
    lat=st.floats(-80, 80),
    long=st.floats(-180, 180),
    xy=st.lists(st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)), min_size=2, max_size=6),
)
def test_there_and_back(lat, long, xy):
    frame = Frame(lat, long)
    points = np.array(xy)
    assert np.abs(frame.to_planar(frame.to_degrees(points)) - points).max() < 1e-4


@settings(max_examples=50)
@given(lat=st.floats(-80, 80), angle=st.floats(0, 6.28), distance=st.floats(1, 1.5e5))
def test_planar_lengths_are_geodesic_within_a_ten_thousandth(lat, angle, distance):
    frame = Frame(lat, 12.0)
    middle = np.array([np.cos(angle), np.sin(angle)]) * distance * 0.7
    ends = middle + np.array([[0.0, 0.0], [0.3 * distance, 0.0]])
    length = geodesic_length_m(frame.to_degrees(ends))
    assert length == pytest.approx(np.hypot(*(ends[1] - ends[0])), rel=2e-4)


def test_the_origin_is_the_middle_even_across_the_antimeridian():
    frame = Frame.around(np.array([[179.9, -10.0], [-179.9, -10.2]]))
    assert frame.lat == pytest.approx(-10.1)
    assert abs(abs(frame.long) - 180.0) < 1e-9
    planar = frame.to_planar(np.array([[179.9, -10.0], [-179.9, -10.2]]))
    assert np.hypot(*planar.T).max() < 30_000
