"""The refinement: what it may never break, and what it is for."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, box

from oxbow.contracts import WeightedArea
from oxbow.tolerances import ROUNDING_M
from oxbow_path.refinement import Guard, Polyline, RefinementStep, Samples, refined_path, smoothed_path
from oxbow_path.refinement import guard as guard_module
from oxbow_path.refinement.nearness import nearer
from oxbow_path.refinement.pull import Pull, feet
from tests.support.path_requests import lake

quick = settings(max_examples=15)

SQUARE = box(0, 0, 1000, 1000)
MEANDER = LineString(
    [
        (50, 500),
        (50, 950),
        (350, 950),
        (350, 300),
        (550, 300),
        (550, 950),
        (950, 950),
        (950, 50),
        (50, 50),
        (50, 500),
    ]
)
"""Closed, simple, inside the square, and uneven."""


def never() -> bool:
    return False


def unseen(_number: int, _step: RefinementStep) -> None:
    """For a caller that does not look."""


def walk_inside(water: Polygon, spacing_m: float) -> LineString:
    """A closed path inside: the shore of the water less a strip, opened nowhere."""
    inner = water.buffer(-spacing_m / 2)
    part = max(shapely.get_parts(inner), key=lambda piece: piece.area)
    return LineString(part.simplify(spacing_m / 20).exterior)


def conforms(path: LineString, water: Polygon) -> bool:
    return bool(path.is_simple and water.buffer(1e-5).covers(path))


@quick
@given(seed=st.integers(0, 10_000), reach=st.floats(0.05, 4.0))
def test_no_move_leads_outside_or_across(seed, reach):
    water, spacing_m = lake(seed), 120.0
    path = Polyline.of(walk_inside(water, spacing_m), water.buffer(1e-6)).divided(0.6 * spacing_m)
    guard = Guard.of(water, path, spacing_m)
    random = np.random.default_rng(seed)
    for _ in range(6):
        moved = guard.moved(path, path.nodes + random.normal(0, reach * spacing_m, path.nodes.shape))
        assert conforms(moved.line, water)
        assert (moved.nodes[[0, -1]] == path.nodes[[0, -1]]).all()
        path = moved
    thinned = guard.thinned(path, path.crowded(2 * spacing_m))
    assert conforms(thinned.line, water)
    assert len(thinned.nodes) <= len(path.nodes)


@quick
@given(seed=st.integers(0, 10_000), reach=st.floats(0.01, 2.0))
def test_faults_are_those_that_lines_have(seed, reach):
    water, spacing_m = lake(seed), 120.0
    path = Polyline.of(walk_inside(water, spacing_m), water.buffer(1e-6)).divided(0.6 * spacing_m)
    guard = Guard.of(water, path, spacing_m)
    random = np.random.default_rng(seed)
    step = random.normal(0, reach * spacing_m, path.nodes.shape)
    moved = path.moved(path.nodes + np.where(path.pinned[:, None], 0.0, step))
    lines = shapely.linestrings(np.stack([moved.nodes[:-1], moved.nodes[1:]], axis=1))
    apart = np.abs(np.subtract.outer(np.arange(len(lines)), np.arange(len(lines))))
    apart = np.minimum(apart, len(lines) - apart)
    near = shapely.dwithin(lines[:, None], lines[None], guard.clearance_m) & (apart > 2)
    crossed = shapely.intersects(lines[:, None], lines[None]) & (apart > 1)
    expected = ~shapely.covers(guard.free, lines) | near.any(axis=1) | crossed.any(axis=1)
    edge = np.diff(moved.nodes, axis=0)
    unit = edge / np.hypot(*edge.T)[:, None]
    folds = (unit[:-1] * unit[1:]).sum(axis=1) < -0.9999
    expected[:-1] |= folds
    expected[1:] |= folds
    assert (guard.faults(moved) == expected).all()


def test_what_may_move_moves():
    path = Polyline.of(MEANDER, SQUARE.buffer(1e-6))
    target = path.nodes + np.array([10.0, 0.0])
    moved = Guard.of(SQUARE, path, 300.0).moved(path, target)
    assert (moved.nodes[1:-1] == target[1:-1]).all()


def test_legs_outside_the_free_space_stay():
    free = box(0, 100, 1000, 1000)
    line = LineString([(500, 0), (500, 150), (200, 900), (800, 900), (510, 150), (500, 0)])
    path = Polyline.of(line, free.buffer(1e-6))
    assert path.legs.tolist() == [True, False, False, False, True]
    assert path.pinned.tolist() == [True, True, False, False, True, True]
    guard = Guard.of(free, path, 300.0)
    moved = guard.moved(path, path.nodes + np.array([0.0, 50.0]))
    assert (moved.nodes[path.pinned] == path.nodes[path.pinned]).all()
    assert (moved.nodes[~path.pinned] == path.nodes[~path.pinned] + np.array([0.0, 50.0])).all()


SHARP = LineString(
    [(50, 50), (50, 900), (900, 900), (950, 60), (701, 100), (700, 400), (700, 100), (400, 50), (50, 50)]
)
"""Closed, simple, inside the square, and out and back on nearly one line."""


def test_one_sharp_place_does_not_hold_the_rest():
    line = SHARP
    assert line.is_simple
    path = Polyline.of(line, SQUARE.buffer(1e-6)).divided(60.0)
    guard = Guard(SQUARE.buffer(1e-6), 5.0, 250.0)
    assert guard.faults(path).any()
    target = path.nodes + np.where(path.nodes[:, :1] < 300, 20.0, 0.0)
    moved = guard.moved(path, target)
    assert moved.line.is_simple
    assert (moved.nodes[1:-1] == target[1:-1]).all()
    refined = refine(line, SQUARE, 1.3 * line.length)
    assert conforms(refined, SQUARE)
    assert refined.length >= 1.2 * line.length


@pytest.mark.parametrize("spacing_m", [250.0, 30.0])
def test_a_sharp_place_is_excused_before_all_shares_are_tried_in_vain(spacing_m, monkeypatch):
    path = Polyline.of(SHARP, SQUARE.buffer(1e-6)).divided(60.0)
    guard = Guard(SQUARE.buffer(1e-6), 5.0, spacing_m)
    checks = []
    monkeypatch.setattr(guard_module, "nearer", lambda *of: checks.append(of) or nearer(*of))
    target = path.nodes + np.where(path.nodes[:, :1] < 300, 20.0, 0.0)
    moved = guard.moved(path, target)
    assert (moved.nodes[1:-1] == target[1:-1]).all()
    assert len(checks) < guard_module.ROUNDS


@pytest.mark.parametrize("apart_m", [40.0, 1e-7])
def test_a_bend_does_not_close_to_where_rounding_could_cross_it(apart_m):
    bend = [(500, 900), (500, 300), (500 + apart_m, 300), (600, 900)]
    line = LineString([(50, 50), (50, 900), *bend, (950, 900), (950, 50), (50, 50)])
    path = Polyline.of(line, SQUARE.buffer(1e-6))
    target = path.nodes.copy()
    target[4, 0] = 500.0 + 1e-9
    moved = Guard.of(SQUARE, path, 300.0).moved(path, target)
    assert LineString(moved.nodes[2:4]).distance(LineString(moved.nodes[4:6])) >= min(ROUNDING_M, apart_m / 2)


def test_stretches_keep_their_distance():
    path = Polyline.of(LineString([(0, 0), (0, 900), (300, 900), (300, 0), (0, 0)]), SQUARE.buffer(1e-6))
    path = path.divided(100.0)
    guard = Guard.of(SQUARE, path, 300.0)
    target = path.nodes.copy()
    target[path.nodes[:, 0] == 300.0, 0] = 1.0
    moved = guard.moved(path, target)
    assert moved.line.is_simple
    up, down = (moved.nodes[:, 0] < 0.5) & (moved.nodes[:, 1] > 100), moved.nodes[:, 0] > 0.5
    assert np.abs(moved.nodes[up, 0].max() - moved.nodes[down, 0].min()) >= guard.clearance_m


@quick
@given(seed=st.integers(0, 10_000))
def test_feet_are_the_nearest_places(seed):
    random = np.random.default_rng(seed)
    nodes = np.cumsum(random.normal(0, 50, (40, 2)), axis=0)
    path = Polyline.of(LineString(nodes), box(-1e5, -1e5, 1e5, 1e5))
    points = random.uniform(nodes.min(axis=0), nodes.max(axis=0), (200, 2))
    at = feet(path, points, 30.0)
    exact = shapely.distance(path.line, shapely.points(points))
    assert (at.distance_m >= exact - 1e-9).all()
    # Points of the path stand 4.5 m apart: a nearer segment can be overlooked by half of that.
    assert at.distance_m == pytest.approx(exact, abs=2.3)
    assert np.hypot(*(at.on(path.nodes) - points).T) == pytest.approx(at.distance_m)


def test_tension_keeps_the_length():
    path = Polyline.of(MEANDER, SQUARE.buffer(1e-6)).divided(60.0)
    samples = Samples.over(SQUARE, 25.0)
    at = feet(path, samples.points, 250.0)
    pull = Pull.of(path, samples, at, np.ones(len(samples)), step=0.5, spacing_m=250.0)
    for share in (0.9, 1.0, 1.1):
        nodes = pull.fitted(share * path.length_m, None, 250.0).nodes
        assert np.hypot(*np.diff(nodes, axis=0).T).sum() <= share * path.length_m


@pytest.mark.parametrize("heaviest", [1e12, 1e18, 1e24])
def test_samples_that_pull_far_more_than_others_leave_a_solution(heaviest):
    path = Polyline.of(MEANDER, SQUARE.buffer(1e-6)).divided(60.0)
    samples = Samples.over(SQUARE, 25.0)
    at = feet(path, samples.points, 250.0)
    pulls = np.ones(len(samples))
    inner = np.flatnonzero((at.share > 0.2) & (at.share < 0.8))
    pulls[inner[np.unique(at.segment[inner], return_index=True)[1][::9]]] = heaviest
    pull = Pull.of(path, samples, at, pulls, step=0.5, spacing_m=250.0)
    assert np.isfinite(pull.fitted(path.length_m, None, 250.0).nodes).all()


def test_a_lattice_leaves_no_hole():
    water = lake(3)
    samples = Samples.over(water, 40.0)
    random = np.random.default_rng(1)
    x0, y0, x1, y1 = water.bounds
    points = random.uniform((x0, y0), (x1, y1), (4000, 2))
    points = points[shapely.contains_xy(water, points)]
    distance, _ = shapely.STRtree(shapely.points(samples.points)).query_nearest(
        shapely.points(points), return_distance=True, all_matches=False
    )[::-1]
    assert distance.max() <= 40.0
    assert shapely.covers(water.buffer(1e-6), shapely.points(samples.points)).all()


def refine(path: LineString, water: Polygon, length_m: float, areas=(), stop=never) -> LineString:
    spacing_m = water.area / length_m
    return refined_path(
        Polyline.of(path, water.buffer(1e-6)),
        water,
        Samples.over(water, 0.25 * spacing_m, areas),
        length_m=length_m,
        spacing_m=spacing_m,
        stop=stop,
        watch=unseen,
    )


@quick
@given(seed=st.integers(0, 10_000))
def test_refined_paths_conform_and_serve_better(seed):
    water = lake(seed)
    start = walk_inside(water, 150.0)
    length_m = 1.5 * start.length
    path = refine(start, water, length_m)
    assert conforms(path, water)
    assert 0.95 * length_m <= path.length <= length_m
    assert path.coords[0] == path.coords[-1] == start.coords[0]
    samples = Samples.over(water, 30.0).points
    before, after = (shapely.distance(line, shapely.points(samples)).max() for line in (start, path))
    assert after < before


def test_the_same_again():
    start = walk_inside(lake(1), 150.0)
    assert refine(start, lake(1), 1.3 * start.length) == refine(start, lake(1), 1.3 * start.length)


def test_a_path_too_long_is_shortened():
    path = refine(MEANDER, SQUARE, 0.9 * MEANDER.length)
    assert path.length <= 0.9 * MEANDER.length
    assert conforms(path, SQUARE)


def test_no_time_leaves_the_path_as_it_was():
    path = refine(MEANDER, SQUARE, 1.5 * MEANDER.length, stop=lambda: True)
    assert path.length == pytest.approx(MEANDER.length)
    assert path.equals(MEANDER)


def test_a_path_near_enough_to_all_water_is_left_as_it_is():
    samples = Samples.over(SQUARE, 30.0)
    farthest_m = shapely.distance(MEANDER, shapely.points(samples.points)).max()
    for enough_m, is_left in ((1.01 * farthest_m, True), (0.99 * farthest_m, False)):
        path = refined_path(
            Polyline.of(MEANDER, SQUARE),
            SQUARE,
            samples,
            length_m=1.5 * MEANDER.length,
            spacing_m=150.0,
            enough_m=enough_m,
            stop=never,
            watch=unseen,
        )
        assert (path.length == pytest.approx(MEANDER.length)) is is_left


def test_rigid_segments_stay_straight():
    spacing_m = SQUARE.area / MEANDER.length
    across, along = np.abs(np.diff(shapely.get_coordinates(MEANDER), axis=0)).T
    rigid = (across == 0.0) & (along > 300.0)
    moved = refined_path(
        Polyline.of(MEANDER, SQUARE.buffer(1e-6), rigid),
        SQUARE,
        Samples.over(SQUARE, 0.2 * spacing_m),
        length_m=MEANDER.length,
        spacing_m=spacing_m,
        stop=never,
        watch=unseen,
    )
    assert sorted(np.hypot(*np.diff(shapely.get_coordinates(moved), axis=0).T))[-rigid.sum()] > 300.0


def test_weights_ask_for_denser_legs():
    west = box(0, 0, 500, 1000)
    areas = [WeightedArea(area=west, weight=3.0)]
    start = walk_inside(SQUARE, 100.0)
    path = refine(start, SQUARE, 3 * start.length, areas)
    even = refine(start, SQUARE, 3 * start.length)
    assert path.intersection(west).length > 1.5 * path.difference(west).length
    assert even.intersection(west).length == pytest.approx(even.difference(west).length, rel=0.1)


def turns(path: LineString) -> np.ndarray:
    heading = np.arctan2(*np.diff(shapely.get_coordinates(path), axis=0).T)
    return np.abs((np.diff(heading) + math.pi) % (2 * math.pi) - math.pi)


@quick
@given(seed=st.integers(0, 10_000))
def test_smoothing_rounds_corners_and_keeps_the_rest(seed):
    water = lake(seed)
    path = walk_inside(water, 150.0)
    smooth = smoothed_path(Polyline.of(path, water.buffer(1e-6)), water, 150.0)
    assert conforms(smooth, water)
    assert smooth.length <= path.length
    assert smooth.coords[0] == path.coords[0]
    assert smooth.hausdorff_distance(path) <= 30.0
    assert np.quantile(turns(smooth), 0.99) < np.quantile(turns(path), 0.99)


def test_smoothing_leaves_straight_lines_straight():
    path = LineString([(0, 500), (900, 500), (900, 900)])
    smooth = smoothed_path(Polyline.of(path, SQUARE.buffer(1e-6)), SQUARE, 100.0)
    assert smooth.distance(Point(450, 500)) < 1e-9
    assert smooth.distance(Point(900, 500)) > 1.0
