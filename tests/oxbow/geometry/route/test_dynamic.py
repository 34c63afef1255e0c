"""Changing obstacles leads to the triangulation that a rebuild makes."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from oxbow.contracts import DangerZone, Per
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.route import Danger, DynamicRouter, RouteMethod, make_router
from oxbow.geometry.triangles import cross
from oxbow.testing import nasty_polygons
from tests.support.route_scenes import obstacle, places_in, scene

quick = settings(max_examples=12)
GRID_M = 1e-5
"""More than what the grid of obstacles' vertices can move."""


def expected_water(water, router):
    return water.difference(shapely.union_all(list(router.obstacles.values())))


def require_triangulation(mesh, water):
    """It tiles the water, ends at its shore, and is constrained Delaunay."""
    inner = np.flatnonzero(mesh.twins >= 0)
    assert np.array_equal(mesh.twins[mesh.twins[inner]], inner)
    assert np.array_equal(mesh.tails[inner], mesh.heads[mesh.twins[inner]])
    assert shapely.area(mesh.polygons).sum() == pytest.approx(water.area, abs=1e-2)
    shore_m = np.hypot(*(mesh.heads - mesh.tails)[mesh.shore].T).sum()
    assert shore_m == pytest.approx(water.length, abs=1e-2)
    tail, head = mesh.tails[inner], mesh.heads[inner]
    apexes = [mesh.corners[sides // 3, (sides + 2) % 3] for sides in (inner, mesh.twins[inner])]
    angles = [angle_rad(tail - apex, head - apex) for apex in apexes]
    assert (angles[0] + angles[1] <= np.pi + 1e-6).all()


def angle_rad(a, b):
    return np.abs(np.arctan2(cross(a, b), (a * b).sum(axis=1)))


def shuffle(router, rng, steps, low, high):
    """Put, move and remove obstacles; some overlap each other and the shore."""
    for _ in range(steps):
        name = f"obstacle {rng.integers(5)}"
        if name in router.obstacles and rng.random() < 0.3:
            router.remove(name)
        else:
            router.put(name, obstacle(rng, rng.uniform(low, high), rng.uniform(4, 18)))
        yield


@quick
@given(seed=st.integers(0, 100_000))
def test_every_change_leaves_a_delaunay_triangulation_of_the_water(seed):
    water = scene(seed, obstacles=4)
    router = DynamicRouter(water)
    for _ in shuffle(router, np.random.default_rng(seed), 12, 0.0, 100.0):
        require_triangulation(router.mesh, expected_water(water, router))
    for name in list(router.obstacles):
        router.remove(name)
    require_triangulation(router.mesh, water)


@pytest.mark.parametrize("name", sorted(nasty_polygons()))
def test_obstacles_come_and_go_in_nasty_shapes(name):
    water = nasty_polygons()[name]
    router = DynamicRouter(water)
    before = len(router.mesh.triangles)
    low, high = np.reshape(water.bounds, (2, 2))
    for _ in shuffle(router, np.random.default_rng(5), 6, low, high):
        on_grid = shapely.set_precision(water, 2.0**-20)
        require_triangulation(router.mesh, expected_water(on_grid, router))
    for obstacle_name in list(router.obstacles):
        router.remove(obstacle_name)
    assert len(router.mesh.triangles) == before


@pytest.mark.parametrize("method", [RouteMethod.VISIBILITY, RouteMethod.FUNNEL, RouteMethod.INCENTERS])
def test_distances_are_those_of_a_rebuild(method):
    for seed in range(5):
        water = scene(seed, obstacles=3)
        router = DynamicRouter(water, method=method)
        for _ in shuffle(router, np.random.default_rng(seed), 8, 20.0, 80.0):
            pass
        left = expected_water(water, router)
        points = places_in(left, 6, seed)
        points = points[shapely.contains_xy(left.buffer(-GRID_M), points)]
        ours, rebuilt = router.distances(points), make_router(method, left).distances(points)
        assert np.array_equal(np.isinf(ours), np.isinf(rebuilt))
        assert np.allclose(ours, rebuilt, atol=1e-3)


def test_an_obstacle_in_the_way_is_gone_round_and_forgotten():
    router = DynamicRouter(box(0, 0, 100, 100), method=RouteMethod.VISIBILITY)
    assert router.route((10, 50), (90, 50)).length_m == pytest.approx(80)
    router.put("wreck", box(40, 20, 60, 80))
    assert router.route((10, 50), (90, 50)).length_m == pytest.approx(20 + 2 * np.hypot(30, 30), abs=GRID_M)
    router.put("wreck", box(40, 20, 60, 40))
    assert router.route((10, 50), (90, 50)).length_m == pytest.approx(80)
    router.put("wreck", box(40, 20, 60, 80))
    router.remove("wreck")
    assert not router.obstacles
    assert len(router.mesh.triangles) == 2
    assert router.route((10, 50), (90, 50)).length_m == pytest.approx(80)


def test_a_boom_across_the_water_parts_it():
    router = DynamicRouter(box(0, 0, 100, 100))
    router.put("boom", box(45, -5, 55, 105))
    assert np.isinf(router.distances([(10, 10), (90, 90)])[0, 1])
    with pytest.raises(Infeasible, match="no route leads there"):
        router.route((10, 10), (90, 90))
    with pytest.raises(Infeasible, match=r"start: at \(50, 50\) lies outside the water, 5 m"):
        router.route((50, 50), (90, 90))


def test_bad_obstacles_are_named_and_change_nothing():
    router = DynamicRouter(box(0, 0, 100, 100))
    router.put("wreck", box(40, 40, 60, 60))
    mesh = router.mesh
    with pytest.raises(InvalidRequest, match="crossed: is empty or not a valid polygon"):
        router.put("crossed", Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]))
    with pytest.raises(InvalidRequest, match="whale: is not an obstacle; expected one of: wreck"):
        router.remove("whale")
    with pytest.raises(Infeasible, match="flood: covers all the water"):
        router.put("flood", box(-1, -1, 101, 101))
    assert router.mesh is mesh
    assert list(router.obstacles) == ["wreck"]


def test_danger_on_the_way_is_told():
    shallows = DangerZone(name="shallows", area=box(30, 20, 70, 100), probability=0.05, per=Per.METRE)
    danger = Danger((shallows,), c_max_m=1e4)
    router = DynamicRouter(box(0, 0, 100, 100), danger)
    router.put("wreck", box(45, 45, 55, 55))
    straight = router.route((10, 60), (90, 60))
    assert straight.danger == pytest.approx(
        1 - 0.95 ** straight.line.intersection(box(30, 20, 70, 100)).length, abs=1e-4
    )
    assert straight.cost > straight.length_m + 1e4
    assert router.distances([(10, 60), (90, 60)])[0, 1] == pytest.approx(straight.cost)
