"""Legs to shares: they keep to the free space, run beside one another, and leave the path simple."""

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, box

from oxbow.contracts import FreeSpace, Role, Vehicle
from oxbow.errors import Infeasible
from oxbow.planning.approach import Approach, Harbour

LAKE = box(0, 0, 1000, 400) - box(300, 100, 500, 400)
FREE = LAKE.buffer(-5.0, join_style="mitre")
SPACE = FreeSpace(free=FREE, water=LAKE, tolerance_m=1.0, compression=1.0)
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


def with_legs(approach: Approach, start, recovery) -> LineString:
    assert approach.launch == approach.recovery
    path = approach.with_legs(ring(EAST, approach.launch))
    assert path.is_simple
    assert (path.coords[0], path.coords[-1]) == (start, recovery)
    return path


@given(start=ashore | afloat)
@quick
def test_out_and_home_from_one_place(start):
    approach = Harbour(SPACE, SPACING_M).approach(EAST, vehicle(start))
    assert EAST.covers(Point(approach.launch))
    assert approach.space.free.area == pytest.approx(EAST.area)
    path = with_legs(approach, start, start)
    entry = FREE.distance(Point(start))
    # Straight out, whatever the distance of the two ways: no leg runs along the shore.
    stray = path - FREE.buffer(0.01) - Point(start).buffer(1.2 * entry + 0.01)
    assert stray.is_empty


@given(start=afloat, recovery=ashore | afloat)
@quick
def test_out_from_one_place_and_home_to_another(start, recovery):
    with_legs(Harbour(SPACE, SPACING_M).approach(EAST, vehicle(start, recovery)), start, recovery)


@given(start=afloat, spacing_m=st.sampled_from([20.0, 150.0]))
@quick
def test_what_legs_take_is_their_length(start, spacing_m):
    approach = Harbour(SPACE, spacing_m).approach(EAST, vehicle(start))
    around = ring(EAST, approach.launch)
    kept_m = 1e5 - approach.length_m(1e5)
    taken_m = approach.with_legs(around).length - around.length
    # What is kept back and not used, the vehicle does not survey with.
    assert taken_m <= kept_m <= taken_m + 0.5 * spacing_m


@given(x=st.floats(530, 595), y=st.floats(-10, 20), spacing_m=st.floats(20, 400))
@quick
def test_a_leg_from_beside_a_share_does_not_begin_in_it(x, y, spacing_m):
    before = FREE & box(520, 0, 600, 40)
    approach = Harbour(SPACE, spacing_m).approach(FREE - before - box(0, 0, 520, 400), vehicle((x, y)))
    assert approach.out is not None
    assert (LineString(approach.out.points) & approach.space.free).length < 0.01


def test_a_vehicle_at_its_share_has_no_legs():
    for start in ((700.0, 200.0), (1010.0, 200.0), (990.0, 399.0)):
        approach = Harbour(SPACE, SPACING_M).approach(EAST, vehicle(start))
        assert approach.out is None
        assert approach.home is None
        assert approach.space.water.equals(LAKE)
        assert approach.length_m(5.0) == 5.0
        path = LineString([start, (800, 200), start])
        assert approach.with_legs(path) is path


def test_a_way_that_is_longer_than_the_range_is_refused_with_its_length():
    approach = Harbour(SPACE, SPACING_M).approach(EAST, vehicle((100.0, 100.0)))
    with pytest.raises(Infeasible, match=r"Master_length: is 900 m; expected more than 1\d\d\d.* m: the way"):
        approach.length_m(900.0)


def test_a_way_that_takes_much_of_the_range_is_told():
    approach = Harbour(SPACE, SPACING_M).approach(EAST, vehicle((50.0, 200.0)))
    legs_m = 1e5 - approach.length_m(1e5)
    assert not approach.warnings(5.0 * legs_m)
    (told,) = approach.warnings(2.0 * legs_m)
    assert "takes 50% of its" in told


def test_lanes_are_as_narrow_as_the_water():
    strait = LAKE - box(300, 4.0, 500, 200)
    free = strait.buffer(-1.0, join_style="mitre")
    space = FreeSpace(free=free, water=strait, tolerance_m=1.0, compression=1.0)
    share = free & box(600, 0, 1000, 400)
    assert isinstance(share, Polygon)
    approach = Harbour(space, SPACING_M).approach(share, vehicle((100.0, 100.0)))
    assert 4.0 * approach.apart_m <= 2.0
    path = approach.with_legs(ring(share, approach.launch))
    assert path.is_simple
    assert (path - free.buffer(0.01)).is_empty


CREEK = shapely.union_all([box(-100, 192, 1, 208), box(-100, 192, -84, 320)])
"""It leads round a corner; 6 m of its 16 are free: legs may run there, but no lanes of theirs 4 m from the rim."""


@pytest.mark.parametrize("start", [(-92.0, 310.0), (-92.0, 250.0), (-60.0, 200.0)])
def test_once_in_free_space_legs_keep_to_it(start):
    """The shortest water cuts the corner."""
    water = LAKE | CREEK
    free = water.buffer(-5.0, join_style="mitre")
    space = FreeSpace(free=free, water=water, tolerance_m=1.0, compression=1.0)
    share = free & box(600, 0, 1000, 400)
    path = with_legs(Harbour(space, SPACING_M).approach(share, vehicle(start)), start, start)
    assert free.covers(Point(start))
    assert (path - free.buffer(0.01)).is_empty


def test_water_without_a_way_to_the_share_is_refused():
    apart = box(0, 0, 100, 100)
    space = FreeSpace(
        free=shapely.union_all([apart, box(100, 40, 200, 40.0001), box(200, 0, 300, 100)]),
        water=LAKE,
        tolerance_m=1.0,
        compression=1.0,
    )
    with pytest.raises(Infeasible, match="no route"):
        Harbour(space, SPACING_M).approach(box(200, 0, 300, 100), vehicle((50.0, 50.0)))
