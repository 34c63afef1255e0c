"""The region whose rim is walked: its cuts, its enclosed islands, and the gaps that it reaches."""

import tracemalloc

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, box

from oxbow.geometry.route.gate_routes import Routes
from oxbow.testing import nasty_polygons
from oxbow.wire.recording import discard
from oxbow_path.service import handle
from oxbow_path.task import prepared_waters
from oxbow_path.walk.circuit import plan_circuit
from oxbow_path.walk.gaps import reach_gaps
from oxbow_path.walk.probe import Probe, all_within_reach
from oxbow_path.walk.region import Brush, Walk, dilated_circuit, simply_connected
from oxbow_path.walk.transects import place_transects
from tests.support.path_requests import lake, request

quick = settings(max_examples=12)

OPEN = box(-20, -20, 120, 120)
RING = box(0, 0, 100, 100).difference(box(30, 30, 70, 70))


def test_a_wide_hole_is_opened_by_one_cut():
    walk = simply_connected(RING, OPEN, Probe.over(OPEN, 5.0), cut_width_m=4.0, reach_m=10.0)
    assert not walk.region.interiors
    assert len(walk.cuts) == 1
    assert walk.cuts[0].length == pytest.approx(30)
    assert RING.area - walk.region.area == pytest.approx(4 * 30, rel=0.2)


def test_a_hole_that_the_rest_covers_is_enclosed():
    walk = simply_connected(RING, OPEN, Probe.over(OPEN, 5.0), cut_width_m=4.0, reach_m=51.0)
    assert walk.region.equals(box(0, 0, 100, 100))
    assert len(walk.enclosed) == 1


def test_a_cut_that_meets_an_enclosed_island_follows_its_shore():
    island = box(10, 40, 20, 60)
    region = RING.difference(island)
    probe = Probe.over(box(0, 0, 100, 100).difference(island), 5.0)
    walk = simply_connected(region, OPEN.difference(island), probe, cut_width_m=4.0, reach_m=16.0)
    assert len(walk.enclosed) == len(walk.cuts) == 1
    assert walk.ring.is_simple
    assert walk.ring.intersection(island.buffer(-1e-6)).is_empty


@quick
@given(st.lists(st.tuples(st.floats(5, 90), st.floats(5, 90), st.floats(0.5, 8)), min_size=1, max_size=12))
def test_no_hole_remains_and_little_is_lost(holes):
    region = box(0, 0, 100, 100).difference(shapely.union_all([Point(x, y).buffer(r) for x, y, r in holes]))
    region = max(shapely.get_parts(region), key=lambda part: part.area)
    walk = simply_connected(region, OPEN, Probe.over(box(0, 0, 100, 100), 4.0), cut_width_m=1.0, reach_m=1.0)
    assert not walk.region.interiors
    assert walk.ring.is_simple
    assert region.area - walk.region.area <= sum(cut.length * 1.0 + 1.0 for cut in walk.cuts) + 1e-6 * region.area


@quick
@given(seed=st.integers(0, 10_000))
def test_after_the_gaps_no_water_is_out_of_reach(seed):
    asked = request(lake(seed), spacings=12)
    waters, spacing = prepared_waters(asked, 1000.0 / 6), 200.0
    transects = place_transects(waters.cells, 2 * spacing, phase=0.25, min_length_m=2 * spacing)
    circuit = plan_circuit(waters.cells, transects, trim_m=60.0, inset_m=160.0)
    brush = Brush(waters.free, spacing / 2, 60.0)
    start = dilated_circuit(circuit, brush) if transects else waters.free.representative_point().buffer(20.0)
    walk = reach_gaps(
        Walk(Polygon(start.exterior)), brush, waters.probe, waters.routes, reach_m=150.0, cut_width_m=50.0
    )
    assert waters.probe.distances(walk.ring).max() <= 150.0
    assert waters.free.buffer(1e-6).covers(walk.ring)


def test_covered_needs_a_step_within_reach():
    points = np.array([[0.0, 0.0], [3.0, 0.0]])
    assert all_within_reach(points, np.array([[1.0, 0.0]]), 2.0)
    assert not all_within_reach(points, np.array([[1.0, 0.0]]), 1.5)
    assert not all_within_reach(points, np.empty((0, 2)), 1.5)
    assert all_within_reach(np.empty((0, 2)), np.empty((0, 2)), 1.0)


def test_a_ring_in_narrow_water_that_all_but_touches_itself_is_smoothed_by_less():
    """Twice as wide as the moat, the first smoothings leave nothing of it."""
    plan = handle(request(nasty_polygons()["ring"], spacings=8.0), discard)
    assert plan.path.is_simple


def test_bands_of_ways_of_many_corners_are_as_plain_as_those_of_few():
    """A way along a narrow channel turns at every corner of either bank."""
    channel = box(-10, -0.03, 110, 0.03)
    across = 0.005 * (-1.0) ** np.arange(2001)
    way = LineString(np.column_stack([np.linspace(0, 100, 2001), across]))
    for free in (channel, OPEN):
        band = Brush(free, half_width_m=3.0, margin_m=2.0).bands([way])
        assert band.covers(way.intersection(free))
        assert shapely.get_num_coordinates(band) < 100


def test_branches_in_a_folded_canal_take_memory_by_its_length_and_not_by_pairs():
    """A branch of many steps passes many gaps, each near to steps of several folds."""
    folds = [(2.0 * k, 100.0 * (side % 2)) for k in range(12) for side in (k, k + 1)]
    canal = LineString(folds).buffer(0.5, cap_style="flat", join_style="mitre")
    probe, routes = Probe.over(canal, 0.4), Routes(canal, 1.0)
    brush = Brush(canal, half_width_m=0.6, margin_m=0.1)
    start = Walk(canal.intersection(box(-1, -1, 0.6, 5)))
    tracemalloc.start()
    try:
        walk = reach_gaps(start, brush, probe, routes, reach_m=4.0, cut_width_m=0.2)
        _, most_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert probe.distances(walk.ring).max() <= 4.0
    assert most_bytes < 400 * len(probe.points)
