"""Launches and recoveries of every kind: up a creek, ashore, behind an island, in a basin, beside a seam."""

import json

import pytest
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon, box

from oxbow.contracts import Method
from oxbow.errors import Infeasible, InvalidMission
from oxbow.geometry.frame import lonlat
from oxbow.mission.file import Mission, parse_mission
from oxbow.mission.plan import PlanOptions
from oxbow.planning.pipeline import plan_mission
from oxbow.site.site import Site
from oxbow_cli.local import local_call

LAKE = box(0, 0, 60, 40)
CREEK = LAKE | box(-40, 20, 1, 22) | box(-40, 20, -38, 35)
BANK_X = -38.0
SHORE_M = 0.01
AT_ONCE_S = 1e-3
"""So soon an improvement ends as it begins, on any machine."""
MASTERS = [{"Name": name, "Role": "master", "Length": 220.0} for name in "abc"]


def at(x_m, y_m):
    return {"lat": 46.0 + y_m / 111_150.0, "long": 1.0 + x_m / 77_470.0}


def contour(polygon: Polygon):
    return [at(x, y) for x, y in polygon.exterior.coords[:-1]]


def mission(outline: Polygon, launch, *, zones=(), recovery=None, length_m=450.0, **fields) -> Mission:
    given = {
        "MissionType": "map",
        "LaunchPoint": at(*launch),
        "BoundingBox": contour(outline),
        "ForbiddenZones": [contour(zone) for zone in zones],
        "Master_length": length_m,
        "Safety": 3.0,
    }
    if recovery is not None:
        given["RecoveryPoint"] = at(*recovery)
    return parse_mission(json.dumps(given | fields).encode())


def planned(given: Mission, method: Method = Method.TRANSECT, time_limit_s: float | None = AT_ONCE_S) -> Mission:
    return plan_mission(given, PlanOptions(method=method, time_limit_s=time_limit_s), call=local_call())


def water_of(site: Site) -> MultiPolygon:
    return MultiPolygon(shapely.get_parts(site.outline - shapely.union_all(site.zones)).tolist())


def require_sound(completed: Mission) -> list[LineString]:
    """Every path simple, and in the water but for the straight ways from its ends to it."""
    site = Site.of(completed)
    paths = []
    for planned_path, member in zip(completed.planned_paths, site.members, strict=True):
        path = LineString(site.frame.to_planar(lonlat(planned_path.path)))
        water = water_of(site)
        ends = [Point(member.vehicle.start), Point(member.vehicle.recovery)]
        on_land_m = path.difference(water.buffer(SHORE_M)).length
        assert path.is_simple
        assert on_land_m <= shapely.distance(water, ends).sum() + SHORE_M
        paths.append(path)
    return paths


@pytest.mark.parametrize("method", Method)
def test_down_the_creek_by_every_method(method):
    (path,) = require_sound(planned(mission(CREEK, (BANK_X + 0.005, 30.0)), method))
    assert len(path.coords) > 10


@pytest.mark.parametrize("ashore_m", [-0.01, 0.02, 3.0])
def test_from_the_bank_as_from_the_creek(ashore_m):
    require_sound(planned(mission(CREEK, (BANK_X + ashore_m, 30.0))))


@pytest.mark.parametrize(
    ("launch", "recovery"),
    [((-39.0, 36.0), (-20.0, 19.0)), ((-20.0, 23.0), (-39.0, 36.0)), ((-41.0, 30.0), (61.0, 5.0))],
)
def test_launch_and_recovery_up_one_creek_or_either_end(launch, recovery):
    require_sound(planned(mission(CREEK, launch, recovery=recovery)))


def test_a_fleet_out_of_a_creek():
    assert len(require_sound(planned(mission(CREEK, (BANK_X + 0.005, 30.0), Vehicles=MASTERS)))) == 3


@pytest.mark.parametrize("vehicles", [None, MASTERS])
def test_round_the_island_before_the_launch(vehicles):
    island = box(3, 10, 6, 30)
    fields = {} if vehicles is None else {"Vehicles": vehicles}
    for path in require_sound(planned(mission(LAKE, (-2.0, 20.0), zones=[island], **fields))):
        assert len(path.coords) > 10


@pytest.mark.parametrize("safety_m", [0.0, 3.0])
def test_out_of_a_zone_round_the_dock(safety_m):
    dock = Point(20, 20).buffer(5.0, quad_segs=3)
    require_sound(planned(mission(LAKE, (20.0, 20.0), zones=[dock], Safety=safety_m)))


def test_from_the_tip_of_a_spike_and_beyond():
    spike = LAKE | Polygon([(0, 10), (-30, 12), (0, 14)])
    for x_m in (-30.0, -33.0):
        require_sound(planned(mission(spike, (x_m, 12.0))))


def test_farther_ashore_than_the_tolerance_is_refused_with_field_and_distance():
    with pytest.raises(InvalidMission, match=r"LaunchPoint: lies 30 m from the water.*Shore_tolerance = 25 m"):
        planned(mission(LAKE, (-30.0, 20.0)))
    require_sound(planned(mission(LAKE, (-30.0, 20.0), Shore_tolerance=31.0, length_m=520.0)))
    named = [MASTERS[0], MASTERS[1] | {"Recovery": at(30.0, -6.0)}]
    with pytest.raises(InvalidMission, match=r"Vehicles\[1\].Recovery: lies 6 m"):
        planned(mission(LAKE, (10.0, 10.0), Vehicles=named, Shore_tolerance=5.0))


BASINS = LAKE | box(-4, 18, 1, 22) | box(-34, 0, -4, 40)


@pytest.mark.parametrize(
    ("launch", "recovery", "where"),
    [
        ((-20.0, 20.0), None, "LaunchPoint"),
        ((-34.5, 20.0), None, "LaunchPoint"),
        ((-4.5, 20.5), None, "LaunchPoint"),
        ((30.0, 20.0), (-20.0, 41.0), "RecoveryPoint"),
    ],
)
def test_a_basin_that_safety_cuts_off_is_infeasible_from_wherever_in_it(launch, recovery, where):
    with pytest.raises(Infeasible, match=rf"{where}: lies by .* narrower than 6 m, twice Safety,"):
        planned(mission(BASINS, launch, recovery=recovery))


def test_a_fleet_in_a_basin_that_safety_cuts_off_is_infeasible():
    with pytest.raises(Infeasible, match=r"narrower than .* m, twice Safety,"):
        planned(mission(BASINS, (-34.5, 20.0), Vehicles=MASTERS))


def test_a_wide_spot_of_a_creek_is_passed():
    creek = LAKE | box(-30, 18, 1, 22) | box(-20, 16.4, -13, 23.6)
    require_sound(planned(mission(creek, (-30.5, 20.0))))


ROUND_A_POCKET = Polygon([(-1, 16), (5, 16), (5, 24), (-1, 24), (-1, 23), (4, 23), (4, 17), (-1, 17)])
IN_THE_POCKET = (2.5, 20.0)


@pytest.mark.parametrize("method", [Method.TRANSECT, Method.WATERSHED])
@pytest.mark.parametrize(
    ("launch", "where", "fields"),
    [
        (IN_THE_POCKET, "LaunchPoint", {}),
        ((30.0, 20.0), "RecoveryPoint", {"recovery": IN_THE_POCKET}),
        (
            (30.0, 20.0),
            r"Vehicles\[1\]\.Start",
            {"Vehicles": [MASTERS[0], MASTERS[1] | {"Start": at(*IN_THE_POCKET)}]},
        ),
    ],
    ids=["launch", "recovery", "fleet"],
)
def test_a_pocket_that_a_zone_cuts_off_is_infeasible(launch, where, fields, method):
    with pytest.raises(
        Infeasible, match=rf"{where}: lies in water of 24 m2 .* over 1 m of forbidden zone; expected"
    ):
        planned(mission(LAKE, launch, zones=[ROUND_A_POCKET], **fields), method)


POND = LAKE | box(-6, 18, -1, 22) | box(-1.01, 20, 0.01, 20.02)


@pytest.mark.parametrize("place", [(-3.0, 20.01), (-3.0, 21.5), (-0.8, 21.0)], ids=["mouth", "beside", "bank"])
def test_a_pond_beside_the_lake_is_infeasible(place):
    with pytest.raises(Infeasible, match=r"LaunchPoint: lies .* water of 20 m2 that has no room .* leads over"):
        planned(mission(POND, place))
    require_sound(planned(mission(POND, (-0.2, 21.0))))


@pytest.mark.parametrize("method", [Method.SPACE_FILLING_CURVE, Method.TOUR])
def test_out_of_a_pocket_by_its_mouth(method):
    for mouth in (box(3, 19.8, 6, 20.2), box(3, 22, 6, 22.3)):
        zones = shapely.get_parts(ROUND_A_POCKET - mouth).tolist()
        require_sound(planned(mission(LAKE, IN_THE_POCKET, zones=zones), method))


WALL = [box(20, -1, 21, 41)]


def test_the_half_of_the_launch_is_planned_and_the_other_named():
    completed = planned(mission(LAKE, (-1.0, 20.0), zones=WALL, length_m=200.0))
    (path,) = require_sound(completed)
    assert completed.plan is not None
    assert [round(part.area_m2, -2) for part in completed.plan.dropped] == [1600]
    assert any("dropped 1 part, 15" in text for text in completed.plan.warnings)
    assert path.length < 200.0


def test_recovery_in_the_other_half_is_infeasible():
    with pytest.raises(Infeasible, match=r"RecoveryPoint: lies in water of .* not connected"):
        planned(mission(LAKE, (-1.0, 20.0), zones=WALL, recovery=(50.0, 20.0)))


@pytest.mark.parametrize("gap_m", [0.0, 1e-9, 1e-3])
def test_seams_between_zone_and_shore_are_no_water(gap_m):
    zone = box(40, gap_m, 60 - gap_m, 20)
    completed = planned(mission(LAKE, (5.0, 5.0), zones=[zone], Safety=0.0), time_limit_s=None)
    (path,) = require_sound(completed)
    assert path.length >= 0.95 * 450.0
    _, south, east, _ = Site.of(completed).outline.bounds
    assert path.distance(Point(east, south)) > 10.0
    assert completed.plan is not None
    assert gap_m == 0.0 or any("narrower than Least_width" in text for text in completed.plan.warnings)
