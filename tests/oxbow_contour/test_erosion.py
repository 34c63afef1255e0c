import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPolygon, Point, Polygon, box

from oxbow.testing import nasty_polygons
from oxbow_contour.erosion import erode
from oxbow_contour.verification import inscribed_radius_m, is_safe, rounded_down

EXACT = 1e-9
"""Relative rounding of distances."""


def ragged(seed: int, count: int, roughness: float) -> Polygon:
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radius = 100 * (1 + roughness * rng.uniform(-1, 1, count))
    return Polygon(radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))


polygons = st.builds(
    ragged, st.integers(0, 2**32 - 1), st.integers(4, 300), st.sampled_from([0.0, 1e-6, 0.01, 0.3, 0.95])
)


@settings(max_examples=150)
@given(polygons, st.sampled_from([1e-6, 0.1, 3.0, 20.0]))
def test_nothing_left_is_nearer_than_the_distance(water, distance_m):
    for part in erode([water], distance_m):
        assert part.is_valid
        assert water.contains(part)
        assert part.boundary.distance(water.boundary) >= distance_m * (1 - EXACT) - 1e-12


@settings(max_examples=100)
@given(polygons, st.sampled_from([0.1, 3.0, 20.0]))
def test_what_is_farther_than_the_distance_is_left(water, distance_m):
    left = shapely.union_all(erode([water], distance_m))
    must_stay = water.buffer(-1.01 * distance_m, quad_segs=64)
    assert must_stay.difference(left).area <= 1e-9 * water.area


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(2, 9), st.sampled_from([1e-5, 1.0]))
@example(seed=567, edges=9, excess_m=1.0)
@example(seed=204, edges=6, excess_m=1e-5)
def test_short_edges_beside_long_ones_are_kept_away_from_as_well(seed, edges, excess_m):
    """GEOS alone leaves out some of the distance beside such a shore."""
    rng = np.random.default_rng(seed)
    steps = rng.uniform(-1, 1, (edges, 2)) * 10 ** rng.uniform(-2, 2, (edges, 1))
    wall = LineString(np.cumsum(steps, axis=0)).buffer(1e-3, cap_style="flat", join_style="mitre")
    water = box(*wall.bounds).buffer(20).difference(wall)
    for part in erode([water], 5.0, excess_m):
        assert part.boundary.distance(water.boundary) >= 5.0 * (1 - EXACT)


@settings(max_examples=30)
@given(polygons, st.sampled_from([1e-2, 1e-3, 1e-4]))
def test_what_is_farther_than_the_distance_and_its_excess_is_left(water, share):
    distance_m = 20.0
    left = shapely.union_all(erode([water], distance_m, share * distance_m))
    must_stay = water.buffer(-(1 + share) * distance_m, quad_segs=512)
    assert must_stay.difference(left).area <= 1e-9 * water.area


@pytest.mark.parametrize("name", nasty_polygons())
def test_nasty_shapes_erode_to_valid_parts(name):
    water = nasty_polygons()[name]
    for part in erode([water], 1.0):
        assert part.is_valid
        assert part.boundary.distance(water.boundary) >= 1 - EXACT


def test_parts_come_largest_first():
    dumbbell = shapely.union_all([box(0, 0, 40, 100), box(40, 49, 60, 51), box(60, 0, 160, 100)])
    parts = erode([dumbbell], 2.0)
    assert [part.area for part in parts] == [pytest.approx(96 * 96, rel=1e-3), pytest.approx(36 * 96, rel=1e-3)]


def test_several_polygons_erode_each_from_its_own_shore():
    parts = erode([box(0, 0, 10, 10), MultiPolygon([box(10, 0, 20, 10), box(50, 0, 60, 10)])], 1.0)
    assert sorted(part.bounds for part in parts) == [
        pytest.approx(bounds, abs=0.01) for bounds in [(1, 1, 9, 9), (11, 1, 19, 9), (51, 1, 59, 9)]
    ]


def test_a_shore_of_short_edges_is_eroded_by_far_more_than_their_length():
    water = ragged(0, 20_000, 0.02)
    (part,) = erode([water], 30.0)
    assert part.boundary.distance(water.boundary) >= 30.0
    assert part.area > np.pi * 67**2


LAKE = Polygon(box(0, 0, 100, 100).exterior, [box(40, 40, 60, 60).exterior])


def eroded_lake(distance_m: float) -> Polygon:
    return Polygon(
        box(distance_m, distance_m, 100 - distance_m, 100 - distance_m).exterior,
        [box(40, 40, 60, 60).buffer(distance_m, join_style="mitre").exterior],
    )


def test_free_space_at_the_distance_is_safe():
    assert is_safe(eroded_lake(5.0), [LAKE], 5.0)
    assert is_safe(box(10, 10, 30, 30), [box(200, 0, 300, 100), LAKE], 10.0)


@pytest.mark.parametrize(
    "free",
    [
        eroded_lake(4.999),
        box(5, 5, 95, 95),
        Polygon(eroded_lake(5.0).exterior),
        box(200, 200, 300, 300),
        box(-100, -100, 200, 200),
        box(48, 48, 52, 52),
        Polygon([(6, 6), (94, 6), (50, 36), (6, 94)]),
        Polygon([(6, 6), (94, 6), (94, 7), (0, 20)]),
    ],
    ids=[
        "near",
        "over the island",
        "no hole",
        "elsewhere",
        "around",
        "on the island",
        "corner",
        "through the shore",
    ],
)
def test_free_space_too_near_or_outside_is_not_safe(free):
    assert not is_safe(free, [LAKE], 5.0)


def test_without_a_safety_distance_even_touching_is_not_safe():
    assert not is_safe(LAKE, [LAKE], 0.0)
    assert not is_safe(box(0, 10, 20, 20), [LAKE], 0.0)
    assert is_safe(eroded_lake(1e-6), [LAKE], 0.0)


def test_the_check_finds_one_bad_vertex_of_many():
    shore = ragged(5, 5_000, 0.01)
    free = max(erode([shore], 2.0), key=lambda part: part.area)
    assert is_safe(free, [shore], 2.0)
    points = shapely.get_coordinates(free)
    points[len(points) // 3] *= 1.02
    assert not is_safe(Polygon(points), [shore], 2.0)


@pytest.mark.parametrize("distance_m", [1e-3, 1.0, 49.0])
def test_inscribed_radius(distance_m):
    assert 49 < inscribed_radius_m([box(0, 0, 3, 3), Point(0, 0).buffer(50)], 0.5) <= 50
    assert inscribed_radius_m([box(0, 0, 1000, 2 * distance_m)], distance_m / 1000) == pytest.approx(
        distance_m, rel=2e-3
    )


@pytest.mark.parametrize(
    ("value", "expected"), [(123.99, 123.0), (0.0012399, 0.00123), (1.0, 1.0), (9.999, 9.99), (98765.4, 98700.0)]
)
def test_rounded_down(value, expected):
    assert rounded_down(value) == expected
