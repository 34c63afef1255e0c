"""Erosion shore by shore, against GEOS's of the whole."""

import numpy as np
import pytest
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon, box

from oxbow.geometry import erosion
from oxbow.geometry.erosion import eroded
from oxbow.testing import nasty_polygons

DEPTHS_M = (0.05, 1.0, 7.0)


def archipelago() -> MultiPolygon:
    """Two lakes of islands apart, close together, that touch one another, and that touch the shore."""
    rng = np.random.default_rng(7)
    places, radii = rng.uniform(5, 195, (70, 2)), rng.uniform(0.5, 6, 70)
    islands = [Point(place).buffer(radius, quad_segs=4) for place, radius in zip(places, radii, strict=True)]
    triangles = [[(0, 50), (5, 48), (5, 52)], [(104, 154), (109, 154), (109, 158)]]
    touching = [box(100, 150, 104, 154), *map(Polygon, triangles)]
    lake = box(0, 0, 200, 200).difference(shapely.union_all([*islands, *touching]))
    islet = LineString([(220, 10), (240, 30)]).buffer(2)
    return MultiPolygon([*shapely.get_parts(lake), box(210, 0, 250, 40).difference(islet)])


@pytest.mark.parametrize("depth_m", DEPTHS_M)
def test_an_archipelago_is_eroded_as_a_whole(depth_m):
    water = archipelago()
    assert water.is_valid
    assert shapely.get_num_interior_rings(shapely.get_parts(water)).sum() > erosion.FEW
    expected = water.buffer(-depth_m)
    found = eroded(water, depth_m)
    assert found.is_valid
    assert found.symmetric_difference(expected).area < 1e-6
    assert len(shapely.get_parts(found)) == len(shapely.get_parts(expected))


@pytest.mark.parametrize("shape", sorted(nasty_polygons()))
def test_any_water_is_eroded_as_a_whole(shape, monkeypatch):
    monkeypatch.setattr(erosion, "FEW", -1)
    water = nasty_polygons()[shape]
    for depth_m in DEPTHS_M:
        assert eroded(water, depth_m).symmetric_difference(water.buffer(-depth_m)).area < 1e-6 * water.area
