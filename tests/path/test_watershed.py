"""Coverage from the border to the core: over all triangles, and by a closed, simple path."""

import math
from functools import partial

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from path_requests import lake, request
from shapely import Polygon, box

from oxbow.contracts import PathRequest
from oxbow.errors import Infeasible, InvalidMission
from oxbow.mesh import Mesh, mesh_area, propagate
from oxbow.recording import Layer
from oxbow.route.gate_routes import Routes
from oxbow.sweep import from_sweep
from oxbow.testing import nasty_polygons
from oxbow_path.conformance import require_conforming
from oxbow_path.task import Display, Task
from oxbow_path.walk.spacing import Budget, Fit
from oxbow_path.walk.trial import Waters
from oxbow_path.watershed import (
    CellPath,
    coverage_depth,
    plan_watershed,
    shortest_path,
    watershed,
    watershed_path,
)
from oxbow_path.watershed.contours import contour_tree

quick = settings(max_examples=6)


def dual(mesh: Mesh) -> nx.Graph:
    return nx.Graph((t, n) for t, row in enumerate(mesh.neighbours.tolist()) for n in row if n >= 0)


def require_steps_to_neighbours(path: CellPath) -> None:
    here, there = path.cells[:-1], path.cells[1:]
    assert (path.mesh.neighbours[here] == there[:, None]).any(axis=1).all()


@quick
@given(seed=st.integers(0, 10_000), start=st.integers(0, 10**6))
def test_the_cell_path_passes_every_triangle_inside_the_water(seed, start):
    water = lake(seed, vertices=60)
    mesh = mesh_area(water, 200.0)
    path = watershed_path(mesh, start % len(mesh))
    assert path.cells[0] == start % len(mesh)
    assert set(path.cells.tolist()) == set(range(len(mesh)))
    assert path.revisits == len(path.cells) - len(mesh)
    require_steps_to_neighbours(path)
    assert water.buffer(1e-6).covers(path.line)


@quick
@given(seed=st.integers(0, 10_000))
def test_depth_is_the_distance_in_steps_from_the_border(seed):
    mesh = mesh_area(lake(seed, vertices=60), 200.0)
    border = set(np.flatnonzero((mesh.neighbours < 0).any(axis=1)).tolist())
    expected = nx.multi_source_dijkstra_path_length(dual(mesh), border)
    assert coverage_depth(mesh).tolist() == [expected[t] for t in range(len(mesh))]


def test_a_share_is_covered_from_its_own_border():
    mesh = mesh_area(box(0, 0, 100, 100), 8.0)
    left = mesh.centroids[:, 0] < 50
    depth = coverage_depth(mesh, left)
    assert (depth[~left] == -1).all()
    beside = (mesh.neighbours >= 0) & ~left[mesh.neighbours]
    assert (depth[left & beside.any(axis=1)] == 0).all()
    path = watershed_path(mesh, int(np.argmax(depth)), left)
    assert set(path.cells.tolist()) == set(np.flatnonzero(left).tolist())
    require_steps_to_neighbours(path)


def test_levels_are_passed_from_the_border_to_the_core():
    mesh = mesh_area(box(0, 0, 100, 100), 8.0)
    depth = coverage_depth(mesh)
    start = int(np.argmin(depth))
    path = watershed_path(mesh, start)
    first_visits = path.cells[np.sort(np.unique(path.cells, return_index=True)[1])]
    on_the_way = depth[first_visits]
    # What the ways between levels pass by is inside of the level at work, at most.
    deepest_so_far = np.maximum.accumulate(on_the_way)
    assert on_the_way[-1] == depth.max()
    assert (np.diff(deepest_so_far) <= 2).all()
    assert np.corrcoef(on_the_way, np.arange(len(on_the_way)))[0, 1] > 0.9


def test_a_start_outside_the_share_is_named():
    mesh = mesh_area(box(0, 0, 100, 100), 20.0)
    own = np.ones(len(mesh), dtype=bool)
    own[3] = False
    with pytest.raises(InvalidMission, match="start: is triangle 3"):
        watershed_path(mesh, 3, own)


def test_a_share_in_two_pieces_is_named():
    mesh = mesh_area(box(0, 0, 300, 20), 15.0)
    ends = np.abs(mesh.centroids[:, 0] - 150) > 100
    with pytest.raises(InvalidMission, match="within: leaves triangle"):
        watershed_path(mesh, int(np.flatnonzero(ends)[0]), ends)


@quick
@given(seed=st.integers(0, 10_000), starts=st.lists(st.integers(0, 10**6), min_size=1, max_size=3))
def test_the_shortest_path_has_the_fewest_steps_of_all(seed, starts):
    mesh = mesh_area(lake(seed, vertices=60), 250.0)
    starts = sorted({start % len(mesh) for start in starts})
    waves = propagate(mesh, starts)
    graph = dual(mesh)
    for goal in range(0, len(mesh), 37):
        path = shortest_path(mesh, waves, goal)
        start = starts[int(waves.source[goal])]
        assert (path.cells[0], path.cells[-1]) == (start, goal)
        require_steps_to_neighbours(path)
        own = graph.subgraph(np.flatnonzero(waves.source == waves.source[goal]).tolist())
        assert len(path.cells) - 1 == nx.shortest_path_length(own, start, goal)
        assert len(path.cells) - 1 == min(nx.shortest_path_length(graph, other, goal) for other in starts)
        assert (waves.branch[path.cells[1:]] == waves.branch[goal]).all()


def test_a_goal_that_no_wave_reached_is_named():
    mesh = mesh_area(box(0, 0, 100, 100), 20.0)
    waves = propagate(mesh, [0], np.arange(len(mesh)) == 0)
    with pytest.raises(InvalidMission, match="goal: is triangle 1"):
        shortest_path(mesh, waves, 1)


def waters_of(asked: PathRequest) -> Waters:
    return Task.of(asked, lambda: False).waters


def planned(asked: PathRequest) -> Fit:
    """A plan whose path was checked in the planar frame."""
    plan = plan_watershed(waters_of(asked), Budget(asked.length_m))
    back = partial(from_sweep, heading_rad=asked.decomposition.heading_rad)
    path = shapely.transform(plan.chosen.path, back)
    require_conforming(path, asked)
    ends = shapely.get_coordinates(path)[[0, -1]]
    assert ends == pytest.approx(np.array([asked.launch, asked.recovery]), abs=1e-6)
    return plan


@settings(quick, max_examples=4)
@given(seed=st.integers(0, 10_000), spacings=st.floats(10, 20), safety=st.sampled_from([0.0, 0.01]))
def test_paths_over_lakes_are_sound_and_use_their_length(seed, spacings, safety):
    asked = request(lake(seed), spacings=spacings, safety=safety)
    plan = planned(asked)
    assert plan.chosen.path.length >= 0.95 * asked.length_m


@pytest.mark.parametrize(
    "name", [name for name in sorted(nasty_polygons()) if "sliver" not in name and "grid" not in name][::3]
)
def test_paths_over_nasty_shapes_are_sound(name):
    planned(request(nasty_polygons()[name], spacings=8.0))


def test_the_refined_path_is_sound_and_shown():
    asked = request(lake(3), spacings=12.0)
    layers: list[Layer] = []
    steps = iter(range(6))
    task = Task.of(asked, lambda: next(steps, None) is None)
    plan = watershed(task, Display(layers.append, asked.decomposition.heading_rad))
    require_conforming(
        shapely.transform(plan.path, partial(from_sweep, heading_rad=asked.decomposition.heading_rad)), asked
    )
    assert plan.path.length >= 0.95 * asked.length_m
    assert {"iterations", "contours", "links", "refined"} <= {layer.name for layer in layers}


def test_launch_and_recovery_apart():
    planned(request(box(0, 0, 1000, 800), launch=(0.0, 100.0), recovery=(1000.0, 700.0)))


def test_a_length_that_is_too_short_is_told():
    with pytest.raises(Infeasible, match="Master_length"):
        planned(request(box(0, 0, 5000, 60), spacings=2, launch=(0.0, 30.0), recovery=(5000.0, 30.0)))


def test_contours_stand_at_equal_depths_and_hang_together():
    water = box(0, 0, 1000, 1000).difference(box(400, 400, 500, 700))
    routes = Routes(water, 20.0)
    tree = contour_tree(water, routes, first_m=30.0, spacing_m=80.0)
    for contour in tree.transects:
        depth = shapely.distance(shapely.points(contour.coords), water.boundary)
        level = np.round((depth.mean() - 30.0) / 80.0)
        assert depth == pytest.approx(30.0 + 80.0 * level, abs=5.0)
    together = shapely.union_all(shapely.buffer([*tree.transects, *tree.links], 1e-6))
    assert isinstance(together, Polygon)
    assert water.covers(together)


def test_basins_behind_a_strait_are_joined():
    water = box(0, 0, 400, 400).union(box(400, 190, 600, 210)).union(box(600, 0, 1000, 400))
    tree = contour_tree(water, Routes(water, 10.0), first_m=30.0, spacing_m=80.0)
    together = shapely.union_all(shapely.buffer([*tree.transects, *tree.links], 1e-6))
    assert isinstance(together, Polygon)
    assert together.bounds[2] - together.bounds[0] > 900


def test_the_core_is_reached():
    """The path runs past every place of a square; the farthest is about half the spacing away."""
    asked = request(box(0, 0, 1000, 1000), spacings=20.0, safety=0.0)
    plan = planned(asked)
    distance = waters_of(asked).probe.distances(plan.chosen.path)
    assert distance.max() <= 1.6 * plan.chosen.pattern.spacing_m / 2 * math.sqrt(1.5)
