"""The space-filling curve: its draws, its ring, its path."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, box

from oxbow.contracts import Draw, Method
from oxbow.geometry.reeb import cell_polygon
from oxbow.wire.recording import discard
from oxbow_path.refinement import Guard, Polyline
from oxbow_path.service import handle
from oxbow_path.space_filling_curve.draws import cell_draws, drawn_places
from oxbow_path.space_filling_curve.kohonen import UpdateSchedule, organised_curve
from tests.support.path_requests import lake, request

quick = settings(max_examples=12)


@quick
@given(seed=st.integers(0, 10_000), draw=st.sampled_from(Draw))
def test_draws_lie_in_the_cells_by_area(seed, draw):
    cells = request(lake(seed)).decomposition.cells
    places = drawn_places(cells, 5000, seed=seed, draw=draw)
    assert len(places) == 5000
    polygons = [cell_polygon(cell) for cell in cells]
    total = sum(polygon.area for polygon in polygons)
    for polygon in polygons:
        inside = shapely.covers(polygon.buffer(1e-6), shapely.points(places)).sum()
        assert inside >= np.floor(5000 * polygon.area / total) - 1
    water = shapely.union_all(polygons)
    assert shapely.dwithin(water, shapely.points(places), 1e-6).all()


@quick
@given(seed=st.integers(0, 10_000))
def test_equal_areas_of_the_square_are_equal_areas_of_the_cell(seed):
    cell = max(request(lake(seed)).decomposition.cells, key=lambda cell: cell_polygon(cell).area)
    polygon = cell_polygon(cell)
    grid = (np.arange(100) + 0.5) / 100
    places = cell_draws(cell, np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2))
    x0, y0, x1, y1 = polygon.bounds
    for part in (box(x0, y0, (x0 + x1) / 2, y1), box(x0, y0, x1, (y0 + y1) / 2)):
        share = shapely.contains_xy(part, places).mean()
        assert share == pytest.approx(polygon.intersection(part).area / polygon.area, abs=0.02)


def test_draws_depend_on_the_seed_alone():
    cells = request(lake(2)).decomposition.cells
    same = drawn_places(cells, 500, seed=4, draw=Draw.LOW_DISCREPANCY)
    assert (drawn_places(cells, 500, seed=4, draw=Draw.LOW_DISCREPANCY) == same).all()
    assert (drawn_places(cells, 500, seed=5, draw=Draw.LOW_DISCREPANCY) != same).any()


def test_the_report_s_draw_favours_the_middle():
    cells = request(box(0, 0, 1000, 1000)).decomposition.cells
    even, combined = (drawn_places(cells, 4000, seed=0, draw=draw) for draw in Draw)
    middle = cell_polygon(cells[0]).centroid.buffer(250.0)
    assert shapely.contains_xy(middle, combined).mean() > 1.2 * shapely.contains_xy(middle, even).mean()


@pytest.mark.parametrize("count", [0, -3])
def test_nothing_is_drawn_in_vain(count):
    with pytest.raises(ValueError, match=f"count is {count}"):
        drawn_places(request(lake(2)).decomposition.cells, count, seed=0, draw=Draw.LOW_DISCREPANCY)


@quick
@given(seed=st.integers(0, 10_000), width=st.floats(0.5, 8.0))
def test_every_epoch_keeps_the_ring_inside_and_simple(seed, width):
    water = lake(seed)
    inner = max(shapely.get_parts(water.buffer(-80.0)), key=lambda part: part.area)
    ring = Polyline.of(LineString(inner.simplify(5.0).exterior), water.buffer(1e-6))
    draws = np.random.default_rng(seed).uniform(*np.reshape(water.bounds, (2, 2)), (3000, 2))
    length_m = 2 * ring.length_m
    epochs = organised_curve(
        ring,
        draws,
        np.ones(len(draws)),
        Guard.of(water, ring, 160.0),
        length_m=length_m,
        spacing_m=160.0,
        schedule=UpdateSchedule(epochs=8, first_width=width),
        stop=lambda: False,
    )
    for epoch in epochs:
        assert epoch.ring.line.is_simple
        assert water.buffer(1e-5).covers(epoch.ring.line)
        assert len(epoch.ring.nodes) < 20 * length_m / 160.0


def test_nodes_follow_the_length():
    """A ring that is too short gets nodes until it is about as long as it may be."""
    square = box(0, 0, 1000, 1000)
    ring = Polyline.of(LineString(box(200, 200, 800, 800).exterior), square.buffer(1e-6))
    draws = np.random.default_rng(0).uniform(0, 1000, (10_000, 2))
    *_, last = organised_curve(
        ring,
        draws,
        np.ones(len(draws)),
        Guard.of(square, ring, 100.0),
        length_m=10_000.0,
        spacing_m=100.0,
        schedule=UpdateSchedule(epochs=40),
        stop=lambda: False,
    )
    assert 0.8 * 10_000.0 <= last.ring.length_m <= 1.2 * 10_000.0


def test_the_curve_has_no_preferred_direction():
    def anisotropy(method: Method) -> float:
        path = handle(request(box(0, 0, 1000, 1000), spacings=20, method=method), discard).path
        edge = np.diff(shapely.get_coordinates(path), axis=0)
        length = np.hypot(*edge.T)
        return float(abs((length * np.exp(2j * np.arctan2(*edge.T))).sum()) / length.sum())

    assert anisotropy(Method.SPACE_FILLING_CURVE) < 0.3
    assert anisotropy(Method.TRANSECT) > 0.5
