"""Shares tile the mesh, hang together, and are as large as capacities ask for."""

import math

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import ContourRequest
from oxbow.errors import InvalidRequest
from oxbow.mission.file import read_mission
from oxbow.site.site import Site
from oxbow.testing import nasty_polygons
from oxbow.wire.recording import discard
from oxbow_assignment.shares.mesh import Mesh, mesh_area
from oxbow_assignment.shares.partition import (
    BALANCE,
    Partition,
    balanced_partition,
    rebalanced,
    wavefront_partition,
)
from oxbow_contour.service import handle as contour
from tests.support.path_requests import lake
from tests.support.real_lakes import MISSIONS, needs_missions

quick = settings(max_examples=8)

TRIANGLES = 220
"""For each share, about."""


def mesh_for(area: Polygon, vehicles: int) -> Mesh:
    return mesh_area(area, math.sqrt(4 / math.sqrt(3) * area.area / (TRIANGLES * vehicles)))


def require_shares(partition: Partition, area: BaseGeometry) -> None:
    """Every triangle is somebody's, and every share is one simple polygon, reached from its seed."""
    graph = nx.Graph((t, n) for t, row in enumerate(partition.mesh.neighbours.tolist()) for n in row if n >= 0)
    for vehicle, seed in enumerate(partition.seeds):
        own = np.flatnonzero(partition.share == vehicle)
        assert seed in own
        assert partition.depth[seed] == 0
        steps = nx.single_source_shortest_path_length(graph.subgraph(own.tolist()), seed)
        assert partition.depth[own].tolist() == [steps[t] for t in own.tolist()]
    assert sum(region.area for region in partition.regions) == pytest.approx(area.area, rel=1e-9)
    assert all(region.is_valid for region in partition.regions)
    assert partition.borders_m == pytest.approx(partition.borders_m.T)


@quick
@given(
    seed=st.integers(0, 10_000),
    vehicles=st.sampled_from([2, 3, 8]),
    spread=st.floats(1, 10),
    same=st.booleans(),
)
def test_shares_of_lakes_are_balanced(seed, vehicles, spread, same):
    water, rng = lake(seed), np.random.default_rng(seed)
    capacities = rng.uniform(1, spread, vehicles)
    starts = rng.uniform(-1000, 1000, (vehicles, 2))
    places = [tuple(starts[0 if same else v]) for v in range(vehicles)]
    partition = balanced_partition(mesh_for(water, vehicles), places, capacities)
    require_shares(partition, water)
    assert partition.due_m2 == pytest.approx(water.area * capacities / capacities.sum())
    assert partition.areas_m2 == pytest.approx(partition.due_m2, rel=BALANCE)
    assert partition.imbalance <= BALANCE


NASTY = sorted(name for name in nasty_polygons() if "sliver" not in name)


@pytest.mark.parametrize(
    ("name", "vehicles"),
    [*((name, 2 + number % 2) for number, name in enumerate(NASTY)), *((name, 8) for name in NASTY[::5])],
)
def test_shares_of_nasty_shapes_are_balanced(name, vehicles):
    area = nasty_polygons()[name]
    start = area.representative_point().coords[0]
    capacities = np.arange(vehicles) % 3 + 1.0
    partition = balanced_partition(mesh_for(area, vehicles), [start] * vehicles, capacities)
    require_shares(partition, area)
    assert partition.imbalance <= BALANCE


@needs_missions
@pytest.mark.parametrize("path", MISSIONS, ids=lambda path: path.stem)
def test_shares_of_real_lakes_are_balanced(path):
    mission = read_mission(path)
    site = Site.of(mission)
    water = ContourRequest(
        outline=site.outline, zones=site.zones, safety_m=mission.safety_m, spacing_m=site.nominal_spacing_m
    )
    free = contour(water, discard).free
    mesh = mesh_area(free, 2 * site.nominal_spacing_m)
    for vehicles in (2, 3, 8):
        for capacities in (np.ones(vehicles), 1.0 + np.arange(vehicles)):
            partition = balanced_partition(mesh, [site.launch] * vehicles, capacities)
            assert partition.imbalance <= BALANCE
        require_shares(partition, free)


def star() -> Polygon:
    """Three arms, one triangle wide, from one basin: no two of them are half of it."""
    arms = [affinity.rotate(box(-5, -5, 5, 300), turn, origin=(0, 0)) for turn in (0, 120, 240)]
    return shapely.union_all(arms)


@pytest.mark.parametrize("vehicles", [2, 3, 8])
def test_arms_too_narrow_to_be_shared_are_divided(vehicles):
    mesh = mesh_area(star(), 12.0)
    partition = balanced_partition(mesh, [(0.0, 0.0)] * vehicles, None)
    require_shares(partition, star())
    assert partition.imbalance <= BALANCE


def test_a_mesh_too_coarse_for_balance_is_divided():
    mesh = mesh_area(box(0, 0, 100, 100), 60.0)
    partition = balanced_partition(mesh, [(0.0, 0.0)] * 3)
    assert len(partition.mesh) > len(mesh)
    require_shares(partition, box(0, 0, 100, 100))
    assert partition.imbalance <= BALANCE


def test_shares_are_compact():
    """Two shares of a square cannot have a shorter border than its side."""
    partition = balanced_partition(mesh_for(box(0, 0, 100, 100), 2), [(0.0, 0.0), (100.0, 0.0)])
    assert 100 <= partition.border_m <= 160
    assert partition.borders_m[0, 1] == pytest.approx(partition.border_m)


def test_a_strait_is_where_equal_basins_are_parted():
    basins = box(0, 0, 100, 100).union(box(100, 49, 110, 51)).union(box(110, 0, 210, 100))
    partition = balanced_partition(mesh_for(basins, 2), [(0.0, 0.0), (210.0, 0.0)])
    assert partition.border_m < 20


def test_wavefronts_start_where_vehicles_do():
    water = box(0, 0, 300, 100)
    mesh, starts = mesh_for(water, 3), [(10.0, 50.0), (150.0, 50.0), (290.0, 50.0)]
    partition = wavefront_partition(mesh, starts)
    require_shares(partition, water)
    assert partition.seeds == tuple(mesh.located(np.array(starts)).tolist())
    assert partition.imbalance < 0.6


def test_vehicles_that_start_together_are_spread():
    mesh = mesh_for(box(0, 0, 300, 100), 2)
    partition = wavefront_partition(mesh, [(1.0, 50.0)] * 2)
    assert mesh.centroids[partition.seeds[1], 0] > 280
    require_shares(partition, box(0, 0, 300, 100))


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_who_lost_all_within_reach_takes_up_a_share_again(lost):
    """Ranges end where the others are: what one had is out of its reach now, and all it reaches is theirs."""
    water = box(0, 0, 300, 100)
    starts = [(10.0, 50.0), (150.0, 50.0), (290.0, 50.0)]
    before = balanced_partition(mesh_for(water, 3), starts)
    allowed = np.ones((3, len(before.mesh)), dtype=bool)
    allowed[lost] = np.hypot(*(before.mesh.centroids - starts[lost - 1]).T) < 45.0
    assert not (allowed[lost] & (before.share == lost)).any()
    after = rebalanced(before, np.ones(3), allowed)
    require_shares(after, water)
    assert after.areas_m2[lost] > 0.0
    assert allowed[lost][after.share == lost].all()


def test_every_vehicle_has_a_share_of_the_little_that_all_reach():
    water = box(0, 0, 300, 100)
    mesh = mesh_for(water, 4)
    near = mesh.centroids[:, 0] < 40.0
    allowed = np.array([near, near, near, np.ones(len(mesh), dtype=bool)])
    partition = balanced_partition(mesh, [(1.0, 50.0)] * 4, None, allowed)
    require_shares(partition, water)
    assert sorted(set(partition.share.tolist())) == [0, 1, 2, 3]
    for vehicle in range(3):
        assert near[partition.share == vehicle].all()


def test_one_vehicle_gets_all():
    partition = balanced_partition(mesh_for(lake(1), 1), [(0.0, 0.0)])
    assert (partition.share == 0).all()
    assert partition.regions[0].equals(partition.mesh.region(partition.share == 0))
    assert partition.border_m == 0.0


def test_the_same_mesh_gives_the_same_shares():
    mesh = mesh_for(lake(4), 3)
    one, other = (balanced_partition(mesh, [(0.0, 0.0)] * 3) for _ in range(2))
    assert (one.share == other.share).all()


@pytest.mark.parametrize(
    ("starts", "capacities", "message"),
    [
        ([], None, "starts: are 0"),
        ([(0.0, 0.0)] * 2, [1.0], "starts: are 2, with 1 capacities"),
        ([(0.0, 0.0)] * 2, [1.0, 0.0], r"capacities\[1\]: has a capacity of 0.0"),
        ([(0.0, 0.0)] * 2, [math.inf, 1.0], r"capacities\[0\]: has a capacity of inf"),
        ([(0.0, 0.0)] * 10_000, None, "starts: are 10000"),
    ],
)
def test_vehicles_that_cannot_share_are_named(starts, capacities, message):
    mesh = mesh_area(box(0, 0, 100, 100), 20.0)
    for share in (balanced_partition, wavefront_partition):
        with pytest.raises(InvalidRequest, match=message):
            share(mesh, starts, None if capacities is None else np.array(capacities))
