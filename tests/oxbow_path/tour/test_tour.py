"""The Tour method: sites, geodesic distances, solvers, outline, and the path they make."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from shapely import LineString, Point, Polygon, box

from oxbow.contracts import PathRequest
from oxbow.errors import Infeasible
from oxbow.testing import nasty_polygons
from oxbow_path.task import Task
from oxbow_path.tour.geodesic import ShoreSights
from oxbow_path.tour.local_search import shortened_tour
from oxbow_path.tour.outline import enclosed_region
from oxbow_path.tour.planner import TourPlan, plan_tour
from oxbow_path.tour.pruning import pruned_order
from oxbow_path.tour.pyvrp_solver import is_installed, polished_tour
from oxbow_path.tour.sites import cluster_centres, low_discrepancy, with_gaps
from oxbow_path.tour.slits import slit, slit_in_turn
from oxbow_path.tour.start import Start, first_tour
from oxbow_path.walk.region import largest
from tests.support.path_requests import lake, nasty_request, request

quick = settings(max_examples=8)

SQUARE = box(0, 0, 100, 100)
HORSESHOE = SQUARE.difference(box(20, 0, 80, 90))
NASTY = nasty_polygons()
SOLVERS = [
    shortened_tour,
    pytest.param(polished_tour, marks=pytest.mark.skipif(not is_installed(), reason="needs oxbow[tour]")),
]


def random_start(seed: int, count: int, free: Polygon = SQUARE, near_m: float = 1e4) -> Start:
    sites = low_discrepancy(free, count, seed=seed)
    return first_tour(ShoreSights(free).geodesics(sites), near_m)


# --------------------------------------------------------------------------- sites


@pytest.mark.parametrize("name", sorted(NASTY))
def test_samples_lie_in_the_water_and_share_it_by_area(name):
    water = NASTY[name]
    samples = low_discrepancy(water, 4000, seed=1)
    assert shapely.covers(water.buffer(1e-6), shapely.points(samples)).all()
    x0, y0, x1, y1 = water.bounds
    for part in (box(x0, y0, (x0 + x1) / 2, y1), box(x0, y0, x1, (y0 + y1) / 2)):
        share = np.count_nonzero(shapely.contains_xy(part, samples)) / len(samples)
        assert share == pytest.approx(part.intersection(water).area / water.area, abs=0.02)


def test_samples_are_more_even_than_random_ones():
    def largest_gap(points):
        probes = np.stack(np.meshgrid(np.arange(1, 100, 2.0), np.arange(1, 100, 2.0)), axis=-1).reshape(-1, 2)
        return cKDTree(points).query(probes)[0].max()

    chance = np.random.default_rng(0).random((400, 2)) * 100
    assert largest_gap(low_discrepancy(SQUARE, 400, seed=0)) < 0.8 * largest_gap(chance)


@quick
@given(seed=st.integers(0, 1000), count=st.integers(8, 60))
def test_clusters_lie_in_the_water_as_evenly_as_their_number_allows(seed, count):
    centres = cluster_centres(low_discrepancy(HORSESHOE, 25 * count, seed=seed), count, HORSESHOE)
    assert len(centres) == count
    assert shapely.contains_xy(HORSESHOE, centres).all()
    pitch = math.sqrt(HORSESHOE.area / count)
    probes = low_discrepancy(HORSESHOE, 500, seed=seed + 1)
    assert cKDTree(centres).query(probes)[0].mean() < 0.5 * pitch


def test_gaps_are_closed_and_nothing_else_is_added():
    points = low_discrepancy(SQUARE, 500, seed=0)
    sites = with_gaps(points[:5], points, 12.0)
    assert np.array_equal(sites[:5], points[:5])
    assert cKDTree(sites).query(points)[0].max() <= 12.0
    assert np.array_equal(with_gaps(sites, points, 12.0), sites)


# --------------------------------------------------------------------------- geodesic distances


@pytest.mark.parametrize("name", sorted(NASTY))
def test_geodesic_distances_are_those_of_ways_inside_and_no_shorter_than_straight(name):
    water = NASTY[name]
    sites = cluster_centres(low_discrepancy(water, 600, seed=2), 40, water)
    geodesics = ShoreSights(water).geodesics(sites)
    distance = np.array([geodesics.from_site(site) for site in range(len(sites))])
    assert np.isfinite(distance).all()
    assert distance == pytest.approx(distance.T)
    assert (distance >= np.hypot(*(sites[:, None] - sites).T) - 1e-6).all()
    order = np.arange(len(sites))
    way = LineString(geodesics.way(order))
    assert water.buffer(1e-6).covers(way)
    assert way.length == pytest.approx(distance[order, np.roll(order, -1)].sum(), abs=1e-5)
    near = geodesics.near(30.0).toarray()
    assert near == pytest.approx(np.where(distance <= 30.0, distance, 0.0))


def test_a_geodesic_turns_at_the_corners_of_the_shore():
    geodesics = ShoreSights(HORSESHOE).geodesics(np.array([[10.0, 0.0], [90.0, 0.0]]))
    expected = math.hypot(10, 90) * 2 + 60
    assert geodesics.from_site(0)[1] == pytest.approx(expected)
    assert LineString(geodesics.way([0, 1])).length == pytest.approx(2 * expected)


@quick
@given(seed=st.integers(0, 1000))
def test_the_spanning_tree_is_that_of_all_distances(seed):
    sites = low_discrepancy(HORSESHOE, 30, seed=seed)
    geodesics = ShoreSights(HORSESHOE).geodesics(sites)
    distance = np.array([geodesics.from_site(site) for site in range(30)])
    joined, length = {0}, 0.0
    while len(joined) < 30:
        rest = [site for site in range(30) if site not in joined]
        step, site = min((distance[a, b], b) for a in joined for b in rest)
        joined.add(site)
        length += step
    assert geodesics.spanning_tree().sum() == pytest.approx(length)


# --------------------------------------------------------------------------- tours


@pytest.mark.parametrize("name", sorted(NASTY))
def test_the_first_tour_passes_three_legs_of_the_tree_at_most(name):
    water = NASTY[name]
    geodesics = ShoreSights(water).geodesics(cluster_centres(low_discrepancy(water, 400, seed=3), 40, water))
    start = first_tour(geodesics, 10.0)
    assert sorted(start.order) == list(range(geodesics.count))
    legs = np.asarray(start.distances[start.order, np.roll(start.order, -1)])
    assert (legs > 0.0).all()
    assert legs.max() <= 3 * geodesics.spanning_tree().max() + 1e-6


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("count", [4, 5, 6, 7, 8])
def test_small_tours_are_the_shortest(solver, count):
    for seed in range(6):
        start = random_start(seed, count, HORSESHOE)
        found = solver(start, seed=0)
        best = min(
            start.length_m(np.array([0, *rest]))
            for rest in itertools.permutations(range(1, count))
            if rest[0] <= rest[-1]
        )
        assert start.length_m(found.order) == pytest.approx(best)


@pytest.mark.parametrize("solver", SOLVERS)
@quick
@given(seed=st.integers(0, 1000), count=st.integers(4, 120))
def test_a_tour_visits_every_site_once_and_is_no_longer_than_the_first(solver, seed, count):
    start = random_start(seed, count, HORSESHOE, near_m=40.0)
    found = solver(start, seed=seed)
    assert sorted(found.order) == list(range(count))
    legs = np.asarray(start.distances[found.order, np.roll(found.order, -1)])
    assert (legs > 0.0).all()
    assert start.length_m(found.order) <= start.length_m(start.order) + 1e-6
    assert np.array_equal(solver(start, seed=seed).order, found.order)


@quick
@given(seed=st.integers(0, 1000))
def test_no_exchange_of_two_legs_shortens_a_tour(seed):
    start = random_start(seed, 60)
    order = shortened_tour(start, seed=0).order
    distance = start.distances.toarray()
    here, there = order, np.roll(order, -1)
    legs = distance[here, there]
    exchanged = distance[np.ix_(here, here)] + distance[np.ix_(there, there)]
    gain = legs[:, None] + legs - exchanged
    np.fill_diagonal(gain, 0.0)
    assert gain.max() <= 1e-6
    assert LineString(low_discrepancy(SQUARE, 60, seed=seed)[[*order, order[0]]]).is_simple


def test_a_tour_of_even_sites_has_about_the_length_that_the_first_count_expects():
    sites = cluster_centres(low_discrepancy(SQUARE, 10_000, seed=0), 400, SQUARE)
    start = first_tour(ShoreSights(SQUARE).geodesics(sites), 20.0)
    length = start.length_m(shortened_tour(start, seed=0).order)
    assert length == pytest.approx(0.98 * math.sqrt(400 * SQUARE.area), rel=0.04)


def test_pruning_keeps_the_entries_and_shortens_arms_alike():
    comb = shapely.union_all([box(0, 0, 100, 10), *(box(x, 0, x + 2, 90) for x in (10, 50, 88))])
    sites = np.array([[5.0, 5.0], *([x + 1.0, y] for x in (10, 50, 88) for y in range(5, 90, 5)), [99.0, 5.0]])
    geodesics = ShoreSights(comb).geodesics(sites)
    order = shortened_tour(first_tour(geodesics, 50.0), seed=0).order
    length = LineString(geodesics.way(order)).length
    left = pruned_order(order, geodesics, kept=1, length_m=0.7 * length)
    assert 0 in left
    assert LineString(geodesics.way(left)).length == pytest.approx(0.7 * length, rel=0.05)
    tips = [sites[left][sites[left][:, 0] == x + 1.0][:, 1].max() for x in (10, 50, 88)]
    assert max(tips) - min(tips) <= 10.0
    assert pruned_order(order, geodesics, kept=1, length_m=0.0).tolist() == [0]


# --------------------------------------------------------------------------- outlines


@pytest.mark.parametrize(
    ("way", "places"),
    [
        ([(10, 10), (90, 10), (90, 90), (10, 90)], [(10, 10), (90, 90)]),
        ([(10, 10), (90, 90), (90, 10), (10, 90)], [(10, 10), (90, 90), (50, 50)]),
        ([(10, 10), (50, 50), (90, 50), (50, 50)], [(10, 10), (90, 50)]),
        ([(10, 10), (90, 10), (50, 10), (50, 90), (50, 10)], [(10, 10), (90, 10), (50, 90)]),
        ([(10, 10), (90, 10), (90, 50), (50, 50), (90, 50), (90, 90), (10, 90)], [(50, 50), (10, 90)]),
        ([(50, 10), (90, 50), (50, 90), (50, 10), (10, 50), (50, 90)], [(90, 50), (10, 50)]),
        ([(20, 20), (80, 20)], [(20, 20), (80, 20)]),
        ([(20, 20)], [(20, 20)]),
    ],
    ids=["plain", "crossing", "spur", "tree", "spur inwards", "chord", "there and back", "one place"],
)
def test_the_outline_of_any_tour_is_one_ring_near_all_its_places(way, places):
    region = enclosed_region(np.array([*way, way[0]], dtype=float), SQUARE, 1.0)
    assert region.is_valid
    assert SQUARE.covers(region)
    assert LineString(region.exterior).is_simple
    assert max(region.boundary.distance(Point(place)) for place in places) <= 1.5


def test_slits_that_part_a_region_are_left_out_and_no_others():
    across, into = ([box(x, -1, x + 1, top) for x in range(5, 95, 10)] for top in (101, 50))
    alone = slit(SQUARE, np.array(into))
    assert alone.area == pytest.approx(100 * 100 - 50 * len(into))
    both = slit(SQUARE, np.array([*across, *into]))
    assert both.area == pytest.approx(alone.area)
    halves = np.array([half for x in range(5, 95, 10) for half in (box(x, -1, x + 1, 51), box(x, 49, x + 1, 101))])
    assert slit(SQUARE, halves).area == pytest.approx(100 * 100 - 51 * (len(halves) // 2))


def slit_by_differences(region: Polygon, slits: np.ndarray) -> Polygon:
    """The same by a difference of the whole region for every test."""
    rest = region.difference(shapely.union_all(slits))
    areas = shapely.area(shapely.get_parts(rest))
    if areas.size and areas.sum() - areas.max() <= 1e-12 < areas.max():
        return largest(rest)
    half = len(slits) // 2
    return region if half == 0 else slit_by_differences(slit_by_differences(region, slits[:half]), slits[half:])


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 60), squares=st.booleans())
def test_slits_that_part_a_region_are_found_by_what_they_touch(seed, count, squares):
    rng = np.random.default_rng(seed)
    holes = [box(x, y, x + 2, y + 2) for x in range(2, 20, 6) for y in range(2, 20, 6) if rng.random() < 0.6]
    region = box(0, 0, 20, 20).difference(shapely.union_all(holes))
    if squares:  # whose sides and corners meet
        x, y, width, height = rng.integers([-1, -1, 1, 1], [20, 20, 7, 6], (count, 4)).T
        slits = shapely.box(x, y, x + width, y + height)
    else:  # some of them rings
        ends = rng.uniform(-1, 21, (count, 1, 2)) + np.cumsum(rng.normal(0, 2.0, (count, 4, 2)), axis=1)
        lines = shapely.linestrings(np.where(rng.random((count, 1, 1)) < 0.2, ends[:, [0, 1, 2, 0]], ends))
        slits = shapely.buffer(lines, 0.2, quad_segs=2)
    found = slit_in_turn(region, slits)
    assert found.is_valid
    assert found.symmetric_difference(slit_by_differences(region, slits)).area <= 1e-4


def test_a_slit_round_an_island_is_slit_and_one_that_leaves_nothing_is_not():
    islet, moat = box(50, 50, 51, 51), box(40, 40, 60, 60)
    lake_with_islet = SQUARE.difference(islet)
    found = slit_in_turn(lake_with_islet, np.array([box(-1, -1, 101, 101), moat]))
    assert found.equals(SQUARE.difference(moat))


@quick
@given(seed=st.integers(0, 10_000), count=st.integers(2, 40))
def test_the_outline_of_a_tour_in_random_order_is_sound(seed, count):
    order = np.random.default_rng(seed).permutation(count)
    way = ShoreSights(HORSESHOE).geodesics(low_discrepancy(HORSESHOE, count, seed=seed)).way(order)
    region = enclosed_region(way, HORSESHOE, 0.5)
    assert region.is_valid
    assert HORSESHOE.buffer(1e-6).covers(region)


@pytest.mark.parametrize("name", ["comb", "spiral", "islands in a grid", "all but closed bay", "petals"])
@quick
@given(seed=st.integers(0, 10_000), count=st.integers(4, 60))
def test_the_outline_of_a_tour_passes_all_of_it(name, seed, count):
    water = NASTY[name]
    geodesics = ShoreSights(water).geodesics(low_discrepancy(water, count, seed=seed))
    way = geodesics.way(shortened_tour(first_tour(geodesics, 100.0), seed=0).order)
    region = enclosed_region(way, water, 0.3)
    assert region.buffer(0.6).covers(LineString(way))


# --------------------------------------------------------------------------- paths


def planned(asked: PathRequest) -> TourPlan:
    return plan_tour(Task.of(asked, lambda: False), solver=shortened_tour)


def require_sound(plan: TourPlan, asked: PathRequest) -> None:
    """Simple, no longer than allowed, from launch to recovery, and outside the free space only for its legs."""
    task, path = Task.of(asked, lambda: False), plan.chosen.path
    assert path.is_simple
    assert path.length <= task.budget.most_m
    for access, end in ((task.waters.launch, path.coords[0]), (task.waters.recovery, path.coords[-1])):
        assert Point(end).distance(Point(access.place)) <= 1e-6
    legs = shapely.union_all([task.waters.launch.beside, task.waters.recovery.beside])
    outside = task.waters.passable.outside(path)
    assert outside.difference(legs.buffer(1e-6)).length <= 1e-6


@pytest.mark.parametrize("name", sorted(NASTY))
@pytest.mark.parametrize("spacings", [3.0, 10.0])
def test_nasty_shapes(name, spacings):
    asked = nasty_request(name, spacings)
    if asked is not None:
        require_sound(planned(asked), asked)


def test_a_tour_leaves_no_large_gap():
    asked = request(lake(5), spacings=20)
    plan = planned(asked)
    task = Task.of(asked, lambda: False)
    assert task.waters.probe.distances(plan.chosen.path).max() <= 1.2 * plan.chosen.spacing_m


def test_the_seed_alone_decides():
    asked = request(lake(7), spacings=10)
    assert planned(asked).chosen.path == planned(asked).chosen.path
    other = PathRequest(**{field: getattr(asked, field) for field in asked.__struct_fields__} | {"seed": 1})
    assert planned(other).chosen.path != planned(asked).chosen.path


def test_the_least_spacing_limits_the_number_of_sites():
    water = lake(2)
    asked = request(water, spacings=20, min_spacing_m=math.sqrt(water.area) / 8)
    chosen = planned(asked).chosen
    assert chosen.spacing_m >= asked.min_spacing_m
    assert chosen.length_m < 0.95 * asked.length_m


def test_recovery_beyond_reach_is_refused_with_the_length():
    strip = box(0, 0, 5000, 60)
    with pytest.raises(Infeasible, match="length_m"):
        planned(request(strip, spacings=2, launch=(0.0, 30.0), recovery=(5000.0, 30.0)))
