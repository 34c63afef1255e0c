"""Passes over hot spots: all of the water is treated, inside the free space, in few metres."""

import math
from itertools import product

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, affinity, box

from oxbow.contracts import HotSpot
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.route import RouteMethod, make_router
from oxbow.testing import nasty_polygons
from oxbow_assignment.treatment import division
from oxbow_assignment.treatment.campaign import plan_campaign
from oxbow_assignment.treatment.division import divide_treatments
from oxbow_assignment.treatment.fleet import Fleet
from oxbow_assignment.treatment.passes import parallel_passes
from oxbow_assignment.treatment.sorties import schedule_sorties
from oxbow_assignment.treatment.spots import waters
from oxbow_assignment.treatment.treatment import COVERED, MOST_PASSES, Treatment, treatment_of
from tests.support.path_requests import lake
from tests.support.treatment_scenes import blob, covered_share, hot_spots, slave

quick = settings(max_examples=10)
SEA = box(-1_000, -1_000, 1_000, 1_000)


def treatment(area: Polygon, free: Polygon, swath_m: float) -> Treatment:
    spot = HotSpot(name="bloom", area=area, value=1.0)
    return treatment_of(spot, waters([spot], free)[0], free, make_router(RouteMethod.FUNNEL, free), swath_m)


def require_treated(found: Treatment, free: Polygon, swath_m: float) -> None:
    """The swath covers the water, and the line is inside and runs along every pass."""
    assert covered_share(found.water, [found.line], swath_m) >= COVERED - 1e-4
    assert found.line.difference(free.buffer(1e-6)).length < 1e-6
    places = [line.interpolate(at, normalized=True) for line in found.passes for at in (0.0, 0.3, 1.0)]
    assert shapely.dwithin(found.line, places, 1e-6).all()
    assert found.line.length >= sum(line.length for line in found.passes) - 1e-6


@pytest.mark.parametrize("turn", [0.0, 25.0, 90.0, 137.0])
def test_a_rectangle_is_treated_along_its_long_side(turn):
    found = treatment(affinity.rotate(box(0, 0, 100, 30), turn), SEA, 10.0)
    assert [line.length for line in found.passes] == pytest.approx([100.0] * 3)
    assert found.line.length == pytest.approx(3 * 100.0 + 2 * 10.0)
    assert covered_share(found.water, [found.line], 10.0) == pytest.approx(1.0)


def test_passes_are_never_farther_apart_than_the_swath():
    found = treatment(box(0, 0, 100, 31), SEA, 12.0)
    heights = sorted(line.centroid.y for line in found.passes)
    assert np.diff(heights) == pytest.approx([31 / 3] * 2)
    assert heights[0] == pytest.approx(31 / 6)


def test_short_passes_are_taken_where_they_waste_less():
    """Four passes along a strip of 31 m overlap; ten across it fit."""
    assert len(treatment(box(0, 0, 100, 31), SEA, 10.0).passes) == 10


@pytest.mark.parametrize("swath_m", [30.0, 1_000.0])
def test_one_pass_treats_what_is_no_wider_than_a_swath(swath_m):
    assert len(treatment(box(0, 0, 100, 30), SEA, swath_m).passes) == 1


def test_the_water_on_all_sides_of_an_island_is_treated():
    free = SEA.difference(box(40, -5, 60, 35))
    found = treatment(box(0, 0, 100, 30), free, 10.0)
    require_treated(found, free, 10.0)
    assert {line.centroid.x < 50 for line in found.passes} == {True, False}


def test_a_slanted_shore_is_treated():
    free = Polygon([(0, 0), (300, 0), (300, 150)])
    found = treatment(box(0, 0, 300, 60), free, 25.0)
    require_treated(found, free, 25.0)


def test_parallel_passes_are_parted_by_land():
    land = box(40, -5, 60, 35)
    assert len(parallel_passes(box(0, 0, 100, 30).difference(land), SEA.difference(land), 10.0)) == 6


@quick
@given(seed=st.integers(0, 10_000), swaths=st.floats(0.5, 12.0))
def test_hot_spots_of_lakes_are_treated(seed, swaths):
    free, rng = lake(seed), np.random.default_rng(seed)
    spot = hot_spots(rng, free, 1, 250.0)[0]
    swath_m = math.sqrt(spot.area.area) / swaths
    require_treated(treatment(spot.area, free, swath_m), free, swath_m)


@pytest.mark.parametrize("name", sorted(nasty_polygons()))
def test_nasty_waters_are_treated(name):
    free = nasty_polygons()[name]
    x0, y0, x1, y1 = free.bounds
    slanted = affinity.rotate(box(x0, y0, (x0 + x1) / 2, y1), 30)
    for area, swath_m in ((free.convex_hull.buffer(5.0), 12.0), (slanted, 5.0)):
        require_treated(treatment(area, free, swath_m), free, swath_m)


def test_the_way_over_a_hot_spot_is_little_longer_than_its_passes():
    area = blob(np.random.default_rng(3), SEA, 200.0)
    found = treatment(area, SEA, 10.0)
    assert found.line.length <= 1.15 * area.area / 10.0


def test_a_swath_far_too_small_is_refused():
    message = r"swath_m: is 0.001 m: hot spot 'bloom' would take 30000 passes; expected 0.03 m or more"
    with pytest.raises(InvalidRequest, match=message):
        treatment(box(0, 0, 100, 30), SEA, 0.001)
    assert 0.03 * MOST_PASSES == 30.0


# ----------------------------------------------------------------------------- parts and sorties


def fleet(*slaves, free: Polygon = SEA) -> Fleet:
    return Fleet.of(slaves, free, free)


@pytest.mark.parametrize("length_m", [600.0, 1_000.0, 5_000.0])
def test_a_long_treatment_is_divided_into_parts_that_fit(length_m):
    found = treatment(box(100, -50, 300, 50), SEA, 10.0)
    boats = fleet(slave((0.0, 0.0), length_m=length_m), slave((0.0, 10.0), name="small", length_m=length_m / 2))
    made = divide_treatments([found], boats)
    stretches = [(part.since, part.until) for part in made.parts]
    stretches += [(other.part.since, other.part.until) for other in made.out_of_reach]
    ends = np.array(sorted(stretches))
    assert ends[0, 0] == 0.0
    assert ends[-1, 1] == pytest.approx(1.0)
    assert ends[1:, 0] == pytest.approx(ends[:-1, 1])
    for part in made.parts:
        ends_m = sum(Point(0.0, 0.0).distance(Point(part.line.coords[end])) for end in (0, -1))
        assert ends_m + part.line.length <= length_m
        assert part.value == pytest.approx(part.until - part.since)
    for other in made.out_of_reach:
        assert other.access_m + other.part.line.length > length_m


def test_what_fits_stays_whole():
    found = treatment(box(100, -50, 300, 50), SEA, 10.0)
    made = divide_treatments([found], fleet(slave((0.0, 0.0))))
    assert [part.line for part in made.parts] == [found.line]
    assert not made.out_of_reach


def test_as_few_parts_as_the_range_allows():
    found = treatment(box(100, -50, 300, 50), SEA, 10.0)
    boat = slave((0.0, 0.0), length_m=2_000.0)
    assert found.line.length == pytest.approx(2_090.0)
    assert len(divide_treatments([found], fleet(boat)).parts) == 2


def test_too_many_parts_are_refused(monkeypatch):
    monkeypatch.setattr(division, "MOST_PARTS", 9)
    found = treatment(box(100, -50, 300, 50), SEA, 2.0)
    with pytest.raises(
        Infeasible, match=r"hot_spots: take 10 km of passes, in 1[0-9] parts that fit .* at most 9"
    ):
        divide_treatments([found], fleet(slave((0.0, 0.0), length_m=1_500.0)))


@quick
@given(seed=st.integers(0, 10_000), boats=st.integers(1, 3))
def test_no_other_way_to_turn_the_parts_is_shorter(seed, boats):
    rng = np.random.default_rng(seed)
    found = [treatment(spot.area, SEA, 40.0) for spot in hot_spots(rng, SEA, 5, 100.0)]
    places = rng.uniform(-900.0, 900.0, (2 * boats, 2)).tolist()
    slaves = [slave(tuple(places[b]), name=f"{b}", recovery=tuple(places[boats + b])) for b in range(boats)]
    parts = divide_treatments(found, fleet(*slaves)).parts
    schedule = schedule_sorties(parts, fleet(*slaves))
    assert len(schedule.rounds) == 1
    tours = {tour.vehicle: tour.length_m for tour in schedule.first.best.tours}
    for journey in schedule.rounds[0]:
        boat = slaves[journey.slave]
        lines = [parts[number].line for number in journey.parts]
        lengths = [way_m(boat, lines, turns) for turns in product((False, True), repeat=len(lines))]
        assert journey.path.length == pytest.approx(min(lengths))
        assert np.mean(lengths) == pytest.approx(tours[boat.name])


def way_m(boat, lines: list[LineString], turns: tuple[bool, ...]) -> float:
    """Metres from start to recovery along lines, some of them turned round."""
    turned = [line.reverse() if turn else line for line, turn in zip(lines, turns, strict=True)]
    points = [boat.start, *(line.coords[end] for line in turned for end in (0, -1)), boat.recovery]
    ways = np.hypot(*np.diff(points, axis=0).T)[::2]
    return float(ways.sum() + sum(line.length for line in lines))


def test_a_journey_home_over_land_counts_its_legs():
    free = box(0, 0, 100, 100)
    boats = fleet(slave((-10.0, 50.0), length_m=500.0), free=free)
    ways = boats.ways([LineString([(10, 50), (20, 50)])])
    assert ways.starts[:, 0, 0].tolist() == [[20.0, 30.0], [20.0, 30.0]]
    assert ways.access_m[0, 0] == 50.0


def test_what_is_worth_most_a_metre_goes_first():
    """Of two equally near the better goes first; what is out of reach is left, the nearer first."""
    areas = [box(100, 0, 120, 10), box(300, 0, 320, 10), box(-120, 0, -100, 10), box(-320, 0, -300, 10)]
    spots = [
        HotSpot(name=f"{i}", area=area, value=value)
        for i, (area, value) in enumerate(zip(areas, (1, 1, 2, 1), strict=True))
    ]
    campaign = plan_campaign(spots, [slave((0.0, 0.0), length_m=300.0)], SEA, 10.0)
    parts = campaign.division.parts
    treated = [parts[number].treatment for [journey] in campaign.schedule.rounds for number in journey.parts]
    assert treated == [2, 0]
    assert [left.hot_spot for left in campaign.left] == ["1", "3"]
    assert all("'boat' would travel 6" in left.reason for left in campaign.left)
    assert campaign.left[0].value_per_m == pytest.approx(1 / 640, rel=0.05)


def test_no_hot_spots_take_no_sorties():
    assert schedule_sorties([], fleet(slave((0.0, 0.0)))).rounds == ()
    assert shapely.get_num_geometries(waters([], SEA)).size == 0
