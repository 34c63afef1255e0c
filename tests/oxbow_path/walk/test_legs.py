"""The legs between the launch, the ring and the recovery."""

import itertools

import pytest
import shapely
from shapely import LineString, Point, Polygon, box

from oxbow.geometry.conformance import strays
from oxbow.geometry.route.gate_routes import Routes
from oxbow.wire.recording import discard
from oxbow_path.service import handle
from oxbow_path.walk.access import access
from oxbow_path.walk.legs import Passable, path_with_legs
from tests.support.path_requests import request

WATER = box(0, 0, 1000, 600)
FREE = box(10, 10, 990, 590)
REGION = box(100, 100, 900, 500)


def leg(place):
    return access(place, FREE, Routes(WATER, 50.0), where="launch")


def test_a_leg_from_the_shore_is_the_shortest():
    shore = leg((500.0, 0.0))
    assert shore.line.length == pytest.approx(10)
    assert not shore.ashore
    assert leg((500.0, -30.0)).ashore
    assert leg((500.0, 300.0)).line.length == 0


def test_a_leg_round_a_corner_stays_in_the_water():
    hook = shapely.union_all([box(0, 0, 1000, 600), box(1000, 0, 1200, 8), box(1192, 0, 1200, 300)])
    way = access((1196.0, 290.0), FREE, Routes(hook, 50.0), where="launch")
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
    path = path_with_legs(region, leg(launch), leg(recovery), Passable(FREE), opening_m=5.0, detail_m=50.0)
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
    path = path_with_legs(region, *legs, Passable(free), opening_m=5.0, detail_m=50.0)
    assert path.is_simple
    assert path.distance(Point(500, 300)) >= 59.9


def test_a_ring_that_shows_only_one_side_of_a_corner_is_opened_beside_it():
    """The nearest place of the ring in sight is the tip of a thorn, of which the entry sees one side."""
    free = box(-50, -50, 50, 50) - box(-2, -3, -1, 3)
    region = Polygon([(-9, -20), (-3, 10), (-13, 8), (-13, 40), (40, 40), (40, -20)])
    launch = access((2.5, 0.0), free, Routes(free, 50.0), where="LaunchPoint")
    path = path_with_legs(region, launch, launch, Passable(free), opening_m=1.0, detail_m=10.0)
    assert path.is_simple


def test_legs_of_two_places_up_one_creek_run_beside_one_another():
    creek = WATER | box(-200, 300, 1, 306)
    places = [(-199.0, 303.0), (-100.0, 306.0), (-60.0, 300.0), (-80.0, 307.0), (-200.0, 305.0)]
    legs = [access(place, FREE, Routes(creek, 50.0), where="launch") for place in places]
    region = REGION | box(10, 290, 100, 316)
    for launch, recovery in itertools.product(legs, repeat=2):
        path = path_with_legs(region, launch, recovery, Passable(FREE), opening_m=5.0, detail_m=50.0)
        assert path.is_simple
        assert (path.coords[0], path.coords[-1]) == (launch.place, recovery.place)
        land_m = launch.land_m + recovery.land_m
        assert path.difference(creek.buffer(2e-3)).length <= land_m


def test_legs_that_meet_at_a_slant_in_a_winding_creek_run_beside_one_another():
    creek = WATER | LineString([(10, 303), (-60, 306), (-90, 280), (-130, 283), (-160, 250)]).buffer(
        7, cap_style="flat"
    )
    places = [(-160.0, 250.0), (-120.0, 285.0), (-95.0, 276.0), (-140.0, 266.0), (-62.0, 313.0)]
    legs = [access(place, FREE, Routes(creek, 5.0), where="launch") for place in places]
    region = REGION | box(10, 280, 100, 330)
    for launch, recovery in itertools.permutations(legs, 2):
        path = path_with_legs(region, launch, recovery, Passable(FREE), opening_m=5.0, detail_m=50.0)
        assert path.is_simple
        assert (path.coords[0], path.coords[-1]) == (launch.place, recovery.place)


@pytest.mark.parametrize("recovery", [(460.0, 140.0), (450.0, 160.0)], ids=["on one bank", "across"])
def test_places_near_to_each_other_leave_no_side_of_the_ring_out(recovery):
    water = shapely.union_all([box(0, 0, 300, 300), box(300, 140, 600, 160), box(600, 0, 900, 300)])
    asked = request(water, launch=(450.0, 140.0), recovery=recovery, spacings=16.0, safety=0.0209)
    plan = handle(asked, discard)
    assert plan.path.intersects(box(20, 20, 280, 280))
    assert plan.path.intersects(box(620, 20, 880, 280))


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


def test_a_leg_reaches_a_ring_that_is_farther_away_than_its_entry():
    """From a corner of an islet that the ring is led round at a distance."""
    islet = shapely.Point(500, 400).buffer(25, quad_segs=3)
    water = box(0, 0, 1000, 800).difference(islet).buffer(0)
    launch = islet.exterior.coords[1]
    plan = handle(request(water, launch=launch, spacings=2.8, safety=0.0035), discard)
    assert plan.path.is_simple


CAGE = box(400, 200, 600, 400) - box(420, 220, 580, 380) - box(480, 380, 520, 400)
"""An island with a harbour, whose mouth looks on the island before it."""


@pytest.mark.parametrize("launch", [(500.0, 300.0), (500.0, 215.0)], ids=["afloat", "on the shore"])
@pytest.mark.parametrize(
    "recovery", [(500.0, 300.0), (450.0, 330.0), (200.0, 300.0), (900.0, 300.0), (500.0, 215.0)]
)
def test_a_place_out_of_sight_of_the_ring_is_led_to_it_past_what_stands_between(launch, recovery):
    islands = CAGE | box(380, 420, 620, 440)
    free = FREE - islands
    routes = Routes(free | box(480, 210, 520, 220), 50.0)
    legs = [access(place, free, routes, where="LaunchPoint") for place in (launch, recovery)]
    path = path_with_legs(REGION, *legs, Passable(free), opening_m=5.0, detail_m=50.0)
    assert path.is_simple
    assert (path.coords[0], path.coords[-1]) == (launch, recovery)
    assert path.difference(free.buffer(1e-6)).length <= sum(leg.line.length for leg in legs) + 1.0
    assert REGION.exterior.difference(path.buffer(1e-6)).length < 40
