"""What holds for every path, whatever the water, the length and the launch point."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, affinity, box

from oxbow.contracts import Method, PathPlan, PathRequest
from oxbow.errors import Infeasible
from oxbow.testing import nasty_polygons
from oxbow.wire.recording import Layer, discard
from oxbow_path.service import handle
from tests.support.path_requests import lake, nasty_request, request, soon_planned

quick = settings(max_examples=8)


def require_sound(plan: PathPlan, asked: PathRequest) -> None:
    """Simple, from launch to recovery, not too long, and outside the free space only for its legs."""
    path = plan.path
    assert path.is_simple
    assert path.coords[0] == pytest.approx(asked.launch, abs=0)
    assert path.coords[-1] == pytest.approx(asked.recovery, abs=0)
    assert path.length <= asked.length_m
    stray = path.difference(asked.space.free.buffer(1e-6))
    ends = [Point(asked.launch), Point(asked.recovery)]
    for part in (line for line in shapely.get_parts(stray) if line.length > 1e-6):
        assert any(shapely.dwithin(part, end, 1e-6) for end in ends)
        assert asked.space.water.buffer(1e-6).covers(part)


def farthest(plan: PathPlan, asked: PathRequest) -> float:
    shore = shapely.get_coordinates(shapely.segmentize(asked.space.free, plan.spacing_m / 4))
    return float(shapely.distance(plan.path, shapely.points(shore)).max())


@quick
@given(seed=st.integers(0, 10_000), spacings=st.floats(10, 18), safety=st.sampled_from([0.0, 0.005, 0.02]))
@pytest.mark.parametrize("method", Method)
def test_out_and_back(method, seed, spacings, safety):
    asked = request(lake(seed), spacings=spacings, safety=safety, method=method, time_limit_s=1.0)
    plan = soon_planned(asked)
    require_sound(plan, asked)
    assert plan.path.length >= 0.95 * asked.length_m
    assert farthest(plan, asked) <= 2.2 * plan.spacing_m


@quick
@given(seed=st.integers(0, 10_000), start=st.integers(0, 149), end=st.integers(0, 149), inside=st.booleans())
@pytest.mark.parametrize("method", Method)
def test_points_apart(method, seed, start, end, inside):
    water = lake(seed)
    corners = [tuple(xy) for xy in shapely.get_coordinates(water.exterior)]
    launch = water.representative_point().coords[0] if inside else corners[start % len(corners)]
    recovery = corners[end % len(corners)]
    asked = request(water, spacings=14, launch=launch, recovery=recovery, method=method, time_limit_s=1.0)
    plan = soon_planned(asked)
    require_sound(plan, asked)
    assert plan.path.length >= 0.95 * asked.length_m


@quick
@given(seed=st.integers(0, 10_000))
def test_launch_inside_the_water(seed):
    water = lake(seed)
    asked = request(water, launch=water.representative_point().coords[0], time_limit_s=1.0)
    require_sound(soon_planned(asked), asked)


@pytest.mark.parametrize("name", sorted(nasty_polygons()))
@pytest.mark.parametrize("spacings", [3.0, 7.0])
@pytest.mark.parametrize("method", Method)
def test_nasty_shapes(name, spacings, method):
    asked = nasty_request(name, spacings, method=method, time_limit_s=1.0)
    if asked is not None:
        require_sound(soon_planned(asked), asked)


@pytest.mark.parametrize("where", ["same", "apart", "inside"])
@pytest.mark.parametrize("spacings", [2.0, 8.0, 30.0])
@pytest.mark.parametrize(
    "water",
    [
        Polygon([(0, 0), (1000, 0), (0, 1000)]),
        box(0, 0, 3000, 60),
        shapely.union_all([box(0, 0, 1000, 100)] + [box(100 * k, 0, 100 * k + 50, 800) for k in range(10)]),
        box(0, 0, 1000, 1000).difference(shapely.union_all([box(300, 300, 500, 500), box(500, 500, 700, 700)])),
    ],
    ids=["triangle", "strip", "comb", "corner-touching-islands"],
)
def test_short_and_long_paths(water, spacings, where):
    corners = [tuple(xy) for xy in shapely.get_coordinates(water.exterior)]
    launch = water.representative_point().coords[0] if where == "inside" else corners[1]
    recovery = launch if where == "same" else corners[len(corners) // 2]
    asked = request(water, spacings=spacings, launch=launch, recovery=recovery, time_limit_s=1.0)
    try:
        plan = soon_planned(asked)
    except Infeasible as error:
        assert f"is {asked.length_m:.10g} m" in str(error)
        assert where != "same"
        assert spacings == 2.0
    else:
        require_sound(plan, asked)


def test_the_same_request_gives_the_same_path():
    asked = request(lake(7))
    assert handle(asked, discard).path == handle(asked, discard).path


def test_a_turned_and_moved_site_gives_the_turned_and_moved_path():
    water, turn = lake(3), 0.7
    moved = affinity.translate(affinity.rotate(water, -turn, origin=(0, 0), use_radians=True), 5e4, -2e4)
    here = handle(request(water, heading_rad=0.4), discard)
    there = handle(request(moved, heading_rad=0.4 + turn), discard)
    assert there.spacing_m == pytest.approx(here.spacing_m, rel=0.1)
    assert there.path.length == pytest.approx(here.path.length, rel=0.02)


def test_least_spacing_binds_and_is_told():
    water = lake(2)
    asked = request(water, spacings=20, min_spacing_m=2.5 * np.sqrt(water.area) / 20)
    plan = handle(asked, discard)
    require_sound(plan, asked)
    assert plan.spacing_m == pytest.approx(asked.min_spacing_m)
    assert plan.path.length < 0.95 * asked.length_m
    assert any("min_spacing_m" in warning for warning in plan.warnings)


def test_a_length_that_small_water_cannot_use_is_told(monkeypatch):
    monkeypatch.setattr("oxbow_path.task.FINEST", 25)
    water = box(0, 0, 30, 20)
    asked = request(water, spacings=5000)
    plan = handle(asked, discard)
    require_sound(plan, asked)
    assert plan.spacing_m == pytest.approx(np.sqrt(asked.space.free.area) / 25)
    assert any("no spacing below" in warning for warning in plan.warnings)


def test_a_launch_point_ashore_is_reached_straight_over_land():
    water = box(0, 0, 1000, 800)
    plan = handle(request(water, launch=(-50.0, 400.0)), discard)
    assert plan.path.coords[0] == plan.path.coords[-1] == (-50.0, 400.0)
    assert plan.path.coords[1] == pytest.approx((0.0, 400.0), abs=0.01)
    assert plan.path.difference(water).length == pytest.approx(100.0, abs=0.01)


def test_a_launch_point_in_water_that_is_left_out_is_refused():
    basins = shapely.union_all([box(0, 0, 1000, 1000), box(1000, 495, 1100, 505), box(1100, 300, 1500, 700)])
    with pytest.raises(Infeasible, match="launch"):
        handle(request(basins, safety=0.02, launch=(1300.0, 500.0)), discard)


def test_recovery_beyond_reach_is_refused_with_the_length():
    strip = box(0, 0, 5000, 60)
    with pytest.raises(Infeasible, match="length_m"):
        handle(request(strip, spacings=2, launch=(0.0, 30.0), recovery=(5000.0, 30.0)), discard)


def test_what_is_dropped_is_farther_than_reach():
    arm = shapely.union_all([box(0, 0, 1000, 1000), box(1000, 495, 1700, 505)])
    asked = request(arm, spacings=10, safety=0.0)
    plan = handle(asked, discard)
    require_sound(plan, asked)
    for part in plan.dropped:
        assert part.area_m2 == pytest.approx(part.outline.area)
        assert part.outline.distance(plan.path) > 0.45 * plan.spacing_m
        assert "m from the path" in part.reason


def test_every_step_is_shown():
    layers: list[Layer] = []
    asked = request(lake(1))
    plan = handle(asked, layers.append)
    by_name = {layer.name: layer for layer in layers}
    assert {"iterations", "loop", "transects", "circuit", "path"} <= by_name.keys()
    assert len([layer for layer in layers if layer.name == "iterations"]) == len(plan.steps)
    assert isinstance(by_name["path"].geometries[0], LineString)
    assert by_name["path"].geometries[0].hausdorff_distance(plan.path) < 1e-6


@pytest.mark.parametrize("method", Method)
def test_a_time_limit_gives_a_sound_path_sooner(method):
    asked = request(lake(4), spacings=25, method=method, time_limit_s=0.001)
    layers: list[Layer] = []
    plan = handle(asked, layers.append)
    require_sound(plan, asked)
    assert sum(layer.name == "refinement" for layer in layers) < 10
    assert plan.path.length >= 0.95 * asked.length_m or "ended after 0.001 s" in " ".join(plan.warnings)
