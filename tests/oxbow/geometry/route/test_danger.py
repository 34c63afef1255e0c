"""Danger zones: what they cost, how probabilities add up, and how routes avoid them."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from oxbow.contracts import DangerZone, Per
from oxbow.errors import InvalidRequest
from oxbow.geometry.route import Danger, RouteMethod, make_router
from tests.support.route_scenes import places_in, scene, scene_router

quick = settings(max_examples=10)
every_method = pytest.mark.parametrize("method", RouteMethod)
WATER = box(0, 0, 100, 100)
MIDDLE = box(40, 30, 60, 70)


def per_metre(probability, area=MIDDLE):
    return DangerZone(name="shallows", area=area, probability=probability, per=Per.METRE)


def per_crossing(probability, area=MIDDLE):
    return DangerZone(name="lane", area=area, probability=probability)


def edges(*places):
    places = np.array(places, dtype=float)
    return places[:-1], places[1:]


def test_an_edge_costs_its_length_and_what_its_hazard_counts():
    danger = Danger((per_crossing(0.3),), c_max_m=50.0, a=1.5)
    starts, ends = edges((0, 50), (100, 50), (100, 0))
    costs = danger.costs(starts, ends)
    assert costs[0] == pytest.approx(100 - 50 * 1.5 * math.log(1 - 0.3), abs=1e-4)
    assert costs[1] == 50.0


def test_probabilities_of_harm_multiply_over_edges():
    danger = Danger((per_metre(0.01),))
    starts, ends = edges((0, 50), (45, 50), (52, 52), (100, 50))
    probability = 1 - np.exp(-danger.hazards(starts, ends))
    whole = 1 - np.prod(1 - probability)
    inside_m = shapely.intersection(shapely.LineString([(0, 50), (45, 50), (52, 52), (100, 50)]), MIDDLE).length
    assert whole == pytest.approx(1 - 0.99**inside_m, abs=1e-6)


@quick
@given(cuts=st.lists(st.floats(0.01, 0.99), max_size=6, unique=True), back=st.booleans())
def test_danger_does_not_depend_on_how_a_way_is_divided(cuts, back):
    zones = (per_metre(0.02), per_crossing(0.4), per_crossing(0.1, box(50, 0, 55, 100)))
    danger = Danger(zones, c_max_m=100.0, a=3.0)
    share = np.array([0.0, *sorted(cuts, reverse=back), 1.0] if not back else [1.0, *sorted(cuts)[::-1], 0.0])
    places = np.column_stack([100 * share, 40 + 20 * share])
    for figure in (danger.hazards, danger.costs):
        assert figure(places[:-1], places[1:]).sum() == pytest.approx(
            figure(*edges((0, 40), (100, 60))).sum(), rel=1e-6
        )


def test_each_crossing_counts_once():
    bay = Polygon([(20, 20), (80, 20), (80, 40), (70, 40), (70, 30), (30, 30), (30, 40), (20, 40)])
    danger = Danger((per_crossing(0.5, bay),))
    once, twice = danger.hazards(*edges((50, 0), (50, 60))), danger.hazards(*edges((0, 35), (100, 35)))
    assert twice == pytest.approx(2 * once)
    assert 1 - math.exp(-twice.sum()) == pytest.approx(1 - 0.5 * 0.5)
    start_inside = np.array([[25.0, 35.0]])
    assert danger.hazards_at(start_inside) == pytest.approx(math.log(2))
    assert danger.hazards(start_inside, np.array([[0.0, 35.0]])) == 0.0


def test_the_outline_of_a_zone_is_outside():
    danger = Danger((per_metre(0.5), per_crossing(0.5)))
    assert danger.hazards(*edges((40, 30), (40, 70), (60, 70), (60, 30), (40, 30))).tolist() == [0.0] * 4


@every_method
@quick
@given(seed=st.integers(0, 10_000), factor=st.floats(1.0, 1e3))
def test_without_zones_or_with_zones_without_danger_routes_are_unchanged(seed, method, factor):
    water = scene(seed)
    start, goal = places_in(water, 2, seed)
    plain = scene_router(method, water).route(start, goal)
    for zones in ((), (per_metre(0.0), per_crossing(0.0))):
        other = scene_router(method, water, Danger(zones, c_max_m=1e4, a=factor)).route(start, goal)
        assert np.array_equal(plain.polyline, other.polyline)
        assert other.cost == plain.length_m
        assert other.danger == 0.0


@quick
@given(
    seed=st.integers(0, 10_000),
    factors=st.lists(st.floats(1.0, 50.0), min_size=2, max_size=4),
    crossing=st.floats(0.0, 0.9),
    metre=st.floats(0.0, 0.05),
)
def test_who_is_less_fit_never_takes_more_danger(seed, factors, crossing, metre):
    water = scene(seed, obstacles=3)
    start, goal = places_in(water, 2, seed)
    zones = (per_crossing(crossing, box(10, 10, 50, 45)), per_metre(metre), per_crossing(0.3, box(45, 60, 90, 75)))
    dangers = [Danger(zones, c_max_m=40.0, a=factor) for factor in sorted(factors)]
    routes = [make_router(RouteMethod.VISIBILITY, water, danger).route(start, goal) for danger in dangers]
    taken = np.array([route.danger for route in routes])
    assert (np.diff(taken) <= 1e-6).all()
    lengths = np.array([route.length_m for route in routes])
    assert (np.diff(lengths) >= -1e-3).all()


def test_a_less_fit_vehicle_goes_round_where_a_fit_one_does():
    """The way round has more edges than the way through."""
    lane = per_crossing(0.9, box(40, 20, 60, 80))
    for factor in (1.0, 1.5, 10.0, 1e4):
        danger = Danger((lane,), c_max_m=50.0, a=factor)
        assert make_router(RouteMethod.VISIBILITY, WATER, danger).route((10, 50), (90, 50)).danger == 0.0


@quick
@given(seed=st.integers(0, 10_000), detail_m=st.floats(5.0, 30.0), factor=st.floats(1.0, 9.0))
def test_costs_do_not_depend_on_how_the_water_is_triangulated(seed, detail_m, factor):
    water = scene(seed, obstacles=3)
    start, goal = places_in(water, 2, seed)
    lane = box(10, 10, 50, 45)
    found = [
        make_router(
            RouteMethod.VISIBILITY,
            shapely.segmentize(water, detail),
            Danger((per_crossing(0.2, shapely.segmentize(lane, detail)),), c_max_m=100.0, a=factor),
        ).route(start, goal)
        for detail in (1e9, detail_m)
    ]
    assert found[0].cost == pytest.approx(found[1].cost, rel=1e-6)


@every_method
@pytest.mark.parametrize("zone", [per_metre(0.05), per_crossing(0.6)])
def test_a_zone_is_travelled_or_avoided_as_it_is_worth(method, zone):
    start, goal = (20, 50), (80, 50)
    careless = make_router(method, WATER, Danger((zone,), c_max_m=0.0)).route(start, goal)
    careful = make_router(method, WATER, Danger((zone,), c_max_m=1e4)).route(start, goal)
    inside_m = 20.0 if zone.per is Per.METRE else 1.0
    if method is RouteMethod.VISIBILITY:
        assert careless.danger == pytest.approx(1 - (1 - zone.probability) ** inside_m, abs=1e-6)
        assert careful.length_m == pytest.approx(20 + 2 * math.hypot(20, 20))
    assert careful.danger == 0.0
    assert careful.cost == careful.length_m > careless.length_m


@every_method
@quick
@given(seed=st.integers(0, 10_000), factor=st.floats(1.0, 2.0))
def test_distances_and_tables_are_the_costs_lengths_and_lines_of_the_routes(seed, method, factor):
    water = scene(seed, obstacles=3)
    points = places_in(water, 4, seed)
    danger = Danger((per_metre(0.01), per_crossing(0.2, box(10, 10, 50, 45))), c_max_m=100.0, a=factor)
    router = scene_router(method, water, danger)
    distances, table = router.distances(points), router.table(points)
    exact = make_router(RouteMethod.VISIBILITY, water).distances(points)
    assert np.array_equal(distances, distances.T)
    assert (distances >= exact - 1e-6).all()
    assert np.array_equal(table.costs, distances)
    assert np.array_equal(table.lengths_m, table.lengths_m.T)
    for i, j in ((0, 1), (1, 3)):
        route = router.route(points[i], points[j])
        assert route.cost == pytest.approx(distances[i, j], rel=1e-6)
        assert route.cost == pytest.approx(worth_m(route.length_m, route.danger, factor))
    for i, j in ((0, 1), (3, 1), (2, 2)):
        line = table.polyline(i, j)
        assert np.array_equal(line[[0, -1]], np.array([points[i], points[j]]))
        assert np.hypot(*np.diff(line, axis=0).T).sum() == pytest.approx(table.lengths_m[i, j])
        worth = worth_m(table.lengths_m[i, j], danger.probability(line), factor)
        assert i == j or distances[i, j] == pytest.approx(worth)


def worth_m(length_m, danger, factor):
    """What a route costs where a chance of no harm e times as good is worth 100 m."""
    return length_m - 100.0 * factor * math.log1p(-danger)


def test_a_danger_of_1_is_refused_by_name():
    for probability in (1.0, 1.5, -0.1, math.nan):
        with pytest.raises(InvalidRequest, match=r"shallows: has danger .*expected 0 <= danger < 1"):
            per_metre(probability)
    with pytest.raises(InvalidRequest, match="lane: is empty"):
        per_crossing(0.5, Polygon())
    with pytest.raises(InvalidRequest, match=r"a: is 0\.9; expected a finite number, >= 1"):
        Danger(a=0.9)
    with pytest.raises(InvalidRequest, match="c_max_m: is inf"):
        Danger(c_max_m=math.inf)
