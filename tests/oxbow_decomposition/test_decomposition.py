"""Cells tile the water, and the Reeb graph tells its shape, for any polygon at any heading."""

import math

import msgspec
import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, affinity, box

from oxbow.contracts import CriticalKind, DecomposeRequest, Decomposition
from oxbow.geometry.reeb import cell_polygon, reeb_graph
from oxbow.geometry.sweep import from_sweep, to_sweep
from oxbow.testing import nasty_polygons
from oxbow.wire.recording import Layer, LayerKind, discard
from oxbow_decomposition.cells import decompose
from oxbow_decomposition.headings import predicted_cost, scored_headings
from oxbow_decomposition.service import handle
from tests.support.real_lakes import MISSIONS, needs_missions

quick = settings(max_examples=40)


def ragged(seed: int) -> Polygon:
    rng = np.random.default_rng(seed)
    turn = np.linspace(0, 2 * np.pi, rng.integers(3, 60), endpoint=False)
    radius = rng.uniform(30, 100, len(turn))
    outline = Polygon(np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])).buffer(0)
    holes = [
        affinity.rotate(box(*(c := rng.uniform(-50, 50, 2)), *(c + rng.uniform(1, 20, 2))), rng.uniform(0, 360))
        for _ in range(rng.integers(0, 6))
    ]
    water = outline.difference(shapely.union_all(holes)) if holes else outline
    return max(shapely.get_parts(water), key=lambda part: part.area)


def require_tiling(water: Polygon, decomposition: Decomposition) -> None:
    turned = shapely.transform(water, lambda xy: to_sweep(xy, decomposition.heading_rad))
    polygons = [cell_polygon(cell) for cell in decomposition.cells]
    area = math.fsum(polygon.area for polygon in polygons)
    assert area == pytest.approx(water.area, rel=1e-9)
    union = shapely.union_all([polygon.buffer(0) for polygon in polygons])
    assert union.area == pytest.approx(area, rel=1e-7)
    assert union.symmetric_difference(turned).area <= 1e-7 * water.area
    for cell in decomposition.cells:
        for chain in (cell.floor, cell.ceiling):
            assert (np.diff(chain[:, 0]) >= 0).all()
        assert cell.floor[0, 0] == cell.ceiling[0, 0]
        assert cell.floor[-1, 0] == cell.ceiling[-1, 0]


def require_reeb_graph(water: Polygon, decomposition: Decomposition) -> None:
    graph = reeb_graph(decomposition)
    assert nx.is_connected(nx.Graph(graph))
    cycles = graph.number_of_edges() - graph.number_of_nodes() + 1
    assert cycles == len(water.interiors)
    for node, kind in graph.nodes(data="kind"):
        expected = 1 if kind in (CriticalKind.OPEN, CriticalKind.CLOSE) else 3
        assert graph.degree(node) == expected
    assert all(graph.edges[edge]["cell"] == edge[2] for edge in graph.edges(keys=True))


@quick
@given(seed=st.integers(0, 100_000), heading=st.floats(0, math.pi))
def test_random_polygons_are_tiled(seed, heading):
    water = ragged(seed)
    decomposition = decompose(water, heading)
    require_tiling(water, decomposition)
    require_reeb_graph(water, decomposition)


@quick
@given(seed=st.integers(0, 100_000), heading=st.sampled_from([0.0, math.pi / 2, math.pi / 4]))
def test_coordinates_on_a_grid_share_abscissae(seed, heading):
    rng = np.random.default_rng(seed)
    blocks = [box(*corner, *(corner + rng.integers(1, 6, 2))) for corner in rng.integers(0, 15, (8, 2))]
    water = max(shapely.get_parts(shapely.union_all(blocks)), key=lambda part: part.area)
    require_tiling(water, decompose(water, heading))


@pytest.mark.parametrize("name", sorted(nasty_polygons()))
@pytest.mark.parametrize("heading", [0.0, math.pi / 2, 0.3])
def test_nasty_shapes_are_tiled(name, heading):
    water = nasty_polygons()[name]
    decomposition = decompose(water, heading)
    require_tiling(water, decomposition)
    assert nx.is_connected(nx.Graph(reeb_graph(decomposition)))


def test_a_square_with_an_island_has_one_of_each():
    decomposition = decompose(box(0, 0, 10, 10).difference(Point(5, 5).buffer(2)), 0.1)
    assert sorted(point.kind for point in decomposition.critical_points) == ["close", "merge", "open", "split"]
    assert len(decomposition.cells) == 4


@quick
@given(seed=st.integers(0, 100_000), shift=st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)))
def test_a_moved_polygon_has_the_moved_cells(seed, shift):
    water = ragged(seed)
    here, there = decompose(water, 0.7), decompose(affinity.translate(water, *shift), 0.7)
    assert [point.kind for point in here.critical_points] == [point.kind for point in there.critical_points]
    for one, other in zip(here.critical_points, there.critical_points, strict=True):
        assert np.allclose(np.add(one.place, shift), other.place, atol=1e-6)


def test_the_same_polygon_gives_the_same_cells():
    first, second = decompose(ragged(5), 1.0), decompose(ragged(5), 1.0)
    assert all(
        np.array_equal(one.floor, other.floor) and np.array_equal(one.ceiling, other.ceiling)
        for one, other in zip(first.cells, second.cells, strict=True)
    )


@quick
@given(heading=st.floats(-7, 7), xy=st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)))
def test_the_sweep_frame_is_a_rotation(heading, xy):
    points = np.array([xy])
    turned = to_sweep(points, heading)
    assert np.allclose(from_sweep(turned, heading), points, atol=1e-6)
    assert np.allclose(np.hypot(*turned.T), np.hypot(*points.T))
    along = np.array([[math.sin(heading), math.cos(heading)]])
    assert np.allclose(to_sweep(along, heading), [[0.0, 1.0]])


def test_the_best_heading_runs_across_narrow_water_and_turns_with_it():
    strip = affinity.rotate(box(0, 0, 4000, 500), 20, origin=(0, 0))
    for turn in (0.0, 35.0, 110.0):
        scores = scored_headings(affinity.rotate(strip, turn, origin=(0, 0)), 100.0)
        best = min(scores, key=lambda score: score.predicted_cost).heading_rad
        across = -math.radians(20 + turn)
        assert abs(math.remainder(best - across, math.pi)) < 0.1


def test_shore_along_the_transects_costs_more_than_shore_across():
    steps = np.array([[0.0, 100.0], [0.0, -100.0]])
    assert predicted_cost(steps, 0.0, 10.0, 1e4) > predicted_cost(steps, math.pi / 2, 10.0, 1e4) > 0.1


def test_the_choice_is_recorded_and_shown():
    layers: list[Layer] = []
    water = ragged(8)
    reply = handle(DecomposeRequest(free=water, spacing_m=10.0), layers.append)
    costs = {score.heading_rad: score.predicted_cost for score in reply.scores}
    assert reply.heading_rad == min(costs, key=lambda heading: costs[heading])
    assert {layer.name for layer in layers} == {"cells", "critical_points", "reeb", "scores"}
    graph = next(layer for layer in layers if layer.kind is LayerKind.GRAPH)
    assert len(graph.nodes) == len(reply.critical_points)
    assert len(graph.edges) == len(reply.cells)
    given_heading = handle(DecomposeRequest(free=water, spacing_m=10.0, heading_rad=0.25), discard)
    assert given_heading.heading_rad == 0.25


@needs_missions
@pytest.mark.parametrize("path", MISSIONS, ids=lambda path: path.stem)
def test_real_lakes_are_tiled(path):
    fields = msgspec.json.decode(path.read_bytes())

    def planar(positions):
        degrees = np.array([(place["long"], place["lat"]) for place in positions])
        return Polygon(np.radians(degrees) * 6.371e6 * [math.cos(math.radians(degrees[0, 1])), 1.0])

    water = planar(fields["BoundingBox"]).difference(
        shapely.union_all([planar(zone).buffer(0) for zone in fields.get("ForbiddenZones", ())])
    )
    water = max(shapely.get_parts(water.buffer(-fields["Safety"])), key=lambda part: part.area)
    for heading in (0.0, 1.1):
        decomposition = decompose(water, heading)
        require_tiling(water, decomposition)
        require_reeb_graph(water, decomposition)
