"""Triangulations tile what they are made of, and their sides are numbered as they say."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc
from shapely import Polygon, affinity, box

from oxbow.geometry import triangles as module
from oxbow.geometry.triangles import (
    angles_rad,
    apexes,
    cross,
    doubled_areas,
    flipped,
    following,
    side_lengths,
    spread,
    triangulated,
    twins_of,
)
from oxbow.testing import nasty_polygons
from tests.support.path_requests import lake

quick = settings(max_examples=20)


@pytest.mark.parametrize("name", sorted(nasty_polygons()))
@pytest.mark.parametrize("turn_deg", [0.0, 17.3, 45.0])
def test_nasty_shapes_are_tiled_by_triangles_with_a_height(name, turn_deg):
    area = affinity.rotate(nasty_polygons()[name], turn_deg)
    points, triangles = triangulated(shapely.segmentize(area, math.sqrt(area.area) / 4))
    corners = points[triangles]
    assert doubled_areas(corners).sum() / 2 == pytest.approx(area.area)
    assert (doubled_areas(corners) > 1e-14 * side_lengths(corners).max(axis=1)).all()
    assert side_lengths(corners).ravel()[twins_of(triangles) < 0].sum() == pytest.approx(area.length)


@pytest.mark.parametrize("turn_deg", [0.0, 17.3, 45.0])
@pytest.mark.parametrize("bow_m", [-1e-13, 0.0, 1e-13])
def test_straight_banks_of_many_places_are_tiled(turn_deg, bow_m):
    along = np.linspace(0.0, 1000.0, 400)
    bank = np.column_stack([along, bow_m * np.sin(along / 1000.0 * np.pi)])
    island = box(400.0, 4.0, 600.0, 6.0)
    channel = Polygon(np.vstack([bank, bank[::-1] + np.array([0.0, 10.0])])).difference(island)
    channel = affinity.rotate(affinity.translate(channel, 300.0, 200.0), turn_deg)
    points, triangles = triangulated(channel)
    assert doubled_areas(points[triangles]).sum() / 2 == pytest.approx(channel.area)
    assert (doubled_areas(points[triangles]) > 1e-6).all()


@settings(deadline=None, max_examples=100, derandomize=True)
@given(seed=st.integers(0, 10_000), gap_m=st.floats(2e-13, 2e-12))
def test_places_that_are_nearly_one_are_triangulated_in_few_rounds(seed, gap_m):
    area = with_doubled_places(shapely.segmentize(lake(seed, vertices=8, radius_m=100.0), 5.0), seed, gap_m)
    with pytest.MonkeyPatch.context() as patch:
        rounds = []
        patch.setattr(module, "flipped", lambda *sides: rounds.append(sides) or flipped(*sides))
        points, triangles = triangulated(area)
    assert len(rounds) <= 20
    corners = points[triangles]
    assert doubled_areas(corners).sum() / 2 == pytest.approx(area.area)
    flat = doubled_areas(corners) <= 1e-14 * side_lengths(corners).max(axis=1)
    assert (side_lengths(corners[flat]).min(axis=1) < 1e-10).all()


def with_doubled_places(area: Polygon, seed: int, gap_m: float) -> Polygon:
    """The area with a few places of its border followed by up to three more, a gap apart and in line."""
    rng = np.random.default_rng(seed)
    rings = []
    for ring in (area.exterior, *area.interiors):
        places = shapely.get_coordinates(ring)[:-1]
        step = np.roll(places, -1, axis=0) - places
        step *= gap_m / np.hypot(*step.T)[:, None]
        more = np.where(rng.random(len(places)) < 0.2, rng.integers(1, 4, len(places)), 0)
        owner = np.repeat(np.arange(len(places)), 1 + more)
        number = np.arange(len(owner)) - np.searchsorted(owner, owner)
        rings.append(places[owner] + number[:, None] * step[owner])
    return Polygon(rings[0], rings[1:])


@quick
@given(seed=st.integers(0, 10_000))
def test_twins_are_one_side_seen_from_both_its_triangles(seed):
    _, triangles = triangulated(lake(seed, vertices=60))
    twins = twins_of(triangles)
    inner = np.flatnonzero(twins >= 0)
    tails, heads = triangles.ravel(), triangles.ravel()[following(np.arange(triangles.size))]
    assert (twins[twins[inner]] == inner).all()
    assert (tails[twins[inner]] == heads[inner]).all()
    around = np.column_stack([tails, heads, apexes(triangles, np.arange(triangles.size))])
    assert (np.sort(around) == np.sort(triangles).repeat(3, axis=0)).all()


@quick
@given(seed=st.integers(0, 10_000), choice=st.integers(0, 10**6))
def test_a_flip_exchanges_the_diagonals_of_a_quadrilateral(seed, choice):
    points, triangles = triangulated(lake(seed, vertices=60))
    twins = twins_of(triangles)
    inner = np.flatnonzero(twins >= 0)
    side = inner[[choice % len(inner)]]
    other = flipped(triangles, side, twins[side])
    changed = np.flatnonzero((other != triangles).any(axis=1))
    assert set(changed) == {int(side[0]) // 3, int(twins[side[0]]) // 3}
    ends = {*apexes(triangles, side).tolist(), *apexes(triangles, twins[side]).tolist()}
    assert set(other[changed[0]]) & set(other[changed[1]]) == ends
    assert doubled_areas(points[other]).sum() == pytest.approx(doubled_areas(points[triangles]).sum())


@pytest.mark.parametrize("name", sorted(nasty_polygons()))
def test_the_unit_square_is_spread_over_a_region_by_area(name):
    region = nasty_polygons()[name]
    places = spread(qmc.Halton(2, scramble=False).random(4000), region)
    assert shapely.covers(region.buffer(1e-6), shapely.points(places)).all()
    low_x, low_y, high_x, high_y = region.bounds
    for part in (box(low_x, low_y, (low_x + high_x) / 2, high_y), box(low_x, low_y, high_x, (low_y + high_y) / 2)):
        share = shapely.contains_xy(part, places).mean()
        assert share == pytest.approx(part.intersection(region).area / region.area, abs=0.02)


@quick
@given(along=st.floats(0.0, 1.0), across=st.floats(0.0, 1.0))
def test_edges_of_the_unit_square_stay_in_the_region(along, across):
    corners = np.array([(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0), (along, across)])
    region = nasty_polygons()["islands in a grid"]
    assert shapely.dwithin(region, shapely.points(spread(corners, region)), 1e-9).all()


def test_a_triangle_is_measured_by_hand():
    corners = np.array([[(0.0, 0.0), (4.0, 0.0), (0.0, 3.0)]])
    assert doubled_areas(corners).tolist() == [12.0]
    assert side_lengths(corners).tolist() == [[4.0, 5.0, 3.0]]
    assert angles_rad(corners)[0] == pytest.approx([math.pi / 2, math.atan(3 / 4), math.atan(4 / 3)])
    assert cross(np.array([1.0, 0.0]), np.array([0.0, 2.0])) == 2.0
