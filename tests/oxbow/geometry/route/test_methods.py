"""What every method of finding routes holds to, and what each of them promises."""

from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra
from shapely import LineString, MultiPolygon, Point, Polygon, affinity, box

from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.lattice import RINGS, joined_lattice
from oxbow.geometry.route import RouteMethod, make_router, visibility
from oxbow.geometry.route.channel import Channel
from oxbow.geometry.route.funnel import funnel_line
from oxbow.geometry.route.incenters import incenters
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.geometry.route.network import NetworkRouter
from oxbow.geometry.route.sights import sights
from oxbow.geometry.route.tessellation import Tessellation
from oxbow.geometry.route.visibility import VisibilityGraph
from oxbow.testing import nasty_polygons
from tests.support.route_scenes import places_in, scene, scene_router

ROUNDING_M = 1e-6
quick = settings(max_examples=15)
seeds = st.integers(0, 100_000)
every_method = pytest.mark.parametrize("method", RouteMethod)


def straight_m(points):
    return np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))


def require_route(route, start, goal, water):
    assert np.array_equal(route.polyline[0], start)
    assert np.array_equal(route.polyline[-1], goal)
    assert water.buffer(ROUNDING_M).covers(route.line)
    assert route.length_m == pytest.approx(route.line.length)
    assert route.length_m >= np.hypot(*(goal - start)) - ROUNDING_M
    assert route.cost == route.length_m
    assert route.danger == 0.0
    assert route.clearance_m == pytest.approx(route.line.distance(water.boundary), abs=ROUNDING_M)


def brute_force(water, points):
    """Distances over all pairs of vertices that see each other, one by one."""
    places = np.vstack([points, np.unique(shapely.get_coordinates(water), axis=0)])
    one, other = np.triu_indices(len(places), 1)
    grown = water.buffer(1e-9)
    shapely.prepare(grown)
    seen = shapely.covers(grown, shapely.linestrings(np.stack([places[one], places[other]], axis=1)))
    length = np.full((len(places), len(places)), np.inf)
    length[one[seen], other[seen]] = np.hypot(*(places[one] - places[other])[seen].T)
    return dijkstra(length, directed=False, indices=np.arange(len(points)))[:, : len(points)]


@quick
@given(seed=seeds)
def test_bends_that_look_about_by_and_by_see_what_they_see_at_once(seed):
    mesh = WaterMesh.of(scene(seed))
    at_once = VisibilityGraph(mesh).arcs
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(visibility, "EYES", 3)
        by_and_by = VisibilityGraph(mesh).arcs
    for array in ("tails", "heads", "costs"):
        assert np.array_equal(getattr(by_and_by, array), getattr(at_once, array))


def test_what_bends_see_along_straight_channels_is_sought_for_some_of_them_at_a_time(monkeypatch):
    eyes_at_once = []

    def counted(mesh, eyes, at, *rest):
        eyes_at_once.append(len(np.unique(at.place)))
        return sights(mesh, eyes, at, *rest)

    monkeypatch.setattr(visibility, "EYES", 10)
    monkeypatch.setattr(visibility, "sights", counted)
    graph = VisibilityGraph(WaterMesh.of(scene(1)))
    assert len(graph.arcs.tails) > 0
    assert sum(eyes_at_once) == len(graph.places)
    assert max(eyes_at_once) <= 10 < len(graph.places)


@every_method
@pytest.mark.parametrize("name", sorted(nasty_polygons()))
def test_routes_of_nasty_shapes_keep_to_the_water(name, method):
    water = nasty_polygons()[name]
    points = np.vstack([places_in(water, 4, seed=1), shapely.get_coordinates(water)[:1]])
    router = make_router(method, water)
    distances = router.distances(points)
    exact = make_router(RouteMethod.VISIBILITY, water).distances(points)
    assert np.array_equal(distances, distances.T)
    assert (distances >= exact - ROUNDING_M).all()
    assert (exact >= straight_m(points) - ROUNDING_M).all()
    for i, j in ((0, 1), (1, 4), (2, 3)):
        route = router.route(points[i], points[j])
        require_route(route, points[i], points[j], water)
        assert route.method is method
        assert route.length_m == pytest.approx(distances[i, j], abs=ROUNDING_M)


@quick
@given(seed=seeds)
def test_the_visibility_graph_is_exact(seed):
    water = scene(seed)
    points = places_in(water, 8, seed)
    distances = make_router(RouteMethod.VISIBILITY, water).distances(points)
    assert np.allclose(distances, brute_force(water, points), atol=ROUNDING_M)
    assert (distances[:, :, None] + distances[None] >= distances[:, None, :] - ROUNDING_M).all()


@quick
@given(seed=seeds, angle=st.floats(-180, 180), shift=st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)))
def test_turning_and_moving_the_water_changes_no_distance(seed, angle, shift):
    water = scene(seed)
    points = places_in(water, 6, seed)
    here = make_router(RouteMethod.VISIBILITY, water).distances(points)
    moved = [
        affinity.translate(affinity.rotate(each, angle, origin=(0, 0)), *shift)
        for each in (water, LineString(points))
    ]
    there = make_router(RouteMethod.VISIBILITY, moved[0]).distances(shapely.get_coordinates(moved[1]))
    assert np.allclose(here, there, atol=1e-5)


@every_method
@quick
@given(seed=seeds)
def test_there_and_back_are_equally_far(seed, method):
    water = scene(seed)
    start, goal = places_in(water, 2, seed)
    router = scene_router(method, water)
    there, back = router.route(start, goal), router.route(goal, start)
    exact = make_router(RouteMethod.VISIBILITY, water).route(start, goal).length_m
    # Routes through channels may fall to another of equal channels, reduced ones to another reduction.
    assert min(there.length_m, back.length_m) >= exact - ROUNDING_M
    if method in (RouteMethod.VISIBILITY, RouteMethod.FUNNEL):
        assert there.length_m == pytest.approx(back.length_m)


@quick
@given(seed=seeds)
def test_incenters_keep_clear_of_the_shore_where_the_funnel_touches_it(seed):
    water = scene(seed)
    roomy = water.buffer(-1.0)
    points = places_in(water, 12, seed)
    points = points[shapely.contains_xy(roomy, points)]
    funnel, clear = (make_router(method, water) for method in (RouteMethod.FUNNEL, RouteMethod.INCENTERS))
    for start, goal in pairwise(points):
        tight, wide = funnel.route(start, goal), clear.route(start, goal)
        assert wide.clearance_m > ROUNDING_M
        assert wide.length_m >= tight.length_m - ROUNDING_M
        if len(tight.polyline) > 2:
            assert tight.clearance_m < ROUNDING_M


def test_a_square_round_an_island_is_measured_by_hand():
    water = box(0, 0, 100, 100).difference(box(40, 20, 60, 80))
    route = make_router(RouteMethod.VISIBILITY, water).route((30, 50), (70, 50))
    assert route.length_m == pytest.approx(20 + 2 * np.hypot(10, 30))
    assert len(route.polyline) == 4
    assert route.clearance_m == 0.0


def test_water_that_meets_in_a_point_lets_nobody_through():
    water = box(0, 0, 100, 100).difference(
        shapely.union_all([box(0, 40, 50, 60), Polygon([(50, 50), (70, 40), (70, 60)])])
    )
    start, goal = (45, 30), (55, 70)
    for method in RouteMethod:
        route = make_router(method, water).route(start, goal)
        assert route.length_m > np.hypot(25, 10) + np.hypot(15, 10)
    through_the_point = make_router(RouteMethod.VISIBILITY, water).distances([start, (50, 50), goal])
    assert through_the_point[0, 2] > through_the_point[0, 1] + through_the_point[1, 2] + 1.0


# ---------------------------------------------------------------------------- tessellation


@pytest.mark.parametrize(("rings", "error"), [(RINGS[:1], 0.155), (RINGS, 0.015)])
def test_ways_over_the_open_lattice_err_as_the_report_says(rings, error):
    places, pairs = joined_lattice(np.zeros(2), np.full(2, 20.0), 1.0, rings)
    length = np.zeros((len(places), len(places)))
    length[pairs[:, 0], pairs[:, 1]] = np.hypot(*(places[pairs[:, 0]] - places[pairs[:, 1]]).T)
    middle = np.argmin(np.hypot(*(places - 10.0).T))
    away = np.hypot(*(places - places[middle]).T)
    far = (away > 1.0) & (away < 9.0)
    errors = dijkstra(length, directed=False, indices=middle)[far] / away[far] - 1.0
    assert 0.9 * error < errors.max() <= error


@quick
@given(seed=seeds)
def test_reduced_ways_over_the_lattice_are_nearly_exact(seed):
    water = scene(seed, obstacles=4)
    points = places_in(water, 6, seed)
    exact = make_router(RouteMethod.VISIBILITY, water).distances(points)
    fine = Tessellation(WaterMesh.of(water), side_m=1.5)
    near = NetworkRouter(fine, RouteMethod.TESSELLATION, fine.reduced).distances(points)
    off = ~np.eye(len(points), dtype=bool)
    assert (near[off] <= 1.015 * exact[off]).all()


def test_a_lattice_needs_a_side():
    mesh = WaterMesh.of(box(0, 0, 100, 100))
    for side_m in (0.0, -1.0, np.nan, np.inf, 0.01):
        with pytest.raises(InvalidRequest, match=r"side_m: is .*expected a finite number >= 0\.1"):
            Tessellation(mesh, side_m=side_m)


# ---------------------------------------------------------------------------- channels


def test_the_funnel_bends_at_gates_that_the_straight_line_misses():
    channel = Channel(
        start=np.array([0.0, 0.0]),
        goal=np.array([10.0, 0.0]),
        left=np.array([[2.0, 3.0], [5.0, 4.0], [8.0, 3.0]]),
        right=np.array([[2.0, -1.0], [5.0, 2.0], [8.0, -1.0]]),
        corners=np.zeros((4, 3, 2)),
    )
    assert funnel_line(channel).tolist() == [[0, 0], [5, 2], [10, 0]]


@quick
@given(corners=st.lists(st.tuples(st.floats(-100, 100), st.floats(-100, 100)), min_size=3, max_size=3))
def test_incenters_are_equally_far_from_all_sides(corners):
    triangle = Polygon(corners)
    if triangle.area < 1e-3:
        return
    centre = Point(incenters(np.array([corners]))[0])
    sides = [LineString([corners[k - 1], corners[k]]).distance(centre) for k in range(3)]
    assert np.allclose(sides, 2 * triangle.area / triangle.length, rtol=1e-6)


# ---------------------------------------------------------------------------- errors


@every_method
def test_places_out_of_the_water_are_named(method):
    router = make_router(method, box(0, 0, 100, 100).difference(box(40, 40, 60, 60)))
    with pytest.raises(Infeasible, match=r"goal: at \(50, 55\) lies outside the water, 5 m from it"):
        router.route((10, 10), (50, 55))
    with pytest.raises(Infeasible, match=r"start: at \(-3, 10\) lies outside the water, 3 m from it"):
        router.route((-3, 10), (50, 10))
    with pytest.raises(Infeasible, match=r"points\[1\]"):
        router.distances([(10, 10), (50, 50)])
    with pytest.raises(InvalidRequest, match=r"points\[2\]: is \(nan, 0\)"):
        router.distances([(10, 10), (20, 20), (np.nan, 0)])
    with pytest.raises(InvalidRequest, match=r"start: has shape \(3,\)"):
        router.route((1, 2, 3), (1, 2))
    with pytest.raises(InvalidRequest, match="expected places of shape"):
        router.distances([1, 2, 3])


@every_method
def test_waters_apart_are_infinitely_far(method):
    router = make_router(method, MultiPolygon([box(0, 0, 10, 10), box(20, 0, 30, 10)]))
    distances = router.distances([(1, 1), (9, 9), (25, 5)])
    assert np.isinf(distances[:2, 2]).all()
    assert distances[0, 1] == pytest.approx(8 * np.sqrt(2))
    with pytest.raises(Infeasible, match=r"goal: .*no route leads there"):
        router.route((1, 1), (25, 5))


@every_method
def test_a_table_has_no_line_over_land(method):
    waters = MultiPolygon([box(0, 0, 100, 100), box(200, 0, 300, 100)])
    table = make_router(method, waters).table([(50.0, 50.0), (250.0, 50.0), (60.0, 60.0)])
    for start, goal in ((0, 1), (1, 0)):
        with pytest.raises(Infeasible, match=rf"points\[{goal}\]: no route leads from points\[{start}\]"):
            table.polyline(start, goal)
    assert np.array_equal(table.polyline(0, 2)[[0, -1]], [(50.0, 50.0), (60.0, 60.0)])


@every_method
def test_a_place_is_no_way_from_itself(method):
    router = make_router(method, scene(3))
    place = places_in(scene(3), 1, 0)[0]
    route = router.route(place, place)
    assert route.length_m == route.cost == 0.0
    assert router.distances([place]).tolist() == [[0.0]]


def test_water_must_be_a_polygon():
    for water in (Polygon(), Polygon([(0, 0), (1, 1), (1, 0), (0, 1)])):
        with pytest.raises(InvalidRequest, match="water: is empty or not a valid polygon"):
            make_router(RouteMethod.VISIBILITY, water)
