"""Legs to shares: they keep to the free space, run beside one another, and leave the path simple."""

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, box

from oxbow.contracts import Approach, Role, Share, Vehicle
from oxbow.errors import Infeasible
from oxbow_assignment.shares.approach import Harbour
from oxbow_path.approach import path_with_approach

LAKE = box(0, 0, 1000, 400) - box(300, 100, 500, 400)
FREE = LAKE.buffer(-5.0, join_style="mitre")
EAST = FREE & box(600, 0, 1000, 400)
SPACING_M = 20.0

quick = settings(max_examples=40)
ashore = st.tuples(st.floats(-20, 0), st.floats(10, 390))
afloat = st.tuples(st.floats(6, 290), st.floats(6, 390))


def vehicle(start, recovery=None, length_m=1e5) -> Vehicle:
    return Vehicle(name="v", role=Role.MASTER, length_m=length_m, start=start, recovery=recovery or start)


def ring(share: Polygon, gate) -> LineString:
    """A path in a share that begins and ends at its gate: round a part of it."""
    inner = share.buffer(-10.0, join_style="mitre").exterior
    away = inner.project(Point(gate))
    start, end = inner.interpolate(away - 3.0), inner.interpolate((away + 3.0) % inner.length)
    around = [
        inner.interpolate((away + 3.0 + share_of * (inner.length - 6.0)) % inner.length)
        for share_of in (0.2, 0.4, 0.6, 0.8)
    ]
    line = LineString([gate, end, *around, start, gate])
    assert line.is_simple
    return line


def share_of(start, recovery=None, *, spacing_m=SPACING_M, length_m=1e5) -> Share:
    return Harbour(FREE, LAKE, spacing_m).share(EAST, vehicle(start, recovery, length_m))


def whole(approach: Approach, start, recovery) -> LineString:
    assert approach.launch == approach.recovery
    path = path_with_approach(ring(EAST, approach.launch), approach)
    assert path.is_simple
    assert (path.coords[0], path.coords[-1]) == (start, recovery)
    return path


@given(start=ashore | afloat)
@quick
def test_out_and_home_from_one_place(start):
    share = share_of(start)
    approach = share.approach
    assert EAST.covers(Point(approach.launch))
    assert share.area.area == pytest.approx(EAST.area)
    path = whole(approach, start, start)
    entry = FREE.distance(Point(start))
    # Straight out, whatever the distance of the two ways: no leg runs along the shore.
    stray = path - FREE.buffer(0.01) - Point(start).buffer(1.2 * entry + 0.01)
    assert stray.is_empty


@given(start=afloat, recovery=ashore | afloat)
@quick
def test_out_from_one_place_and_home_to_another(start, recovery):
    whole(share_of(start, recovery).approach, start, recovery)


@given(start=afloat, spacing_m=st.sampled_from([20.0, 150.0]))
@quick
def test_what_legs_take_is_their_length(start, spacing_m):
    approach = share_of(start, spacing_m=spacing_m).approach
    around = ring(EAST, approach.launch)
    taken_m = path_with_approach(around, approach).length - around.length
    # What is kept back and not used, the vehicle does not survey with.
    assert taken_m <= approach.legs_m <= taken_m + 0.5 * spacing_m


@given(x=st.floats(530, 595), y=st.floats(-10, 20), spacing_m=st.floats(20, 400))
@quick
def test_a_leg_from_beside_a_share_does_not_begin_in_it(x, y, spacing_m):
    before = FREE & box(520, 0, 600, 40)
    share = Harbour(FREE, LAKE, spacing_m).share(FREE - before - box(0, 0, 520, 400), vehicle((x, y)))
    assert share.approach.out is not None
    assert (share.approach.out.line & share.area).length < 0.01


def test_a_vehicle_at_its_share_has_no_legs():
    for start in ((700.0, 200.0), (1010.0, 200.0), (990.0, 399.0)):
        share = share_of(start, length_m=5.0)
        assert not share.approach.has_legs
        assert share.approach.legs_m == 0.0
        assert share.area == EAST


def test_a_way_that_is_longer_than_the_range_is_refused_with_its_length():
    with pytest.raises(Infeasible, match=r"'v': length_m: is 900 m; expected more than 1\d\d\d.* m: the way"):
        share_of((100.0, 100.0), length_m=900.0)


def test_lanes_are_as_narrow_as_the_water():
    strait = LAKE - box(300, 4.0, 500, 200)
    free = strait.buffer(-1.0, join_style="mitre")
    east = free & box(600, 0, 1000, 400)
    assert isinstance(east, Polygon)
    approach = Harbour(free, strait, SPACING_M).share(east, vehicle((100.0, 100.0))).approach
    assert 4.0 * approach.apart_m <= 2.0
    path = path_with_approach(ring(east, approach.launch), approach)
    assert path.is_simple
    assert (path - free.buffer(0.01)).is_empty


CREEK = shapely.union_all([box(-100, 192, 1, 208), box(-100, 192, -84, 320)])
"""It leads round a corner; 6 m of its 16 are free: legs may run there, but no lanes of theirs 4 m from the rim."""


@pytest.mark.parametrize("start", [(-92.0, 310.0), (-92.0, 250.0), (-60.0, 200.0)])
def test_once_in_free_space_legs_keep_to_it(start):
    """The shortest water cuts the corner."""
    water = LAKE | CREEK
    free = water.buffer(-5.0, join_style="mitre")
    east = free & box(600, 0, 1000, 400)
    path = whole(Harbour(free, water, SPACING_M).share(east, vehicle(start)).approach, start, start)
    assert free.covers(Point(start))
    assert (path - free.buffer(0.01)).is_empty


@pytest.mark.parametrize("start", [(-303.0, 187.0), (-300.0, 188.0), (-302.0, 190.0)])
@pytest.mark.parametrize("safety_m", [1.0, 7.0])
def test_lanes_fit_a_canal_before_the_water_that_has_room_for_wider_ones(start, safety_m):
    """From its corner, a middle line that only aims at the wide water leaves the rim at a slant."""
    water = LAKE | box(-300, 190, 1, 210)
    free = water.buffer(-safety_m, join_style="mitre")
    east = free & box(600, 0, 1000, 400)
    path = whole(Harbour(free, water, 150.0).share(east, vehicle(start)).approach, start, start)
    assert (path - free.buffer(0.01) - Point(start).buffer(1.5 * free.distance(Point(start)))).is_empty


@pytest.mark.parametrize("field", ["start", "recovery"])
def test_water_without_a_way_to_the_share_is_refused_by_the_place_it_is_missing_from(field):
    apart = box(0, 0, 100, 100)
    free = shapely.union_all([apart, box(100, 40, 200, 40.0001), box(200, 0, 300, 100)])
    places = {"start": (250.0, 50.0), "recovery": (250.0, 50.0), field: (50.0, 50.0)}
    with pytest.raises(Infeasible, match=f"'v': {field}: .*no route"):
        Harbour(free, LAKE, SPACING_M).share(box(200, 0, 300, 100), vehicle(**places))
