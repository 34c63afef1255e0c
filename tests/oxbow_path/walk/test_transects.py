"""Transects, the circuit that joins them, and the pattern they make."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString

from oxbow.geometry.reeb import cell_polygon
from oxbow_path.task import prepared_waters
from oxbow_path.walk.circuit import plan_circuit
from oxbow_path.walk.pattern import try_transects
from oxbow_path.walk.transects import place_transects
from oxbow_path.walk.trial import Pattern
from tests.support.path_requests import lake, request

quick = settings(max_examples=12)


@quick
@given(seed=st.integers(0, 10_000), phase=st.floats(0, 1), pitch=st.floats(50, 400))
def test_transects_stand_on_lines_a_pitch_apart_and_cross_their_cells(seed, phase, pitch):
    cells = request(lake(seed)).decomposition.cells
    transects = place_transects(cells, pitch, phase=phase, min_length_m=pitch / 2)
    for transect in transects:
        assert transect.length_m > pitch / 2
        line = LineString([(transect.u, transect.low), (transect.u, transect.high)])
        assert cell_polygon(cells[transect.cell]).buffer(1e-6).covers(line)
    us = np.unique([transect.u for transect in transects])
    lines = (us - us[0]) / pitch if len(us) else us
    assert np.allclose(lines, np.round(lines), atol=1e-6)


@quick
@given(seed=st.integers(0, 10_000), spacing=st.floats(40, 250))
def test_the_circuit_is_connected_and_inside(seed, spacing):
    asked = request(lake(seed), safety=0.005)
    cells = asked.decomposition.cells
    transects = place_transects(cells, 2 * spacing, phase=0.3, min_length_m=spacing)
    circuit = plan_circuit(cells, transects, trim_m=spacing / 5, inset_m=spacing / 2)
    lines = [*circuit.transects, *circuit.links]
    water = shapely.union_all([cell_polygon(cell) for cell in cells]).buffer(1e-6)
    assert all(water.covers(line) for line in lines)
    if lines:
        assert shapely.union_all(shapely.buffer(lines, 1e-6)).geom_type == "Polygon"


def test_a_circuit_without_transects_is_empty():
    cells = request(lake(1)).decomposition.cells
    circuit = plan_circuit(cells, (), trim_m=1.0, inset_m=1.0)
    assert circuit.transects == circuit.links == ()


def test_a_pattern_is_built_the_same_whatever_was_built_before():
    waters = prepared_waters(request(lake(6)), 70.0)
    first = try_transects(waters, Pattern(90.0, 1.5, 0.25))
    try_transects(waters, Pattern(140.0, 1.3, 0.75))
    assert try_transects(waters, Pattern(90.0, 1.5, 0.25)).path == first.path
