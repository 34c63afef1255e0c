"""The parts of the Transect method, one by one."""

import itertools

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from path_requests import lake, request
from shapely import LineString, Point, Polygon, box

from oxbow.conformance import strays
from oxbow.contracts import PathRequest
from oxbow.errors import Infeasible, Internal
from oxbow.recording import discard
from oxbow.reeb import cell_polygon
from oxbow.route.gate_routes import Routes, taut
from oxbow.testing import nasty_polygons
from oxbow_path.conformance import require_conforming
from oxbow_path.service import handle
from oxbow_path.task import prepared_waters
from oxbow_path.transect.circuit import plan_circuit
from oxbow_path.transect.pattern import try_transects
from oxbow_path.transect.transects import place_transects
from oxbow_path.walk.gaps import reach_gaps
from oxbow_path.walk.legs import Passable, access, joined
from oxbow_path.walk.probe import Probe, covered
from oxbow_path.walk.region import Brush, Walk, dilated, simply_connected
from oxbow_path.walk.spacing import Budget, fitted
from oxbow_path.walk.trial import Pattern, Trial

quick = settings(deadline=None, max_examples=12, derandomize=True)


@quick
@given(seed=st.integers(0, 10_000), phase=st.floats(0, 1), pitch=st.floats(50, 400))
def test_transects_stand_on_lines_a_pitch_apart_and_cross_their_cells(seed, phase, pitch):
    cells = request(lake(seed)).decomposition.cells
    transects = place_transects(cells, pitch, phase=phase, min_length_m=pitch / 2)
    for transect in transects:
        assert transect.length_m > pitch / 2
        line = LineString([(transect.u, transect.low), (transect.u, transect.high)])
        assert cell_polygon(cells[transect.cell]).buffer(1e-6).covers(line)
    us = np.unique([transect.u for transect in transects])
    lines = (us - us[0]) / pitch if len(us) else us
    assert np.allclose(lines, np.round(lines), atol=1e-6)


@quick
@given(seed=st.integers(0, 10_000), spacing=st.floats(40, 250))
def test_the_circuit_is_connected_and_inside(seed, spacing):
    asked = request(lake(seed), safety=0.005)
    cells = asked.decomposition.cells
    transects = place_transects(cells, 2 * spacing, phase=0.3, min_length_m=spacing)
    circuit = plan_circuit(cells, transects, trim_m=spacing / 5, inset_m=spacing / 2)
    lines = [*circuit.transects, *circuit.links]
    water = shapely.union_all([cell_polygon(cell) for cell in cells]).buffer(1e-6)
    assert all(water.covers(line) for line in lines)
    if lines:
        assert shapely.union_all(shapely.buffer(lines, 1e-6)).geom_type == "Polygon"


def test_a_circuit_without_transects_is_empty():
    cells = request(lake(1)).decomposition.cells
    circuit = plan_circuit(cells, (), trim_m=1.0, inset_m=1.0)
    assert circuit.transects == circuit.links == ()


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
    start = dilated(circuit, brush) if transects else waters.free.representative_point().buffer(20.0)
    walk = reach_gaps(
        Walk(Polygon(start.exterior)), brush, waters.probe, waters.routes, reach_m=150.0, cut_width_m=50.0
    )
    assert waters.probe.distances(walk.ring).max() <= 150.0
    assert waters.free.buffer(1e-6).covers(walk.ring)


def test_covered_needs_a_step_within_reach():
    points = np.array([[0.0, 0.0], [3.0, 0.0]])
    assert covered(points, np.array([[1.0, 0.0]]), 2.0)
    assert not covered(points, np.array([[1.0, 0.0]]), 1.5)
    assert not covered(points, np.empty((0, 2)), 1.5)
    assert covered(np.empty((0, 2)), np.empty((0, 2)), 1.0)


COMB = shapely.union_all([box(0, 0, 1000, 100)] + [box(100 * k, 0, 100 * k + 50, 800) for k in range(10)])


@pytest.mark.parametrize(
    "water",
    [
        lake(4),
        COMB,
        box(0, 0, 2000, 1e-3),
        box(0, 0, 100, 100).difference(box(40, 40, 60, 60)),
        lake(9, roughness=0.8),
    ],
    ids=["lake", "comb", "hair", "annulus", "ragged"],
)
def test_routes_lead_everywhere_and_never_touch_the_shore(water):
    routes = Routes(water, 40.0)
    rng = np.random.default_rng(1)
    x0, y0, x1, y1 = water.bounds
    places = rng.uniform((x0, y0), (x1, y1), size=(400, 2))
    places = places[shapely.contains_xy(water, places)][:12]
    for start, goal in itertools.pairwise(places):
        way = LineString(routes.between(start, goal))
        assert water.covers(way)
        assert way.distance(water.boundary) > 0 or water.bounds[3] < 1


def lake_and_places(seed: int, where: int, count: int) -> tuple[Polygon, np.ndarray]:
    """A ragged lake, and places in it, the same for the same numbers."""
    water = lake(seed, roughness=0.5)
    x0, y0, x1, y1 = water.bounds
    places = np.random.default_rng(where).uniform((x0, y0), (x1, y1), size=(200, 2))
    return water, places[shapely.contains_xy(water, places)][:count]


@quick
@given(seed=st.integers(0, 50), size=st.floats(0.1, 0.5), where=st.integers(0, 10_000))
def test_the_route_into_an_area_leads_to_the_nearest_place_of_it(seed, size, where):
    water, (start, middle) = lake_and_places(seed, where, 2)
    area = Point(middle).buffer(size * np.ptp(water.bounds[::2]))
    routes = Routes(water, 40.0)
    gates = routes.goals_in(area)
    ways = [routes.to_area(start, area, gate) for gate in np.array_split(gates, 1 + len(gates) // 9)]
    nearest = routes.to_area(start, area, gates)
    assert nearest.length <= min(way.length for way in ways if way is not None)
    shortest = LineString(routes.between(start, shapely.get_coordinates(nearest)[-1]))
    assert nearest.length == pytest.approx(shortest.length)


@quick
@given(seed=st.integers(0, 50), size=st.floats(1e-4, 0.5), where=st.integers(0, 10_000))
@example(seed=36, size=0.0625, where=0)  # holds no gate, and the last step decides which way is shortest
def test_routes_of_many_into_an_area_are_those_of_each_and_end_on_one_another(seed, size, where):
    water, (middle, *starts) = lake_and_places(seed, where, 9)
    area = Point(middle).buffer(size * np.ptp(water.bounds[::2]))
    routes = Routes(water, 40.0)
    gates = routes.goals_in(area)
    alone, together = routes.into(area, gates), routes.into(area, gates)
    built = shapely.MultiPolygon()
    for start in starts:
        nearest = routes.to_area(start, area, gates)
        assert alone.route(start).length == pytest.approx(nearest.length)
        route = together.route(start, unused_m=0.0)
        assert route.length <= nearest.length * (1 + 1e-9)
        assert route.coords[0] == tuple(start)
        end = Point(route.coords[-1])
        assert shapely.dwithin(area, end, 1e-6) or shapely.dwithin(built, end, 1e-6) or route.equals(nearest)
        built = built.union(route.buffer(1e-6))


def test_a_taut_route_is_no_longer_and_stays_inside():
    routes = Routes(COMB, 20.0)
    way = LineString(routes.between(np.array([25.0, 700.0]), np.array([925.0, 700.0])))
    tight = taut(way, COMB)
    assert COMB.covers(tight)
    assert tight.length < way.length
    assert tight.length <= 1.1 * (600 + 600 + 875)


WATER = box(0, 0, 1000, 600)
FREE = box(10, 10, 990, 590)
REGION = box(100, 100, 900, 500)


def leg(place):
    return access(place, FREE, Routes(WATER, 50.0), where="LaunchPoint")


def test_a_leg_from_the_shore_is_the_shortest():
    shore = leg((500.0, 0.0))
    assert shore.line.length == pytest.approx(10)
    assert not shore.ashore
    assert leg((500.0, -30.0)).ashore
    assert leg((500.0, 300.0)).line.length == 0


def test_a_leg_round_a_corner_stays_in_the_water():
    hook = shapely.union_all([box(0, 0, 1000, 600), box(1000, 0, 1200, 8), box(1192, 0, 1200, 300)])
    way = access((1196.0, 290.0), FREE, Routes(hook, 50.0), where="LaunchPoint")
    assert hook.buffer(1e-9).covers(way.line)
    assert way.line.length < 1.1 * (290 + 200)


@pytest.mark.parametrize(
    ("launch", "recovery"),
    [
        ((500.0, 0.0), (500.0, 0.0)),
        ((500.0, 300.0), (500.0, 300.0)),
        ((100.0, 300.0), (100.0, 300.0)),
        ((0.0, 300.0), (1000.0, 300.0)),
        ((500.0, 300.0), (1000.0, 300.0)),
        ((0.0, 300.0), (500.0, 300.0)),
        ((300.0, 300.0), (700.0, 320.0)),
        ((0.0, 300.0), (0.0, 302.0)),
    ],
)
def test_legs_join_the_ring(launch, recovery):
    region = REGION.union(box(10, 290, 100, 310)).union(box(900, 290, 990, 310)).union(box(490, 10, 510, 100))
    path = joined(region, leg(launch), leg(recovery), Passable(FREE), opening_m=5.0, detail_m=50.0)
    assert path.is_simple
    assert path.coords[0] == launch
    assert path.coords[-1] == recovery
    assert path.length >= region.exterior.length - 40
    assert region.exterior.difference(path.buffer(1e-6)).length < 40


def test_the_way_through_goes_round_an_enclosed_island():
    free = FREE.difference(Point(500, 300).buffer(60))
    water = WATER.difference(Point(500, 300).buffer(50))
    region = REGION.union(box(10, 290, 100, 310)).union(box(900, 290, 990, 310))
    legs = [
        access(place, free, Routes(water, 50.0), where="LaunchPoint") for place in ((0.0, 300.0), (1000.0, 300.0))
    ]
    path = joined(region, *legs, Passable(free), opening_m=5.0, detail_m=50.0)
    assert path.is_simple
    assert path.distance(Point(500, 300)) >= 59.9


def trial_of(length_m: float, spacing_m: float) -> Trial:
    pattern = Pattern(spacing_m, 1.5, 0.25)
    line = LineString([(0, 0), (length_m, 0)])
    nothing = plan_circuit(request(lake(1)).decomposition.cells, (), trim_m=1.0, inset_m=1.0)
    return Trial(pattern, nothing, Walk(box(0, 0, 1, 1)), line)


@pytest.mark.parametrize("power", [0.6, 1.0, 1.6])
def test_the_spacing_loop_finds_the_length(power):
    budget = Budget(limit_m=1000.0)
    fit = fitted(lambda pattern: trial_of(30_000.0 / pattern.spacing_m**power, pattern.spacing_m), 10.0, budget)
    assert budget.is_enough(fit.chosen)
    assert len(fit.trials) <= 6


def test_the_spacing_loop_keeps_the_least_spacing():
    budget = Budget(limit_m=1000.0, least_spacing_m=80.0)
    fit = fitted(lambda pattern: trial_of(30_000.0 / pattern.spacing_m, pattern.spacing_m), 10.0, budget)
    assert [trial.pattern.spacing_m for trial in fit.trials] == [80.0]


def test_where_nothing_fits_the_shortest_path_is_named():
    def never_short(pattern: Pattern) -> Trial:
        return trial_of(2000.0 + 1e5 / pattern.spacing_m, pattern.spacing_m)

    with pytest.raises(
        Infeasible, match=r"is 1000 m; expected more than 2002\.\d m: the shortest .* is 2000\.\d m"
    ):
        fitted(never_short, 10.0, Budget(limit_m=1000.0), widest_m=1e4)


def test_a_pattern_is_built_the_same_whatever_was_built_before():
    waters = prepared_waters(request(lake(6)), 70.0)
    first = try_transects(waters, Pattern(90.0, 1.5, 0.25))
    try_transects(waters, Pattern(140.0, 1.3, 0.75))
    assert try_transects(waters, Pattern(90.0, 1.5, 0.25)).path == first.path


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ([(0, 300), (500, 500), (500, 100), (100, 500), (0, 301)], "crosses itself"),
        ([(0, 300), (600, 300), (600, 599), (500, 599), (500, 301), (0, 301)], "leaves the free space"),
        (
            [(0, 300), (985, 300.5), *((20 + 10 * k, (320, 580)[k % 2]) for k in range(95, -1, -1)), (0, 301)],
            "m long",
        ),
    ],
    ids=["crossing", "outside", "too-long"],
)
def test_what_must_not_leave_the_stage_is_stopped(path, message):
    asked = request(WATER, spacings=15, launch=(0.0, 300.0), recovery=(0.0, 301.0))
    with pytest.raises(Internal, match=message):
        require_conforming(LineString(path), asked)


def test_a_sound_path_passes_up_to_each_rule():
    asked: PathRequest = request(WATER, spacings=15, launch=(0.0, 300.0), recovery=(0.0, 301.0))
    east = asked.space.free.bounds[2]
    path = LineString([(0, 300), (east, 300), (east, 310), (0, 301)])
    require_conforming(path, asked)
    require_conforming(path, replace(asked, length_m=path.length))
    with pytest.raises(Internal, match="m long"):
        require_conforming(path, replace(asked, length_m=0.999 * path.length))
    with pytest.raises(Internal, match="leaves the free space"):
        require_conforming(LineString([(0, 300), (east + 0.1, 300), (east, 310), (0, 301)]), asked)


def test_a_ring_that_shows_only_one_side_of_a_corner_is_opened_beside_it():
    """The nearest place of the ring in sight is the tip of a thorn, of which the entry sees one side."""
    free = box(-50, -50, 50, 50) - box(-2, -3, -1, 3)
    region = Polygon([(-9, -20), (-3, 10), (-13, 8), (-13, 40), (40, 40), (40, -20)])
    launch = access((2.5, 0.0), free, Routes(free, 50.0), where="LaunchPoint")
    path = joined(region, launch, launch, Passable(free), opening_m=1.0, detail_m=10.0)
    assert path.is_simple


def test_legs_of_two_places_up_one_creek_run_beside_one_another():
    creek = WATER | box(-200, 300, 1, 306)
    places = [(-199.0, 303.0), (-100.0, 306.0), (-60.0, 300.0), (-80.0, 307.0), (-200.0, 305.0)]
    legs = [access(place, FREE, Routes(creek, 50.0), where="LaunchPoint") for place in places]
    region = REGION | box(10, 290, 100, 316)
    for launch, recovery in itertools.product(legs, repeat=2):
        path = joined(region, launch, recovery, Passable(FREE), opening_m=5.0, detail_m=50.0)
        assert path.is_simple
        assert (path.coords[0], path.coords[-1]) == (launch.place, recovery.place)
        land_m = launch.land_m + recovery.land_m
        assert path.difference(creek.buffer(2e-3)).length <= land_m


def test_legs_that_meet_at_a_slant_in_a_winding_creek_run_beside_one_another():
    creek = WATER | LineString([(10, 303), (-60, 306), (-90, 280), (-130, 283), (-160, 250)]).buffer(
        7, cap_style="flat"
    )
    places = [(-160.0, 250.0), (-120.0, 285.0), (-95.0, 276.0), (-140.0, 266.0), (-62.0, 313.0)]
    legs = [access(place, FREE, Routes(creek, 5.0), where="LaunchPoint") for place in places]
    region = REGION | box(10, 280, 100, 330)
    for launch, recovery in itertools.permutations(legs, 2):
        path = joined(region, launch, recovery, Passable(FREE), opening_m=5.0, detail_m=50.0)
        assert path.is_simple
        assert (path.coords[0], path.coords[-1]) == (launch.place, recovery.place)


@pytest.mark.parametrize("recovery", [(460.0, 140.0), (450.0, 160.0)], ids=["on one bank", "across"])
def test_places_near_to_each_other_leave_no_side_of_the_ring_out(recovery):
    water = shapely.union_all([box(0, 0, 300, 300), box(300, 140, 600, 160), box(600, 0, 900, 300)])
    asked = request(water, launch=(450.0, 140.0), recovery=recovery, spacings=16.0, safety=0.0209)
    plan = handle(asked, discard)
    assert plan.path.intersects(box(20, 20, 280, 280))
    assert plan.path.intersects(box(620, 20, 880, 280))


def test_the_shortest_way_is_a_plan_whatever_the_method_finds():
    """From an islet to the shore, with less length than a walk round the water's edge takes."""
    islet = Point(500, 400).buffer(25, quad_segs=3)
    water = box(0, 0, 1000, 800).difference(islet)
    asked = request(water, launch=islet.exterior.coords[1], recovery=(700.0, 0.0), spacings=2.0, safety=0.0)
    plan = handle(asked, discard)
    assert plan.path.length <= asked.length_m


@pytest.mark.parametrize("spacings", [2.5, 4.0, 7.0])
@pytest.mark.parametrize("recovery", [(480.0, 400.0), (300.0, 400.0)], ids=["same islet", "another"])
def test_legs_leave_and_come_back_to_islets_that_the_ring_is_led_round(recovery, spacings):
    """Straight from the place to the ring, a leg would run along the islet's shore."""
    islets = shapely.union_all([box(480, 380, 520, 420), box(280, 380, 300, 420)])
    water = box(0, 0, 1000, 800).difference(islets)
    asked = request(water, launch=(520.0, 400.0), recovery=recovery, spacings=spacings, safety=0.0055)
    plan = handle(asked, discard)
    assert plan.path.is_simple
    assert not strays(plan.path, asked.space.free, asked.launch, asked.recovery)


def test_a_ring_in_narrow_water_that_all_but_touches_itself_is_smoothed_by_less():
    """Twice as wide as the moat, the first smoothings leave nothing of it."""
    plan = handle(request(nasty_polygons()["ring"], spacings=8.0), discard)
    assert plan.path.is_simple


def test_a_leg_reaches_a_ring_that_is_farther_away_than_its_entry():
    """From a corner of an islet that the ring is led round at a distance."""
    islet = shapely.Point(500, 400).buffer(25, quad_segs=3)
    water = box(0, 0, 1000, 800).difference(islet).buffer(0)
    launch = islet.exterior.coords[1]
    plan = handle(request(water, launch=launch, spacings=2.8, safety=0.0035), discard)
    assert plan.path.is_simple
