"""Discrepancy of sampled positions, on regions of any shape."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc
from shapely import LineString, MultiPolygon, Point, affinity, box

from oxbow.testing import nasty_polygons
from oxbow_certificate.discrepancy import centred_discrepancy, discrepancy, unit_square
from oxbow_certificate.spread import even_places

quick = settings(max_examples=15)
RECTANGLE = MultiPolygon([box(0, 0, 200, 100)])
LAKE = MultiPolygon([box(0, 0, 200, 100).difference(Point(120, 40).buffer(30)), box(210, 20, 260, 60)])


def rows(heights, width=200.0) -> LineString:
    return LineString(
        [(x, y) for k, y in enumerate(heights) for x in ((5, width - 5) if k % 2 == 0 else (width - 5, 5))]
    )


def measured(region, path, spacing_m=10.0):
    found = discrepancy(region, path, spacing_m, 1e-3)
    assert found is not None
    return found


@pytest.mark.parametrize("count", [1, 2, 3, 512, 513, 1500])
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_it_is_scipys(count, share):
    square = share * np.random.default_rng(count).random((count, 2))
    # The middle and the borders belong to a side too.
    square[:2] = [[0.5, 1.0], [0.0, 0.5]][:count]
    assert centred_discrepancy(square) == pytest.approx(qmc.discrepancy(square, method="CD"), rel=1e-7)


def test_on_a_rectangle_it_is_scipys():
    places = np.random.default_rng(5).random((200, 2))
    square = unit_square(RECTANGLE, places * [200, 100])
    assert square == pytest.approx(places[np.argsort(places[:, 0])])


@pytest.mark.parametrize("shape", sorted(nasty_polygons()))
def test_uniform_places_become_uniform(shape):
    region = MultiPolygon([nasty_polygons()[shape]])
    square = unit_square(region, even_places(region, 1000))
    assert len(square) == 1000
    random_squared = 7 / 18 / 1000
    assert qmc.discrepancy(square) < 0.5 * random_squared


def test_a_place_has_the_area_west_of_it_and_the_chord_south_of_it():
    fork = MultiPolygon([box(0, 0, 50, 40), box(50, 0, 100, 10), box(50, 30, 100, 40)])
    assert unit_square(fork, np.array([[25.0, 10.0], [75.0, 35.0]])) == pytest.approx(
        np.array([[1 / 3, 0.25], [5 / 6, 0.75]])
    )


def test_the_whole_of_the_border_counts():
    corners = np.array([(x, y) for x in (0.0, 200.0) for y in (0.0, 100.0)])
    assert unit_square(RECTANGLE, corners) == pytest.approx(corners / [200, 100])


def test_the_ratio_is_to_what_random_positions_are_expected_to_have():
    path = rows(np.arange(5, 100, 10))
    count = np.ceil(path.length / 10)
    found = measured(RECTANGLE, path)
    expected = found.value / found.ratio
    rng = np.random.default_rng(7)
    random = [qmc.discrepancy(rng.random((int(count), 2))) for _ in range(400)]
    assert np.mean(random) == pytest.approx(expected**2, rel=0.1)


def test_even_rows_are_better_than_random_and_crowded_ones_worse():
    even = measured(RECTANGLE, rows(np.arange(5, 100, 10)))
    crowded = measured(RECTANGLE, rows(5 + 90 * np.linspace(0, 1, 10) ** 2))
    half = measured(RECTANGLE, rows(np.arange(2.5, 50, 5)))
    assert even.ratio < 0.8
    assert even.ratio < crowded.ratio < half.ratio
    assert half.ratio > 2


@quick
@given(st.floats(0, 6.28), st.floats(-1e5, 1e5), st.floats(0.1, 50), st.sampled_from([1, -1]))
def test_turned_moved_scaled_and_mirrored(angle, shift, scale, side):
    def changed(geometry):
        turned = affinity.rotate(geometry, angle, origin=(0, 0), use_radians=True)
        return affinity.translate(affinity.scale(turned, scale, side * scale, origin=(0, 0)), shift, -shift)

    path = rows([5, 15, 40, 55, 60, 95])
    here = measured(LAKE, path, 9.9)
    there = discrepancy(changed(LAKE), changed(path), 9.9 * scale, 1e-3 * scale)
    assert there is not None
    assert there.value == pytest.approx(here.value, rel=1e-3)


def test_more_positions_than_the_most_are_thinned():
    path = rows(np.arange(5, 100, 10))
    assert measured(RECTANGLE, path, 1e-3).value == pytest.approx(measured(RECTANGLE, path, 1.0).value, rel=0.05)


def test_a_path_outside_has_none():
    assert discrepancy(RECTANGLE, LineString([(300, 0), (400, 0)]), 10.0, 1e-3) is None
