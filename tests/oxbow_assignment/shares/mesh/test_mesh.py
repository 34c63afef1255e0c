"""Meshes tile their area, their edges are short enough, and wavefronts reach all of them."""

import math

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, affinity, box

from oxbow.errors import InvalidRequest
from oxbow.testing import nasty_polygons
from oxbow_assignment.shares.mesh import Mesh, mesh_area, propagate
from oxbow_assignment.shares.mesh.refinement import refined
from oxbow_assignment.shares.mesh.triangulation import Triangulation
from tests.support.path_requests import lake

quick = settings(max_examples=6)


def require_tiling(mesh: Mesh, area: Polygon) -> None:
    """No triangle is turned over or reaches out, none overlaps another, none is missing."""
    scale = math.hypot(*np.ptp(mesh.points, axis=0))
    assert (mesh.areas_m2 > 0).all()
    assert mesh.areas_m2.sum() == pytest.approx(area.area, rel=1e-9)
    outside = shapely.difference(mesh.polygons, area.buffer(1e-9 * scale))
    assert shapely.area(outside).max() == 0.0


def require_neighbours(mesh: Mesh) -> None:
    """Neighbours are mutual, and share the side that they stand at, which is as long as is said."""
    triangle, side = np.nonzero(mesh.neighbours >= 0)
    beyond = mesh.neighbours[triangle, side]
    assert (mesh.neighbours[beyond] == triangle[:, None]).any(axis=1).all()
    tails, heads = (mesh.triangles[triangle, (side + shift) % 3] for shift in (0, 1))
    for ends in (tails, heads):
        assert (mesh.triangles[beyond] == ends[:, None]).any(axis=1).all()
    lengths_m = np.hypot(*(mesh.points[heads] - mesh.points[tails]).T)
    assert mesh.edge_lengths_m[triangle, side] == pytest.approx(lengths_m)


def border_m(mesh: Mesh) -> float:
    return float(mesh.edge_lengths_m[mesh.neighbours < 0].sum())


@quick
@given(seed=st.integers(0, 10_000), pieces=st.floats(3, 40), bound=st.sampled_from([0.0, 20.0, 28.0]))
def test_lakes_are_tiled(seed, pieces, bound):
    water = lake(seed, vertices=80)
    mesh = mesh_area(water, math.sqrt(water.area) / pieces, least_angle_deg=bound)
    require_tiling(mesh, water)
    require_neighbours(mesh)
    assert border_m(mesh) == pytest.approx(water.length, rel=1e-9)


@pytest.mark.parametrize("name", sorted(nasty_polygons()))
@pytest.mark.parametrize(("edge_m", "bound"), [(30.0, 0.0), (7.0, 20.0)])
def test_nasty_shapes_are_tiled(name, edge_m, bound):
    area = nasty_polygons()[name]
    mesh = mesh_area(area, edge_m, least_angle_deg=bound)
    require_tiling(mesh, area)
    require_neighbours(mesh)
    assert border_m(mesh) == pytest.approx(area.length, rel=1e-6)
    assert mesh.angle_statistics.longest_edge_m <= edge_m * (1 + 1e-6)


@quick
@given(seed=st.integers(0, 10_000), pieces=st.floats(3, 30))
def test_no_edge_is_longer_than_asked(seed, pieces):
    water = lake(seed, vertices=80)
    edge_m = math.sqrt(water.area) / pieces
    assert mesh_area(water, edge_m).angle_statistics.longest_edge_m <= edge_m * (1 + 1e-6)


def smooth_area() -> Polygon:
    """An area of the kind of the paper's: about 20 vertices, a forbidden zone inside, 5 km across."""
    turn = np.linspace(0, 2 * np.pi, 17, endpoint=False)
    radius = 2500 * (1 + 0.12 * np.cos(3 * turn) + 0.05 * np.sin(5 * turn))
    outline = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    return Polygon(outline, [[(-700, -400), (-500, 500), (400, 600), (600, -500)]])


@pytest.mark.parametrize("edge_m", [150.0, 200.0, 250.0, 300.0])
def test_angles_of_a_plain_area(edge_m):
    """Balampanis et al. 2016, Table I: the least angle is 25 degrees without a bound, 34 with the greatest."""
    statistics = mesh_area(smooth_area(), edge_m).angle_statistics
    assert statistics.least_deg >= 30.0
    assert statistics.low_deg >= 37.0
    assert statistics.mean_least_deg >= 52.0


def test_relaxation_makes_angles_greater():
    area = smooth_area()
    plain, relaxed = (mesh_area(area, 250.0, relaxations=rounds).angle_statistics for rounds in (0, 20))
    assert relaxed.low_deg > plain.low_deg
    assert relaxed.least_deg >= plain.least_deg


@pytest.mark.parametrize("name", ["collinear runs", "comb", "island", "petals", "chessboard"])
@pytest.mark.parametrize("bound", [15.0, 20.0])
def test_a_bound_on_angles_is_kept(name, bound):
    area = nasty_polygons()[name]
    assert mesh_area(area, 10.0, least_angle_deg=bound).angle_statistics.least_deg >= bound


def test_no_bound_adds_no_points():
    area = nasty_polygons()["collinear runs"]
    plain, refined = (mesh_area(area, 10.0, least_angle_deg=least) for least in (0.0, 20.0))
    assert plain.angle_statistics.least_deg < 10.0
    assert len(plain) < len(refined)


@quick
@given(seed=st.integers(0, 10_000), turn=st.floats(0, 360), away=st.floats(-1e5, 1e5))
def test_a_turned_and_moved_area_has_the_same_statistics(seed, turn, away):
    water = lake(seed, vertices=60)
    moved = affinity.translate(affinity.rotate(water, turn, origin=(0, 0)), away, -2 * away)
    edge_m = math.sqrt(water.area) / 12
    here, there = mesh_area(water, edge_m), mesh_area(moved, edge_m)
    assert len(there) == pytest.approx(len(here), rel=0.02)
    for field in ("mean_least_deg", "mean_edge_m"):
        expected = getattr(here.angle_statistics, field)
        assert getattr(there.angle_statistics, field) == pytest.approx(expected, rel=0.02)


def test_the_same_area_gives_the_same_mesh():
    one, other = (mesh_area(lake(5), 150.0) for _ in range(2))
    assert (one.points == other.points).all()
    assert (one.triangles == other.triangles).all()


def test_statistics_of_a_mesh_that_is_known():
    mesh = mesh_area(Polygon([(0, 0), (1, 0), (0.5, math.sqrt(3) / 2)]), 10.0)
    statistics = mesh.angle_statistics
    assert len(mesh) == 1
    assert statistics.least_deg == pytest.approx(60)
    assert statistics.greatest_deg == pytest.approx(60)
    assert statistics.shortest_edge_m == pytest.approx(1)
    assert statistics.mean_edge_m == pytest.approx(1)


def test_a_divided_mesh_tiles_the_same_area_with_the_same_angles():
    coarse = mesh_area(lake(1), 300.0)
    fine = coarse.subdivided()
    require_tiling(fine, lake(1))
    require_neighbours(fine)
    assert fine.areas_m2.reshape(-1, 4).sum(axis=1) == pytest.approx(coarse.areas_m2)
    assert fine.angle_statistics.least_deg == pytest.approx(coarse.angle_statistics.least_deg)


def test_places_are_located_in_their_triangles():
    mesh = mesh_area(lake(2), 200.0)
    assert (mesh.located(mesh.centroids) == np.arange(len(mesh))).all()


@pytest.mark.parametrize(
    ("area", "edge_m", "bound", "message"),
    [
        (Polygon(), 1.0, 0.0, "area: is empty"),
        (Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), 1.0, 0.0, "area: is empty or not a valid"),
        (box(0, 0, 1, 1), 0.0, 0.0, "edge_m: is 0.0"),
        (box(0, 0, 1, 1), math.nan, 0.0, "edge_m: is nan"),
        (box(0, 0, 1, 1), 1e-6, 0.0, "edge_m: is 1e-06, which makes about"),
        (box(0, 0, 1, 1), 1.0, 35.0, "least_angle_deg: is 35.0"),
    ],
)
def test_what_no_mesh_can_be_made_of_is_named(area, edge_m, bound, message):
    with pytest.raises(InvalidRequest, match=message):
        mesh_area(area, edge_m, least_angle_deg=bound)


@quick
@given(seed=st.integers(0, 10_000), starts=st.lists(st.integers(0, 10**6), min_size=1, max_size=5, unique=True))
def test_wavefronts_reach_every_triangle_in_the_fewest_steps(seed, starts):
    mesh = mesh_area(lake(seed, vertices=60), 250.0)
    starts = sorted({start % len(mesh) for start in starts})
    waves = propagate(mesh, starts)
    graph = nx.Graph((t, n) for t, row in enumerate(mesh.neighbours.tolist()) for n in row if n >= 0)
    expected = nx.multi_source_dijkstra_path_length(graph, set(starts))
    assert waves.depth.tolist() == [expected[t] for t in range(len(mesh))]
    for number, start in enumerate(starts):
        assert waves.source[start] == number
        own = np.flatnonzero(waves.source == number)
        assert nx.is_connected(graph.subgraph(own.tolist()))
    assert (waves.branch[starts] == -1).all()
    others = np.setdiff1d(np.arange(len(mesh)), starts)
    assert (waves.branch[others] // 3 == waves.source[others]).all()


def test_wavefronts_stay_within_what_they_may_enter():
    mesh = mesh_area(box(0, 0, 100, 100), 10.0)
    left = mesh.centroids[:, 0] < 50
    start = int(mesh.located(np.array([[1.0, 1.0]]))[0])
    waves = propagate(mesh, [start, start], left)
    assert (waves.depth[~left] == -1).all()
    assert (waves.source[left] == 0).all()


@pytest.mark.parametrize("seed", [238, *range(10)])
def test_sides_of_one_length_lead_to_an_end(seed):
    """Rounding makes each of an equilateral lattice's sides the longest for one of its triangles."""
    rng = np.random.default_rng(seed)
    turn, away = rng.uniform(0, 1), rng.uniform(-1, 1, 2)
    steps = np.array([[np.cos(angle), np.sin(angle)] for angle in (turn, turn + np.pi / 3)])
    places = np.array([(i, j) for i in range(-3, 4) for j in range(-3, 4) if abs(i + j) <= 3])
    is_inner = np.maximum(np.abs(places).max(axis=1), np.abs(places.sum(axis=1))) < 3
    lattice = 10 * places @ steps + away
    corners = turn + np.arange(6) * np.pi / 3
    hexagon = Polygon(30 * np.column_stack([np.cos(corners), np.sin(corners)]) + away)
    mesh = Triangulation.of(shapely.segmentize(hexagon, 10.0000001)).with_points(lattice[is_inner])
    finer = refined(mesh, 6.0, 0.0)
    assert finer.side_lengths.max() <= 6.0 * (1 + 1e-9)
