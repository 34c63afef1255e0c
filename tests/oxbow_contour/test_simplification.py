import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from oxbow.testing import nasty_polygons
from oxbow_contour.simplification import simplify


def ragged_lake(seed: int, count: int, roughness: float, islands: int) -> Polygon:
    """A star-shaped outline with islands, all of them ragged."""
    rng = np.random.default_rng(seed)
    lake = star(rng, (0, 0), 100, count, roughness)
    zones = [star(rng, rng.uniform(-80, 80, 2), rng.uniform(1, 25), 12, roughness) for _ in range(islands)]
    return max(shapely.get_parts(lake.difference(shapely.union_all(zones))), key=shapely.area)


def star(rng: np.random.Generator, centre, radius: float, count: int, roughness: float) -> Polygon:
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radii = radius * (1 + roughness * rng.uniform(-1, 1, count))
    return Polygon(np.asarray(centre) + radii[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))


lakes = st.builds(
    ragged_lake,
    st.integers(0, 2**32 - 1),
    st.integers(8, 400),
    st.sampled_from([0.001, 0.05, 0.4, 0.9]),
    st.integers(0, 12),
)
tolerances = st.sampled_from([0.0, 0.01, 0.5, 4.0, 30.0, 1000.0])


def contours(simplified) -> np.ndarray:
    return shapely.get_rings(shapely.get_parts(np.array(simplified.parts, dtype=object)))


@settings(max_examples=150)
@given(lakes, tolerances)
def test_no_contour_crosses_itself_or_another(lake, tolerance_m):
    simplified = simplify([lake], tolerance_m)
    assert shapely.is_valid(simplified.parts).all()
    rings = contours(simplified)
    assert shapely.is_simple(rings).all()
    assert not any(shapely.crosses(ring, rings).any() for ring in rings)


@settings(max_examples=100)
@given(lakes, st.sampled_from([0.0, 0.01, 0.5, 4.0]))
def test_contours_stay_within_the_tolerance_both_ways(lake, tolerance_m):
    simplified = simplify([lake], tolerance_m)
    shore = shapely.union_all(contours(simplified))
    assert shapely.distance(shore, shapely.points(shapely.get_coordinates(lake))).max() <= tolerance_m + 1e-9
    along = shapely.points(shapely.get_coordinates(shapely.segmentize(shore, 1.0)))
    assert shapely.distance(lake.boundary, along).max() <= tolerance_m + 1e-9


@pytest.mark.parametrize("name", nasty_polygons())
@pytest.mark.parametrize("tolerance_m", [0.0, 0.1, 5.0, 500.0])
def test_nasty_shapes_stay_valid(name, tolerance_m):
    simplified = simplify([nasty_polygons()[name]], tolerance_m)
    assert shapely.is_valid(simplified.parts).all()
    assert simplified.points_out <= simplified.points_in


def test_no_tolerance_changes_nothing():
    lake = ragged_lake(3, 200, 0.3, 6)
    simplified = simplify([lake], 0.0)
    assert simplified.parts[0].equals(lake)
    assert simplified.compression == 1.0


def test_a_small_island_is_kept():
    lake = Polygon(shapely.box(0, 0, 100, 100).exterior, [shapely.Point(50, 50).buffer(0.1).exterior])
    simplified = simplify([lake], 5.0)
    assert len(simplified.parts[0].interiors) == 1


def test_an_island_that_changes_sides_leaves_no_water_inside_it():
    # The shore bulges round the island by less than the tolerance: simplified, it passes on the other side.
    x = np.linspace(0, 100, 101)
    shore = np.column_stack([x, -2 * np.sin(np.pi * x / 100)])
    island = shapely.box(49, -1.5, 51, -1.0)
    lake = Polygon([*shore, (100, 100), (0, 100)], [island.exterior])
    simplified = simplify([lake], 3.0)
    assert shapely.is_valid(simplified.parts[0])
    assert not simplified.parts[0].intersects(island.buffer(-0.01))


def test_parts_that_share_a_shore_point_do_not_overlap():
    left = Polygon([(0, 0), (10, 5), (0, 10), (-9, 9), (-10, 5), (-9, 1)])
    right = Polygon([(10, 5), (20, 0), (29, 1), (30, 5), (29, 9), (20, 10)])
    simplified = simplify([left, right], 3.0)
    assert simplified.parts[0].intersection(simplified.parts[1]).area == 0


def test_compression_counts_points_of_all_contours():
    lake = Polygon(
        shapely.segmentize(shapely.box(0, 0, 100, 100), 1.0).exterior,
        [shapely.segmentize(shapely.box(40, 40, 60, 60), 1.0).exterior],
    )
    simplified = simplify([lake], 0.5)
    assert simplified.points_in == 400 + 80
    assert simplified.points_out == pytest.approx(8, abs=4)
    assert simplified.compression == simplified.points_in / simplified.points_out
