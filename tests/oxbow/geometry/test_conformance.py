"""Legs and faults of paths: what launch and recovery make necessary, and what exceeds it."""

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon, affinity, box

from oxbow.contracts import Rule
from oxbow.geometry.conformance import Shore

LAKE = box(0, 0, 400, 200)
SAFETY_M = 10.0


def conduct(path, water=LAKE, safety_m=SAFETY_M):
    line = LineString(path)
    return Shore(water, safety_m).conduct(line, line.coords[0], line.coords[-1])


def rules(found):
    return [fault.rule for fault in found.faults]


def test_a_path_in_open_water_has_no_legs_and_no_faults():
    found = conduct([(20, 20), (380, 20), (380, 180)])
    assert found.faults == ()
    assert [leg.unsafe_m for leg in found.legs] == [0.0, 0.0]


def test_a_launch_ashore_makes_its_own_distance_over_land_necessary():
    found = conduct([(-8, 100), (50, 100), (50, 150)])
    assert found.faults == ()
    assert found.outside_m == pytest.approx(8.0, abs=0.02)
    leg = found.legs[0]
    assert (leg.ashore_m, leg.least_ashore_m) == pytest.approx((8.0, 8.0), abs=0.02)
    assert leg.unsafe_m == pytest.approx(17.9, abs=0.05)


@pytest.mark.parametrize("heading_deg", range(0, 90, 15))
@pytest.mark.parametrize("ashore_m", [5, 6, 8, 10, 13])
def test_a_leg_goes_on_where_two_of_its_segments_meet(heading_deg, ashore_m):
    """Its stretch over land and that before the shore end and begin at one vertex, but for rounding."""
    out = [(-ashore_m, 100), (0, 100), (60, 110), (80, 100), (60, 90), (0, 99.99), (-ashore_m, 100)]
    path, water = (affinity.rotate(each, heading_deg, origin=(0, 0)) for each in (LineString(out), LAKE))
    # Too short a way in safe water to be told from a wide spot: the legs are what begins and ends the path.
    found = conduct(path.coords, water, safety_m=50.0)
    assert found.faults == ()
    assert [leg.unsafe_m for leg in found.legs] == pytest.approx([ashore_m + 50.2] * 2, abs=0.1)


def test_a_slanting_way_over_land_exceeds_what_is_necessary():
    found = conduct([(-8, 100), (20, 150), (50, 150)])
    assert rules(found) == [Rule.OUTSIDE]
    assert found.faults[0].leg == "launch"


def test_no_leg_excuses_what_happens_between_the_legs():
    zone = LAKE.difference(box(180, 0, 220, 120))
    found = conduct([(5, 60), (200, 60), (395, 60)], zone)
    assert rules(found) == [Rule.OUTSIDE, Rule.UNSAFE]
    assert found.outside_m == pytest.approx(40.0, abs=0.02)
    assert found.unsafe_m == pytest.approx(60.0, abs=0.3)


CREEK = shapely.union_all([LAKE, box(400, 90, 700, 100), box(690, 90, 700, 190)])


def test_a_creek_is_as_long_as_it_is():
    found = conduct([(695, 185), (695, 95), (380, 95), (380, 20)], CREEK)
    assert found.faults == ()
    assert found.legs[0].unsafe_m == pytest.approx(90 + 305, abs=15)


@pytest.mark.parametrize(("half_width_m", "is_basin"), [(14.0, False), (30.0, True)])
def test_a_wide_spot_of_a_creek_does_not_end_a_leg_and_a_basin_does(half_width_m, is_basin):
    creek = box(400, 95, 700, 105)
    water = shapely.union_all([LAKE, creek, shapely.Point(550, 100).buffer(half_width_m)])
    found = conduct([(695, 100), (380, 100), (380, 20)], water)
    assert rules(found) == [Rule.UNSAFE] * is_basin


@pytest.mark.parametrize("aside_m", [0.0, 0.05, 0.5])
def test_water_just_as_wide_as_twice_the_safety_distance_is_no_basin(aside_m):
    water = shapely.union_all([LAKE, box(400, 90, 700, 110)])
    assert conduct([(695, 100 + aside_m), (380, 100 + aside_m), (380, 20)], water).faults == ()


def test_a_leg_along_an_open_shore_is_too_long():
    found = conduct([(5, 5), (5, 195), (50, 150)])
    assert rules(found) == [Rule.UNSAFE]
    assert found.faults[0].leg == "launch"
    assert found.unsafe_m > 100


def test_a_strait_between_basins_is_no_leg():
    water = shapely.union_all([box(0, 0, 100, 100), box(100, 45, 160, 55), box(160, 0, 400, 100)])
    found = conduct([(2, 50), (350, 50)], water)
    assert rules(found) == [Rule.UNSAFE]
    assert found.faults[0].leg == ""
    x, y = found.faults[0].place
    assert 90 < x < 170
    assert y == pytest.approx(50)


def test_a_basin_that_is_passed_ends_the_leg():
    """A detour over the basin's rim would have the whole way be a leg: the nearest open water is what counts."""
    water = shapely.union_all([box(0, 0, 100, 100), box(100, 0, 160, 10), box(160, 0, 400, 100)])
    found = conduct([(2, 5), (165, 5), (200, 50)], water)
    assert rules(found) == [Rule.UNSAFE]


def test_without_a_safety_distance_the_shore_itself_is_in():
    assert conduct([(0, 0), (400, 0), (400, 200)], safety_m=0.0).faults == ()
    assert rules(conduct([(20, 20), (420, 20), (420, 40), (380, 40)], safety_m=0.0)) == [Rule.OUTSIDE, Rule.UNSAFE]


def test_a_path_that_never_enters_the_water_is_outside():
    found = conduct([(500, 0), (600, 0)])
    assert found.outside_m == pytest.approx(100.0)
    assert Rule.OUTSIDE in rules(found)


@settings(max_examples=40)
@given(
    st.lists(
        st.tuples(st.integers(-60, 460).map(lambda x: x + 0.37), st.integers(-60, 260).map(lambda y: y + 0.73)),
        min_size=2,
        max_size=8,
        unique=True,
    ),
    st.floats(0.0, 6.28),
)
def test_metres_are_those_of_the_overlay_and_do_not_depend_on_the_frame(points, angle_rad):
    water = LAKE.difference(shapely.Point(200, 100).buffer(40))
    path = LineString(points)
    # An overlay counts once what a path runs over twice; and what just touches a bound may turn to either side.
    assume(path.is_simple)
    found = conduct(points, water)
    assert found.outside_m == pytest.approx(path.difference(water.buffer(0.01)).length, abs=0.05)
    turned, turned_water = (affinity.rotate(each, angle_rad, (0, 0), use_radians=True) for each in (path, water))
    again = Shore(turned_water, SAFETY_M).conduct(turned, turned.coords[0], turned.coords[-1])
    assert again.outside_m == pytest.approx(found.outside_m, abs=0.05)
    legs = [leg.unsafe_m for leg in found.legs]
    assert [leg.unsafe_m for leg in again.legs] == pytest.approx(legs, abs=0.1)


def test_a_ragged_shore_of_many_points_is_judged_as_it_stands():
    angles = np.linspace(0, 2 * np.pi, 20_001)[:-1]
    radius = 1000 + 20 * np.sin(313 * angles)
    water = Polygon(np.column_stack([radius * np.cos(angles), radius * np.sin(angles)]))
    ring = shapely.Point(0, 0).buffer(975 - SAFETY_M).exterior
    assert conduct(ring.coords, water).faults == ()
    assert Rule.UNSAFE in rules(conduct(shapely.Point(0, 0).buffer(985).exterior.coords, water))


@pytest.mark.parametrize("turn_rad", np.linspace(0.01, 3.0, 40))
def test_rounding_at_the_ends_of_a_path_ends_no_leg(turn_rad):
    """Without a safety distance legs begin exactly at the ends, but for rounding."""
    path = LineString([(-4.8, 20.3), (30.1, 20.3), (201.7, 33.3), (17.3, 10.1), (-4.8, 10.1)])
    water, path = (affinity.rotate(shape, turn_rad, origin=(7, 3), use_radians=True) for shape in (LAKE, path))
    assert not conduct(path, water, 0.0).faults


def test_the_water_of_a_leg_is_that_where_it_ends_though_other_water_is_as_near():
    """A dock in a zone across a creek: half of the creek leads nowhere."""
    halves = LAKE | box(-60, 96, 0, 104) | box(-120, 96, -76, 104)
    path = [(-68.0, 100.0), (50.0, 100.0), (50.0, 150.0)]
    found = Shore(halves, SAFETY_M).conduct(LineString(path), path[0], path[-1])
    assert not found.faults


POCKET = LAKE.difference(box(0, 90, 14, 110)) | box(0, 91, 13, 109)


@pytest.mark.parametrize(
    ("x", "over_land_m"), [(5.0, 1.0), (13.3, 0.7), (-2.0, 3.0)], ids=["in it", "in its rim", "ashore"]
)
@pytest.mark.parametrize("end", ["launch", "recovery"])
def test_no_pocket_makes_the_way_over_its_rim_necessary(x, over_land_m, end):
    path = [(x, 100.0), (50.0, 100.0), (50.0, 150.0)]
    found = conduct(path if end == "launch" else path[::-1], POCKET)
    (fault,) = found.faults
    assert (fault.rule, fault.leg) == (Rule.OUTSIDE, end)
    necessary_m = max(0.0, -x, x - 13.0)
    assert fault.metres == pytest.approx(over_land_m - necessary_m, abs=0.05)


def test_a_launch_in_a_seam_makes_no_way_over_land_necessary():
    behind = LAKE.difference(box(0.02, 90, 14, 110))
    path = LineString([(0.01, 100.0), (50.0, 100.0), (50.0, 150.0)])
    (fault,) = Shore(behind, SAFETY_M, 0.1).conduct(path, path.coords[0], path.coords[-1]).faults
    assert (fault.rule, fault.leg) == (Rule.OUTSIDE, "launch")
    assert fault.metres == pytest.approx(13.97, abs=0.05)


def test_a_creek_as_wide_as_twice_the_safety_distance_does_not_lose_the_other_leg():
    """The way there is as good as safe, and of no basin; the other place lies at the creek's blind end."""
    creek = [(410, 100), (380, 100), (380, 20), (20, 20), (20, 120), (385, 120), (385, 100.05), (699, 100.05)]
    water = box(0, 0, 400, 200).union(box(400, 90, 700, 110))
    for path in (creek, creek[::-1]):
        found = conduct(path, water)
        assert found.faults == ()
        assert sorted(round(leg.unsafe_m, 1) for leg in found.legs) == [0.0, 8.9]
