"""Sight across the water: by arithmetic on the sides about a line, and the same as by the exact predicate."""

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, affinity, box

from oxbow.testing import nasty_polygons
from oxbow_path.tour.sight import Sight

quick = settings(max_examples=60)

numbers = st.integers(0, 9)
points = st.tuples(numbers, numbers)
blocks = st.tuples(points, st.tuples(st.integers(1, 4), st.integers(1, 4))).map(
    lambda block: box(*block[0], block[0][0] + block[1][0], block[0][1] + block[1][1])
)
triangles = st.tuples(points, points, points).map(Polygon).filter(lambda triangle: triangle.area > 0)


@st.composite
def waters(draw) -> Polygon:
    """Water with islands, its corners at whole metres: many are in line, and some rings touch one another."""
    land = shapely.union_all(draw(st.lists(blocks | triangles, max_size=6)))
    parts = shapely.get_parts(shapely.set_precision(box(0, 0, 10, 10).difference(land), 1.0))
    water = max(parts, key=lambda part: part.area, default=Polygon())
    assume(water.geom_type == "Polygon" and water.area > 0)
    return water


def pairs_across(water: Polygon, most: int = 60) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners of the shore, middles of its sides and places inside; all pairs of them; and the lines between."""
    corners = np.unique(shapely.get_coordinates(water), axis=0)
    shore = shapely.get_coordinates(shapely.segmentize(water, shapely.length(water) / 20))
    x0, y0, x1, y1 = water.bounds
    inside = np.random.default_rng(1).uniform((x0, y0), (x1, y1), (12, 2))
    whole = np.stack(np.meshgrid(np.arange(10), np.arange(10)), axis=-1).reshape(-1, 2)
    places = np.unique(np.vstack([corners[: most // 2], inside, shore[:8], whole[::7]]), axis=0)[:most]
    places = places[shapely.covers(water, shapely.points(places))]
    pairs = np.stack(np.triu_indices(len(places), k=1), axis=1)
    return places, pairs, shapely.linestrings(places[pairs])


def seen(water: Polygon, places: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    shapely.prepare(water)
    return Sight(water).along(places, pairs, shapely.linestrings(places[pairs]))


@quick
@given(water=waters(), turn_deg=st.sampled_from([0.0, 0.0, 30.0, 77.0]))
def test_places_see_each_other_where_the_water_covers_the_line_between_them(water, turn_deg):
    water = affinity.rotate(water, turn_deg, origin=(0, 0))
    places, pairs, lines = pairs_across(water)
    assert seen(water, places, pairs).tolist() == shapely.covers(water, lines).tolist()


@pytest.mark.parametrize("name", sorted(nasty_polygons()))
def test_sight_across_nasty_shapes(name):
    water = nasty_polygons()[name]
    places, pairs, lines = pairs_across(water)
    found, expected = seen(water, places, pairs), shapely.covers(water, lines)
    assert not (found & ~expected).any()
    # Petals are 1e-14 m apart, less than coordinates tell: a line out of their middle may be missed.
    missed = np.flatnonzero(expected & ~found)
    assert len(missed) == 0 or (name == "petals" and shapely.dwithin(lines[missed], Point(50, 50), 1e-9).all())


@quick
@given(water=waters(), seed=st.integers(0, 1000))
def test_sight_is_the_same_from_either_end_and_whatever_else_is_asked(water, seed):
    places, pairs, _ = pairs_across(water, most=24)
    together = seen(water, places, pairs)
    order = np.random.default_rng(seed).permutation(len(pairs))[: len(pairs) // 2]
    assert seen(water, places, pairs[order]).tolist() == together[order].tolist()
    assert seen(water, places, pairs[:, ::-1]).tolist() == together.tolist()


ISLETS = box(0, 0, 12, 10).difference(shapely.union_all([box(2, 4, 4, 6), box(6, 4, 8, 6)]))


@pytest.mark.parametrize(
    ("start", "end", "is_seen"),
    [
        ((2, 4), (4, 4), True),  # along a side
        ((2, 4), (8, 4), True),  # along the sides of both islets, past four corners in line
        ((0, 4), (12, 4), True),  # the same from shore to shore
        ((0, 5), (12, 5), False),  # through both
        ((2, 4), (4, 6), False),  # across one, from corner to corner
        ((4, 6), (6, 4), True),  # between them
        ((0, 2), (4, 6), False),  # into a corner and across to the one opposite
        ((0, 2), (2, 4), True),  # to that corner, and no farther
        ((0, 2), (4, 2), True),  # nothing near
        ((0, 0), (12, 0), True),  # all along the outer shore
        ((0, 8), (4, 4), False),  # by a corner, into the islet
        ((0, 8), (2, 6), True),
        ((2, 2), (8, 2), True),
    ],
)
def test_sight_past_corners_in_line(start, end, is_seen):
    places = np.array([start, end], dtype=float)
    assert seen(ISLETS, places, np.array([[0, 1]])).tolist() == [is_seen]


def test_of_no_pairs_none_are_seen():
    assert seen(ISLETS, np.array([[1.0, 1.0]]), np.empty((0, 2), dtype=int)).tolist() == []
