"""Which water is planned on, and which places it can be reached from."""

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import MultiPolygon, Point, Polygon, box

from oxbow.contracts import ContourRequest, FreeSpace
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.geometry.narrows import is_basin, without_narrows
from oxbow.wire.recording import discard
from oxbow_contour.service import handle

SQUARE = box(0, 0, 100, 100)
WALL = box(40, -1, 42, 101)
STRAIT = [box(40, -1, 42, 48), box(40, 52, 42, 101)]


def space(*places, zones=(), outline=SQUARE, **fields) -> FreeSpace:
    asked = {"safety_m": 4.0, "spacing_m": 10.0} | fields
    return handle(ContourRequest(outline=outline, zones=tuple(zones), places=places, **asked), discard)


@pytest.mark.parametrize(
    ("launch", "east"), [((10.0, 50.0), 40), ((-5.0, 50.0), 40), ((40.5, 50.0), 40), ((41.8, 50.0), 100)]
)
def test_the_water_of_the_launch_is_planned_on(launch, east):
    found = space(launch, zones=[WALL])
    assert found.water.bounds[2] == east
    (other,) = found.dropped
    assert found.water.area + other.area_m2 == pytest.approx(98 * 100)
    assert "not connected" in other.reason


def test_without_a_launch_the_largest_water_is_planned_on():
    assert space(zones=[WALL]).water.bounds[0] == 42


ROUND_A_POCKET = Polygon([(-1, 47), (9, 47), (9, 54), (-1, 54), (-1, 53), (8, 53), (8, 48), (-1, 48)])
TOUCHING = [Polygon([(-1, 46), (8, 50), (8, 46)]), Polygon([(-1, 54), (8, 50), (8, 54)])]


def with_mouth(width_m):
    return list(shapely.get_parts(ROUND_A_POCKET - box(7, 50, 10, 50 + width_m)))


@pytest.mark.parametrize(
    ("place", "zones", "barrier"),
    [
        (
            (6.5, 50.04),
            [ROUND_A_POCKET],
            r"in water of 40 m2 .* `safety_m` = 4 m, .* 2.5 m, leads over 1 m of forbidden zone",
        ),
        ((8.4, 50.0), [ROUND_A_POCKET], r"0.4 m from water of 40 m2 .* 0.6 m, leads over 0.6 m of forbidden zone"),
        ((-1.0, 50.0), [ROUND_A_POCKET], r"1 m from water of 40 m2 .* leads over .* m of land"),
        ((7.0, 50.0), TOUCHING, r"in water of 28 m2 .* leads over a place where land or forbidden zones meet"),
        (
            (6.5, 50.04),
            with_mouth(0.08),
            r"in water of 40 m2 .* leads over 0.89 m of water narrower than `least_width_m` = 0.1",
        ),
        ((5.0, 49.0), with_mouth(0.08), r"in water of 40 m2 .* leads over 1 m of forbidden zone"),
    ],
    ids=["in it", "in its rim", "ashore", "touching zones", "mouth", "beside the mouth"],
)
def test_no_way_leads_from_water_without_room_for_the_safety_distance(place, zones, barrier):
    for places in ((place,), ((60.0, 50.0), place)):
        with pytest.raises(Infeasible, match=rf"places\[{len(places) - 1}\]: lies {barrier}.*; expected a place"):
            space(*places, zones=zones, least_width_m=0.1)


def test_a_pocket_with_a_mouth_wide_enough_is_left_by_it():
    for place in ((4.0, 50.0), (-0.5, 52.0)):
        assert space(place, zones=with_mouth(0.12), least_width_m=0.1).water.area > 9_900


def test_other_seams_do_not_make_a_narrow_mouth_water():
    """They are as many waters as the mouth parts."""
    seam = Polygon([(20, -1), (80, -1), (80, 2), (20, 2)]) - box(25, -2, 75, 0.02)
    with pytest.raises(Infeasible, match=r"narrower than `least_width_m`"):
        space((6.0, 50.04), zones=[*with_mouth(0.08), seam], least_width_m=0.1)


def test_of_waters_that_meet_at_the_place_the_one_with_room_is_planned_on():
    assert space((8.0, 50.0), zones=TOUCHING, least_width_m=0.0).water.area > 9_900


def test_without_room_anywhere_the_safety_distance_is_named():
    with pytest.raises(Infeasible, match=r"safety_m: is 60 m, which leaves no free water"):
        space((4.0, 50.0), zones=[ROUND_A_POCKET], safety_m=60.0)


@pytest.mark.parametrize(
    ("launch", "recovery"),
    [((60.0, 50.0), (10.0, 50.0)), ((60.0, 50.0), (-3.0, 50.0)), ((60.0, 50.0), (38.0, 98.0))],
)
@pytest.mark.parametrize("zones", [[WALL], STRAIT], ids=["wall", "strait"])
def test_a_recovery_that_no_way_leads_to_is_infeasible(launch, recovery, zones):
    with pytest.raises(Infeasible, match=r"places\[1\]"):
        space(launch, recovery, zones=zones)


def test_a_basin_is_looked_for_along_the_water():
    """As the crow flies the planned part is nearer: behind a spit."""
    spit = [box(40, -1, 41, 48), box(40, 52, 41, 101), box(30, 10, 40, 11)]
    with pytest.raises(Infeasible, match=r"places\[0\]: lies by"):
        space((38.0, 60.0), zones=spit)
    assert space((43.0, 60.0), zones=spit).free.bounds[0] > 40


def test_a_place_too_far_from_wide_water_is_refused():
    ditch = SQUARE | box(-60, 50, 0, 50.05)
    with pytest.raises(
        InvalidRequest, match=r"places\[0\]: lies 50 m from water wider than `least_width_m` = 0.1 m"
    ):
        space((-50.0, 50.02), outline=ditch, least_width_m=0.1)
    assert space((-20.0, 50.02), outline=ditch, least_width_m=0.1).water.bounds[0] == pytest.approx(0, abs=0.05)


@pytest.mark.parametrize("safety_m", [0.0, 2.0])
@pytest.mark.parametrize("x", [-2.0, 0.01], ids=["ashore", "in the seam"])
def test_a_place_behind_a_zone_that_leaves_a_seam_is_refused(safety_m, x):
    wall = box(0.02, 20, 10, 80)
    with pytest.raises(InvalidRequest, match=r"places\[0\]: lies .* behind a forbidden zone or other land"):
        space((x, 50.0), zones=[wall], safety_m=safety_m, least_width_m=0.1)
    assert space((x, 19.0), zones=[wall], safety_m=safety_m, least_width_m=0.1).water.area > 9_300


def test_water_that_is_all_narrow_is_infeasible():
    with pytest.raises(Infeasible, match="least_width_m"):
        space(outline=box(0, 0, 100, 0.05), safety_m=0.0, least_width_m=0.1)


@pytest.mark.parametrize("gap_m", [0.0, 1e-10, 1e-5, 1e-3, 0.05])
def test_a_seam_connects_nothing(gap_m):
    zones = [box(40, gap_m, 42, 100 - gap_m)]
    for safety_m in (0.0, 4.0):
        found = space((10.0, 50.0), zones=zones, safety_m=safety_m, least_width_m=0.1)
        assert found.water.bounds[2] <= 40.01


def test_wide_enough_seams_are_water():
    found = space((10.0, 50.0), zones=[box(40, 0.2, 42, 99.8)], safety_m=0.0, least_width_m=0.1)
    assert found.free.area == pytest.approx(9_800, rel=0.02)


def test_narrow_water_is_named_and_the_rest_stays_as_it_is():
    spike = shapely.union_all([SQUARE, Polygon([(100, 50), (300, 50.0005), (100, 50.001)])])
    found = space((10.0, 50.0), outline=spike, safety_m=0.0, least_width_m=0.1)
    assert found.free.bounds[2] < 100.1
    assert any("narrower than `least_width_m` = 0.1 m" in text for text in found.warnings)
    corners = {tuple(xy) for xy in shapely.get_coordinates(found.water)}
    assert {(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)} <= corners


shapes = st.lists(
    st.tuples(st.floats(0, 90), st.floats(0, 90), st.floats(0.01, 40), st.floats(0.01, 40)), min_size=1, max_size=6
)


@given(zones=shapes, width_m=st.sampled_from([0.01, 0.1, 3.0]))
@settings(max_examples=60)
def test_all_that_is_wide_stays_and_nothing_is_added(zones, width_m):
    parts = shapely.get_parts(SQUARE - shapely.union_all([box(x, y, x + w, y + h) for x, y, w, h in zones]))
    water = MultiPolygon([part for part in parts if isinstance(part, Polygon)])
    opened = without_narrows(water, width_m)
    core = water.buffer(-width_m / 2)
    assert opened.is_valid
    assert opened.difference(water).area < 1e-6
    assert core.difference(opened).area < 1e-6
    assert len(opened.geoms) == len(shapely.get_parts(core)) if not core.is_empty else opened.is_empty
    assert without_narrows(opened, width_m).area == pytest.approx(opened.area, abs=0.05 * width_m**2 * len(zones))


def test_water_without_narrows_is_left_as_it_is():
    cross = shapely.union_all([Polygon([(0, 0), (100, 30), (0, 60)]), Polygon([(40, -40), (70, 90), (100, -40)])])
    assert shapely.equals_exact(without_narrows(cross, 0.1).geoms[0], cross, tolerance=0.0)


@pytest.mark.parametrize(("part", "is_one"), [(Point(0, 0).buffer(3.9), False), (box(0, 0, 1, 10), True)])
def test_a_wide_spot_fits_into_a_circle_of_the_safety_distance(part, is_one):
    assert is_basin(part, 4.0, 0.1) is is_one


def test_simplification_closes_no_passage_that_a_place_needs():
    """The harbour is small beside the spacing, so that its loss would be taken for a strip along the shore."""
    harbour = [box(60, 0, 62, 20), box(62, 18, 75, 20), box(75.6, 18, 100, 20)]
    found = space((80.0, 10.0), zones=harbour, safety_m=0.0, spacing_m=200.0)
    assert found.free.covers(Point(80.0, 10.0))
    assert found.free.area > 9_000
