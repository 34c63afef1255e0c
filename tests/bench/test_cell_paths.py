"""Paths from triangle to triangle: they pass what they should, from the border to the core."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import box

from oxbow.errors import InvalidRequest
from oxbow_assignment.shares.mesh import Mesh, mesh_area, propagate
from tests.bench.cell_paths import CellPath, coverage_depth, shortest_path, watershed_path
from tests.support.path_requests import lake

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
    with pytest.raises(InvalidRequest, match="start: is triangle 3"):
        watershed_path(mesh, 3, own)


def test_a_share_in_two_pieces_is_named():
    mesh = mesh_area(box(0, 0, 300, 20), 15.0)
    ends = np.abs(mesh.centroids[:, 0] - 150) > 100
    with pytest.raises(InvalidRequest, match="within: leaves triangle"):
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
    with pytest.raises(InvalidRequest, match="goal: is triangle 1"):
        shortest_path(mesh, waves, 1)
