"""Lattices: by the area of the water, not by the box round it."""

import numpy as np
import pytest
import shapely
from shapely import Polygon, affinity, box

from oxbow.geometry.lattice import lattice_within


@pytest.mark.parametrize("turned_deg", [0.0, 17.0, 45.0])
def test_a_lattice_is_that_of_the_box_less_what_lies_outside(turned_deg):
    area = affinity.rotate(box(0, 0, 40, 30).difference(box(10, 5, 20, 22)), turned_deg)
    places = lattice_within(area, (0.3, 0.1), 1.0, 0.5, shift_m=0.5)
    row, column = np.meshgrid(np.arange(-150, 150), np.arange(-80, 80), indexing="ij")
    box_places = np.column_stack([(0.3 + column + row % 2 * 0.5).ravel(), (0.1 + row * 0.5).ravel()])
    inside = box_places[shapely.contains_xy(area, *box_places.T)]
    np.testing.assert_allclose(places, inside, atol=1e-9)


def test_a_vertex_on_a_row_does_not_open_it():
    tooth = Polygon([(0, 0), (1, 2), (2, 0), (3, 2), (4, 0), (4, 3), (0, 3)])
    places = lattice_within(tooth, (0.5, 0.0), 1.0, 1.0)
    assert shapely.dwithin(tooth, shapely.points(places), 1e-9).all()


def test_a_diagonal_canal_costs_its_own_area():
    canal = affinity.rotate(box(0, 0, 50_000, 0.1), 45.0)
    places = lattice_within(canal, canal.exterior.coords[0], 0.5, 0.5)
    assert 0.5 * canal.area <= 0.25 * len(places) <= 2.0 * canal.area
