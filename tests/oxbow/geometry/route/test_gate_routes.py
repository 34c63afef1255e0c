"""Routes through the water: from place to place, into areas, and drawn taut."""

import itertools

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, box

from oxbow.geometry.route.gate_routes import Routes, taut
from tests.support.path_requests import lake

quick = settings(max_examples=12)

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
