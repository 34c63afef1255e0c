"""Ways to an area from outside it: straight where that is safe or nothing is known, else through the water."""

import numpy as np
import pytest
from shapely import LineString, MultiPolygon, Point, box

from oxbow.errors import Infeasible
from oxbow.route import Routes, way_to

LAKE = box(0, 0, 100, 100)
CREEK = box(100, 40, 160, 44).union(box(156, 40, 160, 90))
WATER = LAKE.union(CREEK)
AREA = LAKE.buffer(-10)


def test_from_inside_there_is_no_way():
    assert way_to(AREA, Routes(WATER), (50, 50)).tolist() == [[50, 50], [50, 50]]


def test_straight_where_that_keeps_to_the_water():
    assert way_to(AREA, Routes(WATER), (96, 50)).tolist() == [[96, 50], [90, 50]]


def test_straight_from_ashore():
    assert way_to(AREA, Routes(WATER), (150, 95)).tolist() == [[150, 95], [90, 90]]


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
    with pytest.raises(Infeasible, match="no way leads"):
        way_to(AREA, Routes(MultiPolygon([WATER, pond])), (225, 25))


def test_the_same_way_wherever_the_site_lies():
    moved = way_to(box(1010, 10, 1090, 90), Routes(box(1000, 0, 1100, 100)), (1096, 50))
    assert np.allclose(moved - [1000, 0], way_to(box(10, 10, 90, 90), Routes(LAKE), (96, 50)))
