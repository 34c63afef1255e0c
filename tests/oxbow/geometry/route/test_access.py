"""Ways to an area from outside it: over land to the nearest water, and through the water from there."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPolygon, Point, box

from oxbow.errors import Infeasible
from oxbow.geometry.route import Routes, way_to
from oxbow.tolerances import ON_SHORE_M

LAKE = box(0, 0, 100, 100)
CREEK = box(100, 40, 160, 44).union(box(156, 40, 160, 90))
WATER = LAKE.union(CREEK)
AREA = LAKE.buffer(-10)


def test_from_inside_there_is_no_way():
    assert way_to(AREA, Routes(WATER), (50, 50)).tolist() == [[50, 50], [50, 50]]


def test_straight_where_that_keeps_to_the_water():
    assert way_to(AREA, Routes(WATER), (96, 50)).tolist() == [[96, 50], [90, 50]]


@pytest.mark.parametrize("place", [(-30.0, 50.0), (-0.5, 50.0)])
def test_over_land_to_the_nearest_water_and_on_as_from_there(place):
    assert way_to(AREA, Routes(WATER), place).tolist() == [list(place), [0, 50], [10, 50]]


def test_from_the_bank_of_a_creek_as_from_the_creek():
    ashore, afloat = (way_to(AREA, Routes(WATER), place) for place in ((161.0, 88.0), (160.0, 88.0)))
    assert ashore[:2].tolist() == [[161, 88], [160, 88]]
    assert ashore[1:].tolist() == afloat.tolist()
    assert len(afloat) > 2


@pytest.mark.parametrize("off_m", [0.004, 0.0, -0.01])
def test_by_a_hair_ashore_is_on_the_shore(off_m):
    way = way_to(AREA, Routes(WATER), (160.0 + off_m, 88.0))
    assert way[0].tolist() == [160.0 + off_m, 88.0]
    on_shore = way_to(AREA, Routes(WATER), (160.0, 88.0))
    assert np.allclose(way[1:], on_shore[1:])


@given(place=st.tuples(st.floats(-30, 190), st.floats(-30, 120)))
@settings(max_examples=60)
def test_land_is_crossed_once_straight_from_the_place_to_the_water(place):
    line = LineString(way_to(AREA, Routes(WATER), place))
    distance_m = WATER.distance(Point(place))
    over_land = line.difference(WATER.buffer(1e-9))
    assert over_land.length == pytest.approx(distance_m if distance_m > ON_SHORE_M else 0.0, abs=ON_SHORE_M)
    assert over_land.length == 0.0 or shapely.dwithin(over_land, Point(place), 1e-9)


@pytest.mark.parametrize("area", [AREA, MultiPolygon([box(10, 10, 20, 20), box(60, 30, 90, 60)])])
def test_round_the_corner_of_a_creek(area):
    """44 m down the creek, 58 along it and 10 over the lake, from middle to middle."""
    way = way_to(area, Routes(WATER), (158, 88))
    assert way[0].tolist() == [158, 88]
    assert WATER.buffer(1e-6).covers(LineString(way))
    assert area.distance(Point(way[-1])) < 1e-6
    assert not area.buffer(-1e-6).intersects(LineString(way))
    assert len(way) > 2
    assert LineString(way).length == pytest.approx(112.0, rel=0.05)
    assert WATER.boundary.distance(LineString(way[1:])) > 0.1


def test_water_that_leads_elsewhere_is_refused():
    pond = box(200, 0, 250, 50)
    with pytest.raises(Infeasible, match="no route leads"):
        way_to(AREA, Routes(MultiPolygon([WATER, pond])), (225, 25))


def test_the_same_way_wherever_the_site_lies():
    moved = way_to(box(1010, 10, 1090, 90), Routes(box(1000, 0, 1100, 100)), (1096, 50))
    assert np.allclose(moved - [1000, 0], way_to(box(10, 10, 90, 90), Routes(LAKE), (96, 50)))
