"""Courses: any length from the shortest way on, and loops round islands."""

import math

import numpy as np
import pytest
import shapely
from shapely import LineString, Point, affinity, box

from oxbow.contracts import Method, PathPlan, PathRequest
from oxbow.errors import Infeasible
from oxbow.geometry.route.mesh import WaterMesh
from oxbow.wire.recording import discard
from oxbow_path.course import best_plan
from oxbow_path.course.loops import Middles
from oxbow_path.service import handle
from oxbow_path.task import FINEST, FINEST_ALONG, Display, MethodPlan, Task, finest_spacing_m
from oxbow_path.walk.legs import is_plainly_simple
from oxbow_path.walk.probe import Probe
from tests.support.path_requests import lake, request, soon_planned


def require_sound(plan: PathPlan, asked: PathRequest, least_share: float = 0.95) -> None:
    """Simple, inside, from launch to recovery, and as long as may be; what it leaves far away is named."""
    path = plan.path
    assert path.is_simple
    assert (path.coords[0], path.coords[-1]) == (asked.launch, asked.recovery)
    assert least_share * asked.length_m <= path.length <= asked.length_m
    assert path.difference(asked.space.free.buffer(1e-6)).length <= 1e-6
    named = shapely.union_all([part.outline for part in plan.dropped])
    unseen = asked.space.free.difference(path.buffer(2 * plan.spacing_m)).difference(named.buffer(1e-6))
    assert unseen.area <= 0.1 * (2 * plan.spacing_m) ** 2


def farthest_m(plan: PathPlan, asked: PathRequest) -> float:
    return float(Probe.over(asked.space.free, plan.spacing_m / 4).distances(plan.path).max())


@pytest.mark.parametrize(("method", "share"), [(Method.TRANSECT, 1.02), (Method.SPACE_FILLING_CURVE, 1.6)])
def test_one_way_through_a_canal(method, share):
    canal = affinity.rotate(box(0, 0, 1000, 20), 30.0, origin=(0, 0))
    (launch, recovery) = shapely.get_coordinates(affinity.rotate(LineString([(10, 10), (990, 10)]), 30, (0, 0)))
    asked = request(
        canal,
        spacings=share * 980 / np.sqrt(canal.area),
        launch=tuple(launch),
        recovery=tuple(recovery),
        method=method,
    )
    plan = handle(asked, discard)
    require_sound(plan, asked)
    assert farthest_m(plan, asked) <= 16.0


def test_a_way_that_is_too_long_is_told_as_long_as_it_is():
    canal = box(0, 0, 1000, 20)
    asked = request(canal, spacings=6.5, launch=(10, 10), recovery=(990, 10))
    with pytest.raises(Infeasible, match=r"the shortest path from launch to recovery is 9[78]\d\.\d m"):
        handle(asked, discard)


@pytest.mark.parametrize("method", [Method.TRANSECT, Method.SPACE_FILLING_CURVE])
def test_a_short_trip_from_home_on_a_large_lake(method):
    water = box(0, 0, 4000, 3000)
    asked = request(water, spacings=0.3, safety=0.001, launch=(10, 10), method=method)
    plan = handle(asked, discard)
    require_sound(plan, asked)
    assert plan.dropped


@pytest.mark.parametrize(("method", "laps"), [(Method.TRANSECT, 1.1), (Method.SPACE_FILLING_CURVE, 1.6)])
def test_once_round_a_moat_closes(method, laps):
    moat = box(0, 0, 300, 200).difference(box(12, 12, 288, 188))
    round_m = 2 * (288 + 188)
    asked = request(
        moat, spacings=laps * round_m / np.sqrt(moat.area), safety=0.02, launch=(6, 100), method=method
    )
    plan = handle(asked, discard)
    require_sound(plan, asked)
    assert farthest_m(plan, asked) <= 9.0


@pytest.mark.parametrize(
    ("laps", "method"), [(0.8, Method.TRANSECT), (1.2, Method.WATERSHED), (1.6, Method.TRANSECT)]
)
def test_one_way_round_a_moat_uses_its_length(laps, method):
    moat = box(0, 0, 300, 200).difference(box(12, 12, 288, 188))
    asked = request(
        moat,
        spacings=laps * 952 / np.sqrt(moat.area),
        safety=0.02,
        launch=(6, 100),
        recovery=(294, 100),
        method=method,
    )
    plan = handle(asked, discard)
    require_sound(plan, asked)
    # Half the moat is passed once; the other half costs twice its length, from either end.
    left = asked.space.free.difference(plan.path.buffer(12.0)).area / asked.space.free.area
    assert left <= max(0.0, (1.5 - laps) / 2) + 0.05


def test_half_a_moat_is_named():
    moat = box(0, 0, 300, 200).difference(box(12, 12, 288, 188))
    asked = request(moat, spacings=0.5 * 952 / np.sqrt(moat.area), safety=0.02, launch=(6, 100))
    plan = handle(asked, discard)
    require_sound(plan, asked)
    assert (dropped_m2 := sum(part.area_m2 for part in plan.dropped)) >= 0.3 * asked.space.free.area
    (left_out,) = [text for text in plan.warnings if "is left out" in text]
    assert left_out.startswith(
        f"{dropped_m2 / asked.space.free.area:.1%} of its water is left out, most of it farther"
    )


def test_a_loop_round_a_chain_of_islands_holds_them_all():
    islands = [box(x, 10, x + 80, 90) for x in (10, 100, 190)]
    water = box(0, 0, 280, 100).difference(shapely.union_all(islands))
    loops = list(Middles.of(WaterMesh.of(water, detail_m=5.0)).loops(10.0, 1e4))
    assert all(shapely.Polygon(loops[-1]).contains(island) for island in islands)
    assert loops[-1].length == pytest.approx(2 * (270 + 90), rel=0.05)
    assert not list(Middles.of(WaterMesh.of(water, detail_m=5.0)).loops(2.0, 1e4))
    assert not list(Middles.of(WaterMesh.of(water, detail_m=5.0)).loops(10.0, 100.0))


def test_the_ends_of_long_arms_are_reached_where_length_is_plentiful():
    ray = shapely.Polygon([(0, -8), (300, 0), (0, 8)])
    arms = shapely.union_all([affinity.rotate(ray, 60.0 * turn, origin=(0, 0)) for turn in range(6)])
    asked = request(
        arms, spacings=60.0, min_spacing_m=4.0, safety=0.005, launch=(0, 0), method=Method.SPACE_FILLING_CURVE
    )
    plan = handle(asked, discard)
    require_sound(plan, asked, least_share=0.3)
    assert farthest_m(plan, asked) <= 4.4


def test_a_ragged_lake_one_way_at_any_length():
    water = lake(3)
    west, east = (Point(xy) for xy in ((-400, 0), (400, 0)))
    ends = [shapely.get_coordinates(shapely.shortest_line(water.buffer(-30), end))[0] for end in (west, east)]
    for share in (1.1, 2.0):
        spacings = share * 800 / np.sqrt(water.area)
        asked = request(water, spacings=spacings, launch=tuple(ends[0]), recovery=tuple(ends[1]))
        require_sound(handle(asked, discard), asked)


def test_the_finest_spacing_of_arms_follows_their_shore():
    arms = shapely.union_all([affinity.rotate(box(-500, -1, 500, 1), 20.0 * turn) for turn in range(9)])
    asked = request(arms, spacings=500.0, safety=0.0)
    assert finest_spacing_m(asked.space) == pytest.approx(arms.length / FINEST_ALONG, rel=0.05)
    assert finest_spacing_m(asked.space) > np.sqrt(arms.area) / FINEST


@pytest.mark.parametrize("method", list(Method))
def test_water_narrower_than_the_least_spacing_is_walked_once_round(method):
    canal = affinity.rotate(box(0, 0, 500, 0.08), 20.0, origin=(0, 0))
    home = shapely.get_coordinates(affinity.rotate(Point(2, 0.04), 20.0, origin=(0, 0)))[0]
    asked = request(canal, spacings=2000 / np.sqrt(canal.area), safety=0.0, launch=tuple(home), method=method)
    plan = handle(asked, discard)
    require_sound(plan, asked, least_share=0.45)
    assert farthest_m(plan, asked) <= 0.1
    assert len(plan.path.coords) <= 1000


def test_the_method_is_asked_first_but_in_narrow_water():
    def unasked(*_: object) -> MethodPlan:
        raise AssertionError("the method was asked")

    display = Display(discard, 0.0)
    canal = box(0, 0, 1000, 20)
    for length_m, is_asked in ((1500, False), (3500, True)):
        spacings = length_m / np.sqrt(canal.area)
        asked = request(canal, spacings=spacings, safety=0.001, launch=(10, 10), recovery=(990, 10))
        task = Task.of(asked, lambda: False)
        if is_asked:
            with pytest.raises(AssertionError, match="was asked"):
                best_plan(unasked, task, display)
        else:
            assert best_plan(unasked, task, display).path.length >= 0.95 * asked.length_m


@pytest.mark.parametrize(
    ("length_m", "launch", "recovery"),
    [(1200.0, (-120.0, 0.0), (40.0, 0.0)), (1810.0, (0.0, 120.0), (0.0, -40.0))],
)
def test_length_that_a_method_leaves_is_spent_on_what_it_leaves_away(length_m, launch, recovery):
    """Canals in rings, one in the other: the first path takes the outer one, and half the length."""
    rings = [Point(0, 0).buffer(r + 2.5).difference(Point(0, 0).buffer(r - 2.5)) for r in (40.0, 80.0, 120.0)]
    water = shapely.union_all([*rings, box(-121, -2.5, -38, 2.5), box(38, -2.5, 121, 2.5)])
    asked = request(
        water,
        spacings=length_m / math.sqrt(water.area),
        safety=1 / math.sqrt(water.area),
        launch=launch,
        recovery=recovery,
        method=Method.SPACE_FILLING_CURVE,
        time_limit_s=1.0,
    )
    require_sound(soon_planned(asked), asked, least_share=0.9)


def test_detours_in_a_bent_canal_keep_off_the_path_that_runs_along_its_rim():
    """Strips of detours end at the rim of the free space, and so do those before them."""
    line = LineString([(0, 0), (150, 20), (60, 110)])
    canal = line.buffer(5.0, cap_style="flat", join_style="mitre")
    scale_m = math.sqrt(canal.area)
    asked = request(
        canal,
        spacings=2.1 * line.length / scale_m,
        safety=4.8 / scale_m,
        launch=(1.0, 0.2),
        recovery=(61.0, 109.0),
        time_limit_s=1.0,
    )
    plan = soon_planned(asked)
    assert 0.9 * asked.length_m <= plan.path.length <= asked.length_m
    assert is_plainly_simple(plan.path)


def test_the_shortest_way_is_a_plan_whatever_the_method_finds():
    """From an islet to the shore, with less length than a walk round the water's edge takes."""
    islet = Point(500, 400).buffer(25, quad_segs=3)
    water = box(0, 0, 1000, 800).difference(islet)
    asked = request(water, launch=islet.exterior.coords[1], recovery=(700.0, 0.0), spacings=2.0, safety=0.0)
    plan = handle(asked, discard)
    assert plan.path.length <= asked.length_m
