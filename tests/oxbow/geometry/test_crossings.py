"""Edges that meet, found in bounded time and memory."""

import json

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon

from oxbow.errors import InvalidMission
from oxbow.geometry import crossings
from oxbow.geometry.crossings import Edges, TooManyPairs, self_contact
from oxbow.mission.file import parse_mission
from oxbow.mission.prior import PriorFeature
from oxbow.site.site import Site

rings = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=3, max_size=12).map(
    lambda points: np.array(
        [b for a, b in zip([points[-1], *points], points, strict=False) if a != b], dtype=float
    )
)


def found(edges, **options):
    return {tuple(sorted(pair)) for pairs in edges.meetings(**options) for pair in pairs.tolist()}


def meet_inside(one, other):
    """Whether two lines meet elsewhere than at ends that they share, by definition."""
    meeting = one.intersection(other)
    return not meeting.is_empty and any(
        not meeting.difference(line.boundary).is_empty and not one.equals(other) for line in (one, other)
    )


@settings(max_examples=150)
@given(rings.filter(lambda ring: len(ring) > 2), rings.filter(lambda ring: len(ring) > 2))
def test_meetings_are_those_by_definition(ring, other):
    edges = Edges.of(np.array([Polygon(ring), Polygon(other)]))
    lines = [LineString(ends) for ends in edges.ends]
    count = len(lines)
    expected = {(i, j) for i in range(count) for j in range(i + 1, count) if meet_inside(lines[i], lines[j])}
    assert found(edges) == expected
    of_first = edges.ring == 0
    assert found(edges, of=of_first) == {pair for pair in expected if of_first[list(pair)].any()}


@pytest.mark.parametrize("sample", [1, 8, 20, 40])
def test_a_sample_finds_all_meetings_of_its_edges(sample):
    """Forty lines through one place: every two meet."""
    angles = np.linspace(0.0, 3.0, 40)
    ends = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    pairs = found(Edges(np.stack([ends, -ends], axis=1), np.arange(40)), sample=sample)
    assert len(pairs) == sum(39 - looked_up for looked_up in range(sample))


@settings(max_examples=150)
@given(rings.filter(lambda ring: len(ring) > 2))
@pytest.mark.parametrize("most_pairs", [crossings.MOST_PAIRS, 8])
def test_a_ring_has_a_contact_where_it_is_no_valid_polygon(most_pairs, ring):
    polygon = Polygon(ring)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(crossings, "MOST_PAIRS", most_pairs)
        try:
            contact = self_contact(polygon)
        except TooManyPairs:
            return
        assert (contact is None) is crossings.is_valid(polygon) is polygon.is_valid
    if contact is not None:
        near = shapely.dwithin(
            [LineString(ends) for ends in Edges.of(np.array([polygon])).ends], shapely.Point(contact), 1e-9
        )
        assert near.sum() >= 2


def scattered(points, seed=0):
    return np.random.default_rng(seed).random((points, 2))


def comb(teeth, *, across=False):
    """A valid contour of many long thin teeth."""
    y = np.linspace(0.0, 1.0, 2 * teeth)
    outer, inner = np.repeat(y, 2), np.tile([0.1, 1.0, 1.0, 0.1], teeth)
    ring = np.vstack([[[0.0, 0.0]], np.column_stack([inner, outer]), [[0.0, 1.0]]])
    return ring[:, ::-1] + (0.0123, 0.0321) if across else ring


def leaning(teeth):
    """A valid contour of long edges that all lean the same way: their boxes meet though they do not."""
    x = np.arange(teeth) / teeth
    left = np.column_stack([x, np.zeros(teeth)])
    right = np.column_stack([x + 1.0 + 0.5 / teeth, np.ones(teeth)])
    zigzag = np.stack([left, right], axis=1).reshape(-1, 2)
    return np.vstack([zigzag, [[2.1, 0.9], [2.1, -0.1], [0.0, -0.1]]])


def mission(outline, *zones, field="ForbiddenZones"):
    def positions(ring):
        return [{"lat": 46.0 + 0.02 * y, "long": 1.0 + 0.03 * x} for x, y in ring.tolist()]

    given_zones = [positions(zone) for zone in zones]
    if field == "DangerZones":
        given_zones = [{"Contour": zone, "Danger": 0.1} for zone in given_zones]
    launch = {"lat": 46.01, "long": 1.0}
    document = {"MissionType": "map", "LaunchPoint": launch, "BoundingBox": positions(outline), field: given_zones}
    document["Shore_tolerance"] = 1_000.0  # the launch may lie in a zone
    return parse_mission(json.dumps(document).encode())


SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@pytest.mark.parametrize("field", ["ForbiddenZones", "DangerZones"])
@pytest.mark.parametrize(
    ("zones", "where", "says"),
    [
        ([SQUARE / 2, scattered(600)], "[1]", "more than 10000 times"),
        ([scattered(50_000)], "[0]", "more than 10000 times"),
        ([comb(200), comb(200, across=True)], "", "more than 100000 times"),
        ([leaning(30_000)], "", "pairs of them"),
    ],
)
def test_zones_of_more_pieces_than_memory_are_refused(field, zones, where, says):
    with pytest.raises(InvalidMission, match=says) as caught:
        Site.of(mission(SQUARE, *zones, field=field))
    contour = ".Contour" if where and field == "DangerZones" else ""
    assert caught.value.where == f"{field}{where}{contour}"


def test_zones_that_meet_often_enough_are_kept():
    wanders = 0.5 + np.cumsum(np.random.default_rng(1).normal(size=(1_000, 2)), axis=0) / 150
    site = Site.of(mission(SQUARE, wanders, comb(20), comb(20, across=True)))
    assert len(site.warnings) == 1
    assert shapely.is_valid(np.array(site.zones)).all()


def test_an_outline_that_crosses_itself_ten_million_times_is_refused_at_one_of_them():
    with pytest.raises(InvalidMission, match="meets itself at lat") as caught:
        Site.of(mission(scattered(10_000)))
    assert caught.value.where.startswith("BoundingBox[")


def test_an_outline_that_could_not_be_checked_in_time_is_refused():
    with pytest.raises(InvalidMission, match="pairs of them") as caught:
        Site.of(mission(leaning(30_000)))
    assert caught.value.where == "BoundingBox"


def test_contours_have_a_limit_of_points(monkeypatch):
    monkeypatch.setattr("oxbow.site.contours.MOST_POINTS", 7)
    with pytest.raises(InvalidMission, match="8 points with its zones; expected at most 7"):
        Site.of(mission(SQUARE, SQUARE / 2))


@pytest.mark.parametrize(
    ("ring", "says"), [(scattered(10_000), "not a valid Polygon"), (leaning(30_000), "pairs of")]
)
def test_a_prior_model_is_checked_in_bounded_time(ring, says):
    with pytest.raises(InvalidMission, match=says):
        PriorFeature(geometry=Polygon(ring), weight=2.0)


def test_an_island_that_touches_the_shore_of_a_large_prior_is_valid():
    """Within an edge of the shore, of a prior too large to compare all its edges."""
    angle = np.linspace(0.0, np.pi, 9_000)
    arch = np.column_stack([np.cos(angle), np.sin(angle).round(9)])
    touching = Polygon(arch, [[(0.0, 0.0), (0.1, 0.1), (-0.1, 0.1)]])
    assert PriorFeature(geometry=touching, weight=2.0).geometry.is_valid
