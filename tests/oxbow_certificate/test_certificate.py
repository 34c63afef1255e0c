"""The certificate: exact cases, bounds that hold, adversarial paths, and agreement with an independent judge."""

import json
import math

import msgspec
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPolygon, Point, Polygon, affinity, box

from oxbow.contracts import Certificate, CertifyRequest, DangerZone, Per, Track
from oxbow.errors import Infeasible
from oxbow.geometry.conformance import crossings_of
from oxbow.mission.file import mission_json, read_mission
from oxbow.mission.plan import PlanOptions
from oxbow.planning.pipeline import plan_mission
from oxbow.testing import nasty_polygons
from oxbow.wire.recording import Layer, discard
from oxbow_certificate.cover import least_radius
from oxbow_certificate.distance import PathDistance
from oxbow_certificate.service import handle
from oxbow_certificate.spread import distance_spread
from oxbow_cli.evaluation import evaluate
from oxbow_cli.local import local_call
from tests.support.real_lakes import mission_file, needs_referee, referee

SQUARE = box(0, 0, 100, 100)
quick = settings(max_examples=8)


def certified(path, outline: Polygon = SQUARE, **changes) -> Certificate:
    line = LineString(path)
    fields = {"launch": line.coords[0], "recovery": line.coords[-1]} | changes
    return handle(CertifyRequest(outline=outline, path=line, **fields), discard)


def test_a_segment_through_the_middle_of_a_square():
    judged = certified([(0, 50), (100, 50)], speed_mps=2.0)
    low, high = judged.cover_radius_m
    assert low <= 50 <= high <= 50.5
    assert judged.q == pytest.approx(high / least_radius(1e4, 100))
    assert judged.mean_distance_m == pytest.approx(25, rel=0.01)
    assert judged.p95_distance_m == pytest.approx(47.5, rel=0.01)
    assert (judged.length_m, judged.duration_s, judged.waypoints) == (100, 50, 2)
    assert judged.is_simple
    assert judged.judged_area == pytest.approx(1)


def test_a_circle_in_an_annulus():
    middle = Point(0, 0).buffer(75, quad_segs=64).exterior
    island = Point(0, 0).buffer(50, quad_segs=64)
    judged = certified(middle, Point(0, 0).buffer(100, quad_segs=64), zones=(island,))
    assert judged.cover_radius_m[0] == pytest.approx(25, rel=0.01)
    assert judged.free_area_m2 == pytest.approx(math.pi * 7500, rel=0.01)


def test_danger_is_one_less_the_chances_of_no_harm():
    lane = DangerZone(name="lane", area=box(40, -5, 60, 105), probability=0.3)
    shallows = DangerZone(name="shallows", area=box(50, 40, 90, 60), probability=0.01, per=Per.METRE)
    zones = {"danger_zones": (lane, shallows)}
    there_and_back = [(0, 30), (100, 30), (100, 50), (0, 50)]
    assert certified(there_and_back, **zones).danger == pytest.approx(1 - 0.7**2 * 0.99**40, abs=1e-6)
    assert certified([(50, 10), (55, 20), (45, 30)], **zones).danger == pytest.approx(0.3), "it starts inside"
    assert certified([(0, 10), (40, 10), (40, 90)], **zones).danger == 0.0, "along the outline"
    assert certified(there_and_back).danger is None


def test_the_least_radius_solves_its_equation():
    radius = least_radius(5000.0, 300.0)
    assert 2 * radius * 300 + math.pi * radius**2 == pytest.approx(5000)


def test_the_worst_gap_is_where_the_path_is_not():
    judged = certified([(0, 10), (100, 10)])
    assert judged.worst_gap is not None
    assert judged.worst_gap[1] == pytest.approx(100, abs=1.5)


walks = st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100)), min_size=2, max_size=12, unique=True)


@quick
@given(walks)
def test_the_bounds_hold_and_are_tight(walk):
    judged = certified(walk)
    grid = np.stack(np.meshgrid(np.linspace(0, 100, 60), np.linspace(0, 100, 60)), axis=-1).reshape(-1, 2)
    seen = shapely.distance(LineString(walk), shapely.points(grid)).max()
    low, high = judged.cover_radius_m
    assert low <= high <= 1.011 * low
    assert seen <= high
    assert judged.q >= 1 - 1e-9


@quick
@given(walks, st.floats(0, 6.28), st.floats(-1e5, 1e5), st.floats(0.1, 50))
def test_turned_moved_and_scaled(walk, angle, shift, scale):
    def changed(geometry):
        turned = affinity.rotate(geometry, angle, origin=(0, 0), use_radians=True)
        return affinity.translate(affinity.scale(turned, scale, scale, origin=(0, 0)), shift, -shift)

    here, there = certified(walk), certified(changed(LineString(walk)), changed(SQUARE))
    assert there.cover_radius_m[0] == pytest.approx(scale * here.cover_radius_m[0], rel=0.011)
    assert there.q == pytest.approx(here.q, rel=0.011)
    assert there.mean_distance_m == pytest.approx(scale * here.mean_distance_m, rel=0.02)


@pytest.mark.parametrize(
    ("path", "crossings"),
    [
        ([(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)], 0),
        ([(0, 0), (10, 10), (10, 0), (0, 10)], 1),
        ([(0, 0), (10, 0), (5, 0)], 1),
        ([(0, 0), (10, 0), (10, 5), (5, 5), (5, -5), (0, -5)], 1),
    ],
    ids=["ring", "eight", "retraced", "hook"],
)
def test_crossings_are_counted(path, crossings):
    assert bool(crossings_of(LineString(path))) == (crossings > 0)
    judged = certified([(40 + x, 40 + y) for x, y in path])
    assert judged.is_simple == (crossings == 0)


def test_repeated_points_are_no_crossing():
    assert certified([(10, 10), (10, 10), (90, 10), (90, 10), (90, 90)]).crossings == 0


def test_the_outside_and_the_unsafe_are_measured():
    zone = box(40, 0, 60, 50)
    judged = certified([(5, 25), (95, 25)], zones=(zone,), safety_m=5.0)
    assert judged.outside_m == pytest.approx(20, abs=0.1)
    assert judged.unsafe_m == pytest.approx(30, abs=0.5)
    assert certified([(10, 70), (90, 70)], zones=(zone,), safety_m=5.0).unsafe_m == 0


def test_legs_from_the_shore_are_excused():
    ring = [(50, 0), (50, 20), (80, 20), (80, 80), (20, 80), (20, 20), (49, 20), (50, 0)]
    judged = certified(ring, safety_m=10.0)
    assert judged.unsafe_m == 0
    assert judged.outside_m == 0


def test_parts_that_the_path_never_enters_are_not_judged():
    judged = certified([(10, 50), (40, 50)], zones=(box(48, -1, 52, 101),), safety_m=1.0)
    assert judged.components == 2
    assert judged.judged_area == pytest.approx(0.5, rel=0.01)


def test_a_path_that_never_enters_the_water_still_gets_a_certificate():
    judged = certified([(200, 200), (300, 200)], launch=(200, 200), recovery=(300, 200))
    assert judged.judged_area == 0
    assert judged.outside_m == pytest.approx(100)
    json.dumps({"q": judged.q}, allow_nan=False)


def test_nothing_left_by_the_safety_distance_is_infeasible():
    with pytest.raises(Infeasible):
        certified([(10, 10), (90, 90)], safety_m=60.0)


def test_the_measures_of_even_rows():
    judged = certified([(x, y) for k, y in enumerate(range(5, 100, 10)) for x in ((5, 95), (95, 5))[k % 2]])
    assert judged.least_leg_distance_m == pytest.approx(10)
    assert judged.turns == 18
    assert judged.directional_evenness is not None
    assert 0 < judged.directional_evenness < 0.15
    assert judged.discrepancy_ratio is not None
    assert judged.discrepancy_ratio < 0.8
    assert judged.p99_ratio is not None
    assert judged.p95_ratio <= judged.p99_ratio <= judged.q


@pytest.mark.parametrize("shape", sorted(nasty_polygons()))
def test_every_figure_of_any_water_is_finite(shape):
    water = nasty_polygons()[shape]
    path = shapely.shortest_line(
        water.point_on_surface(), water.exterior.line_interpolate_point(0.3, normalized=True)
    )
    judged = certified(path.coords, Polygon(water.exterior), zones=tuple(map(Polygon, water.interiors)))
    json.dumps(msgspec.to_builtins(judged), allow_nan=False)
    assert judged.judged_area > 0


def test_every_step_is_shown():
    layers: list[Layer] = []
    line = LineString([(0, 50), (100, 50)])
    handle(CertifyRequest(outline=SQUARE, path=line, launch=(0, 50), recovery=(100, 50)), layers.append)
    assert {layer.name for layer in layers} == {"path", "gaps", "worst_gap", "figures"}


@needs_referee
@pytest.mark.parametrize("name", ["N72.1W106.5", "S04.2E015.4"])
def test_agrees_with_the_independent_judge(name):
    options = PlanOptions(time_limit_s=1e-3)  # no step of refinement: the same path on any machine
    mission = plan_mission(read_mission(mission_file(name)), options, call=local_call())
    judged = referee().judge(json.loads(mission_json(mission)))
    assert mission.plan is not None
    for own in (mission.plan.certificate, evaluate(mission)):
        assert own.crossings == judged["crossings"] == 0
        assert own.outside_m == judged["outside_m"] == 0
        assert own.unsafe_m == pytest.approx(judged["unsafe_m"], abs=0.01)
        for measure in ("length_m", "free_area_m2", "q", "judged_area"):
            assert getattr(own, measure) == pytest.approx(judged[measure], rel=0.01), measure
        # The judge draws its 40 000 places at random: its own figures scatter by 1 % from seed to seed.
        for measure in ("mean_distance_m", "p95_distance_m"):
            assert getattr(own, measure) == pytest.approx(judged[measure], rel=0.03), measure


def test_the_spread_of_distance_is_that_of_many_more_places():
    pond = Polygon([(0, 0), (900, 100), (700, 300), (1000, 900), (400, 600), (100, 1000)])
    region = MultiPolygon([pond.difference(box(300, 300, 400, 350))])
    distance = PathDistance(LineString([(0, 0), (600, 300), (900, 800)]), 100.0)
    few, many = distance_spread(region, distance), distance_spread(region, distance, count=200_000)
    for measure in ("mean_m", "p95_m", "p99_m"):
        assert getattr(few, measure) == pytest.approx(getattr(many, measure), rel=0.005), measure


def rows(heights, west=5.0, east=95.0) -> LineString:
    return LineString([(x, y) for k, y in enumerate(heights) for x in ((west, east), (east, west))[k % 2]])


def track(line: LineString, **changes) -> Track:
    fields = {"launch": line.coords[0], "recovery": line.coords[-1]} | changes
    return Track(path=line, **fields)


def test_the_paths_of_a_team_cover_together_and_keep_the_rules_each_for_itself():
    south, north = rows((10, 20, 30, 40)), rows((60, 70, 80, 90))
    alone = certified(south)
    both = certified(south, others=(track(north, speed_mps=0.5),))
    assert alone.tracks == ()
    assert both.cover_radius_m[1] < alone.cover_radius_m[0] / 2
    assert both.q == pytest.approx(both.cover_radius_m[1] / least_radius(1e4, both.length_m, 2))
    assert [one.length_m for one in both.tracks] == pytest.approx([south.length, north.length])
    assert both.length_m == pytest.approx(south.length + north.length)
    assert both.duration_s == pytest.approx(north.length / 0.5)
    assert both.is_simple


def test_paths_that_meet_are_simple_but_one_outside_is_told():
    crossing = track(LineString([(50, 5), (50, 130)]))
    judged = certified(rows((10, 20, 30, 40)), others=(crossing,))
    assert judged.is_simple
    assert judged.outside_m == pytest.approx(30, abs=0.1)
    assert [one.outside_m for one in judged.tracks] == pytest.approx([0, 30], abs=0.1)


def test_each_vehicles_own_legs_are_excused():
    ashore = LineString([(50, -5), (50, 50)])
    own = certified([(20, 20), (80, 20)], safety_m=5.0, others=(track(ashore),))
    others = certified([(20, 20), (80, 20)], safety_m=5.0, others=(track(ashore, launch=(50, 50)),))
    assert own.unsafe_m == 0
    assert others.unsafe_m == pytest.approx(9.95, abs=0.1)


@given(count=st.integers(1, 6), length_m=st.floats(10, 1e6), area_m2=st.floats(1, 1e9))
@quick
def test_the_least_radius_fills_the_area_with_the_bands_of_all_curves(count, length_m, area_m2):
    radius_m = least_radius(area_m2, length_m, count)
    assert 2 * radius_m * length_m + count * math.pi * radius_m**2 == pytest.approx(area_m2)


def test_hot_spots_are_judged_in_place_of_the_whole_water():
    spots = (box(10, 10, 30, 30), box(60, 60, 90, 90))
    passes = rows((12.5, 17.5, 22.5, 27.5), 12.5, 27.5)
    judged = certified(passes, areas=spots)
    assert judged.free_area_m2 == pytest.approx(400 + 900)
    assert judged.judged_area == pytest.approx(400 / 1300)
    assert judged.cover_radius_m[1] < 4
    with pytest.raises(Infeasible, match="safety_m"):
        certified(passes, safety_m=12.0, areas=(box(0, 0, 9, 9),))
