"""Every mission type, for one vehicle and several, from file to plan in one process."""

import json
from itertools import pairwise

import msgspec
import numpy as np
import pytest
import shapely
from shapely import LineString

from oxbow.contracts import ASSIGN, Method, Role, RouteMethod
from oxbow.errors import Infeasible, InvalidMission
from oxbow.geometry.frame import lonlat
from oxbow.mission.file import MissionType, mission_json, parse_mission
from oxbow.mission.plan import PlanOptions
from oxbow.planning.pipeline import expected_calls, plan_mission
from oxbow.site.site import Site
from oxbow_cli.evaluation import evaluate
from oxbow_cli.local import local_call

OPTIONS = PlanOptions(method=Method.TRANSECT, time_limit_s=1e-3)
"""Improvement ends as it begins: how good paths become is not for these tests."""


def at(x_m, y_m):
    return {"lat": 46.0 + y_m / 111_150.0, "long": 1.0 + x_m / 77_470.0}


def contour(*corners):
    return [at(x, y) for x, y in corners]


def spot(west, south, size, value):
    corners = [at(x, y) for x, y in ((0, 0), (size, 0), (size, size), (0, size), (0, 0))]
    ring = [[c["long"] + west / 77_470.0, c["lat"] + south / 111_150.0] for c in corners]
    geometry = {"type": "Polygon", "coordinates": [ring]}
    return {"type": "Feature", "geometry": geometry, "properties": {"value": value}}


WATER = contour((0, 0), (800, 0), (800, 300), (500, 300), (450, 120), (350, 120), (300, 300), (0, 300))
SPOTS = [spot(50, 200, 60, 40.0), spot(700, 200, 50, 50.0), spot(400, 20, 40, 35.0), spot(100, 30, 30, 10.0)]
PRIOR = {"type": "FeatureCollection", "features": SPOTS}


def boats(role, count, **fields):
    return [{"Name": f"{role} {number}", "Role": role} | fields for number in range(count)]


def mission(kind, vehicles=None, prior=PRIOR, **changes):
    fields = {
        "MissionType": kind,
        "LaunchPoint": at(10, 1),
        "BoundingBox": WATER,
        "ForbiddenZones": [contour((600, 100), (650, 100), (650, 150), (600, 150))],
        "Bloom": {"Sensor": "chl", "Value": 30.0},
        "Master_length": 4_000.0,
        "Slave_length": 3_000.0,
        "Safety": 5.0,
        "Swath": 8.0,
        "Vehicles": vehicles,
        "PriorModel": prior,
    }
    return parse_mission(json.dumps(fields | changes).encode())


class Calls:
    """A call of real stages that remembers what was asked and answered."""

    def __init__(self):
        self.stages = []
        self.parts = []
        self.shares = {}
        self.legs_m = {}
        self._call = local_call()

    def __call__(self, endpoint, request, /, *, part=""):
        reply = self._call(endpoint, request)
        self.stages.append(endpoint.stage)
        self.parts.append(part)
        if endpoint is ASSIGN:
            self.shares |= {share.vehicle: share.area for share in reply.shares}
            self.legs_m |= {share.vehicle: share.approach.legs_m for share in reply.shares}
        return reply


def planned(given, options=OPTIONS):
    """The completed mission, after what holds of every plan was checked."""
    calls = Calls()
    completed = plan_mission(given, options, call=calls)
    assert len(calls.stages) == expected_calls(Site.of(given))
    assert parse_mission(mission_json(completed)) == completed
    judged = evaluate(completed)
    for vehicle in judged.vehicles:
        assert vehicle.outside_m == 0
        assert vehicle.unsafe_m <= 0.01
        assert vehicle.length_ratio <= 1
        assert vehicle.starts_at_launch_m == vehicle.ends_at_recovery_m == 0
        assert vehicle.is_simple or vehicle.role is Role.SLAVE
    return completed, calls


def lines(completed):
    frame = Site.of(completed).frame
    return {path.name: LineString(frame.to_planar(lonlat(path.path))) for path in completed.planned_paths}


@pytest.mark.parametrize("kind", ["map", "adap"])
def test_one_master_surveys(kind):
    completed, calls = planned(mission(kind))
    assert calls.stages == ["contour", "decomposition", "path", "certificate"]
    assert set(calls.parts) == {""}
    assert completed.master_path
    assert completed.slave_path is completed.paths is None
    assert completed.plan.fleet is completed.plan.treatment is None
    assert completed.plan.certificate.judged_area == pytest.approx(1.0)


@pytest.mark.parametrize(("rate_m", "is_told"), [(60.0, True), (0.01, False)])
def test_legs_nearer_than_the_least_rate_are_told(rate_m, is_told):
    plan = planned(mission("map", prior=None, Minimal_spatial_rate=rate_m))[0].plan
    assert plan.spacing_m >= rate_m
    assert (plan.certificate.least_leg_distance_m < rate_m) is is_told
    assert any(text.startswith("legs come as near as") for text in plan.warnings) is is_told


@pytest.mark.parametrize("count", [2, 3])
def test_masters_share_the_water_and_keep_to_their_shares(count):
    completed, calls = planned(mission("map", boats("master", count)))
    plan, paths = completed.plan, lines(completed)
    assert completed.master_path is None
    assert list(paths) == [vehicle.name for vehicle in plan.fleet.vehicles] == list(calls.shares)
    asked = zip(calls.stages, calls.parts, strict=True)
    assert [part for stage, part in asked if stage in ("decomposition", "path")] == list(np.repeat(list(paths), 2))
    assert plan.fleet.imbalance <= 0.05
    assert plan.fleet.makespan_s == max(vehicle.duration_s for vehicle in plan.fleet.vehicles)
    assert plan.certificate.q <= 3.2
    assert plan.length_m == pytest.approx(sum(vehicle.length_m for vehicle in plan.fleet.vehicles))
    for name, path in paths.items():
        outside = shapely.get_parts(path.difference(calls.shares[name].buffer(0.01)))
        ends = shapely.MultiPoint([path.coords[0], path.coords[-1]])
        assert all(leg.distance(ends) < 0.1 for leg in outside if leg.length > 0.1)


@pytest.mark.parametrize(("length_m", "is_far"), [(6_000.0, True), (9_000.0, False)])
def test_a_way_to_a_share_that_takes_more_than_a_quarter_of_the_range_is_warned_about(length_m, is_far):
    """Two boats begin at one end of a long narrow lake: one of them passes the other's share, out and home."""
    canal = contour((0, 0), (1500, 0), (1500, 80), (0, 80))
    boats_2 = boats("master", 2, Length=length_m)
    given = mission("map", boats_2, None, BoundingBox=canal, ForbiddenZones=[], LaunchPoint=at(5, 40))
    completed, calls = planned(given)
    near, far = sorted(calls.legs_m, key=calls.legs_m.get)
    outside_m = lines(completed)[far].difference(calls.shares[far].buffer(0.01)).length
    assert calls.legs_m[near] == 0.0
    assert calls.legs_m[far] == pytest.approx(outside_m, rel=0.02)
    assert (outside_m > 0.25 * length_m) is is_far
    warned = [text for text in completed.plan.warnings if "the way to its share" in text]
    percent = round(100.0 * calls.legs_m[far] / length_m)
    expected = f"{far}: the way to its share and home takes {percent}% of its {length_m:.0f} m: start it nearer"
    assert len(warned) == is_far
    assert all(text.startswith(expected) for text in warned)


def test_shares_are_made_of_triangles_of_the_footprint():
    boats_2 = boats("master", 2)
    coarse, fine = (planned(mission("map", boats_2, Footprint=footprint))[1] for footprint in (300.0, 15.0))
    corners = [max(map(shapely.get_num_coordinates, calls.shares.values())) for calls in (coarse, fine)]
    assert corners[1] > 2 * corners[0]
    with pytest.raises(InvalidMission, match=r"Footprint: is 0.01 m; for this water expected 1\.\d+ m or more"):
        plan_mission(mission("map", boats_2, Footprint=0.01), OPTIONS, call=local_call())


def test_shares_are_in_proportion_to_length_whatever_the_speed():
    vehicles = [
        *boats("master", 1, Speed=2.0, Length=6000.0),
        {"Name": "slow", "Role": "master", "Length": 3000.0, "Start": at(790, 290), "Recovery": at(790, 290)},
    ]
    completed, _ = planned(mission("map", vehicles))
    fast, slow = completed.plan.fleet.vehicles
    assert fast.area_m2 == pytest.approx(2.0 * slow.area_m2, rel=0.08)
    assert fast.duration_s == pytest.approx(slow.duration_s, rel=0.05)
    assert completed.plan.fleet.imbalance <= 0.05


def test_a_slave_treats_what_it_can_and_the_rest_is_proposed():
    completed, calls = planned(mission("treat"))
    assert calls.stages == ["contour", "assignment", "certificate"]
    assert completed.slave_path
    assert completed.master_path is None
    treatment = completed.plan.treatment
    assert [each.hot_spot for each in treatment.hot_spots] == ["features[0]", "features[1]", "features[2]"]
    assert all(each.treated_share >= 0.99 for each in treatment.hot_spots)
    assert completed.plan.certificate.cover_radius_m[0] < 8.0
    (slave,) = completed.plan.fleet.vehicles
    assert set(slave.hot_spots) == {each.hot_spot for each in treatment.hot_spots}


def test_every_router_finds_sorties_and_is_the_one_that_is_used():
    given, lengths_m = mission("treat", Slave_length=4_000.0), {}
    for router in RouteMethod:
        completed, _ = planned(given, PlanOptions(router=router))
        treatment = completed.plan.treatment
        assert treatment.router is router
        assert all(each.treated_share >= 0.99 for each in treatment.hot_spots)
        lengths_m[router] = completed.plan.length_m
    shortest_m = lengths_m.pop(RouteMethod.VISIBILITY)
    assert all(length_m > shortest_m + 0.1 for length_m in lengths_m.values())
    assert max(lengths_m, key=lengths_m.get) is RouteMethod.INCENTERS


def test_a_short_range_leaves_hot_spots_to_further_sorties_or_names_them():
    completed, _ = planned(mission("treat", Slave_length=1400.0))
    treatment = completed.plan.treatment
    proposed = {name for sortie in treatment.further for name in sortie.hot_spots}
    left = {each.hot_spot for each in treatment.left}
    untreated = {each.hot_spot for each in treatment.hot_spots if each.treated_share < 0.99}
    assert untreated
    assert untreated <= proposed | left
    for sortie in treatment.further:
        assert sortie.path[0] == sortie.path[-1] == completed.launch
        assert sortie.length_m <= 1400.0


def test_nothing_that_can_be_treated_is_infeasible():
    with pytest.raises(Infeasible, match="features"):
        plan_mission(mission("treat", Slave_length=60.0), OPTIONS, call=local_call())


@pytest.mark.parametrize("smooth", [False, True])
def test_that_a_treatment_is_not_smoothed_is_told(smooth):
    plan = planned(mission("treat"), PlanOptions(smooth=smooth))[0].plan
    assert any("keep their corners" in text for text in plan.warnings) is smooth


@pytest.mark.parametrize("kind", ["map&treat", "adap&treat"])
def test_master_surveys_and_slave_treats(kind):
    completed, calls = planned(mission(kind))
    asked = zip(calls.stages, calls.parts, strict=True)
    assert [part for stage, part in asked if stage == "certificate"] == [Role.MASTER, Role.SLAVE]
    assert completed.master_path
    assert completed.slave_path
    plan = completed.plan
    assert [vehicle.role for vehicle in plan.fleet.vehicles] == [Role.MASTER, Role.SLAVE]
    assert plan.treatment is not None
    assert plan.slave_certificate.free_area_m2 < plan.certificate.free_area_m2 / 10
    assert completed.bloom.value == 30.0


@pytest.mark.parametrize("prior", [None, {"type": "FeatureCollection", "features": [SPOTS[-1]]}])
def test_without_hot_spots_the_slave_surveys_as_far_as_it_goes(prior):
    completed, _ = planned(mission("map&treat", prior=prior))
    plan = completed.plan
    master, slave = plan.fleet.vehicles
    assert plan.treatment is None
    assert slave.length_m <= 3_000.0 < master.length_m
    assert plan.slave_certificate.judged_area == pytest.approx(1.0)
    assert plan.slave_certificate.p95_distance_m > plan.certificate.p95_distance_m


def test_many_of_both_roles():
    fleet = [*boats("slave", 2), *boats("master", 2)]
    completed, _ = planned(mission("adap&treat", fleet))
    assert [path.role for path in completed.paths] == ["master", "master", "slave", "slave"]
    assert completed.plan.length_m == pytest.approx(
        sum(each.length_m for each in completed.plan.fleet.vehicles[:2])
    )


def test_errors_name_the_vehicle():
    vehicles = [*boats("master", 1), {"Name": "far", "Role": "master", "Length": 12.0}]
    with pytest.raises(Infeasible) as caught:
        plan_mission(mission("map", vehicles), OPTIONS, call=local_call())
    assert caught.value.where == "Vehicles[1].Length"
    with pytest.raises(Infeasible) as caught:
        plan_mission(mission("map&treat", prior=None, Slave_length=3.0), OPTIONS, call=local_call())
    assert caught.value.where == "Slave_length"


@pytest.mark.parametrize("kind", MissionType)
def test_the_same_mission_gives_the_same_plan(kind):
    fleet = [*boats("master", 2, Length=900.0), *boats("slave", 1, Length=900.0)]
    given, options = mission(kind, fleet), PlanOptions(method=Method.TRANSECT)
    first, second = (plan_mission(given, options, call=local_call()) for _ in range(2))
    assert mission_json(first) == mission_json(second)


def test_progress_never_runs_backwards():
    from oxbow_cli.planning import PlanningJob, plan_here

    heard = []
    job = PlanningJob(
        mission("map&treat", [*boats("master", 3), *boats("slave", 1)]),
        OPTIONS,
        60.0,
        lambda *step: heard.append(step),
        lambda _mission: None,
    )
    plan_here(job)
    assert all(before < after for (_, before), (_, after) in pairwise(heard))
    assert heard[-1][1] < 1.0


CREEK = contour(
    (0, 0), (800, 0), (800, 100), (912, 100), (912, 250), (900, 250), (900, 112), (800, 112), (800, 300), (0, 300)
)
"""A lake, and a creek too narrow for `Safety` that leads round a corner."""


@pytest.mark.parametrize(
    "given",
    [
        mission("treat", BoundingBox=CREEK, LaunchPoint=at(906, 245), Safety=7.0),
        mission("map", boats("master", 3), None, BoundingBox=CREEK, LaunchPoint=at(906, 245), Safety=7.0),
        mission("map", prior=None, BoundingBox=CREEK, LaunchPoint=at(906, 245), Safety=7.0),
    ],
    ids=["treatment", "fleet", "one boat"],
)
def test_no_leg_out_of_a_creek_leads_over_land(given):
    completed = plan_mission(given, OPTIONS, call=local_call())
    for vehicle in evaluate(completed).vehicles:
        assert vehicle.outside_m <= 0.01
        assert vehicle.length_ratio <= 1
        assert vehicle.starts_at_launch_m == vehicle.ends_at_recovery_m == 0
        assert vehicle.is_simple or vehicle.role is Role.SLAVE
    assert any("lies in narrow water" in text for text in completed.plan.warnings)


BEND = ((400, 100), (512, 100), (512, 200), (700, 200), (700, 212), (500, 212), (500, 112), (400, 112))
BASINS = contour(
    (0, 0), (400, 0), *BEND[:4], (700, 0), (1000, 0), (1000, 300), (700, 300), *BEND[4:], (400, 300), (0, 300)
)
"""Two basins, and a strait 12 m wide between them that leads round two corners."""


@pytest.mark.parametrize("launch", [(10, 1), (506, 150), (499, 112)], ids=["basin", "strait", "bend"])
def test_no_leg_through_a_strait_is_nearer_to_the_shore_than_safety(launch):
    """Shares lie behind narrows and corners, which legs there and home must not cut."""
    given = mission(
        "map",
        boats("master", 3, Length=5_000.0),
        None,
        BoundingBox=BASINS,
        ForbiddenZones=[],
        LaunchPoint=at(*launch),
        Safety=4.0,
        Minimal_spatial_rate=30.0,
    )
    completed, calls = planned(given)
    east = [max(position.long for position in path.path) > at(720, 0)["long"] for path in completed.paths]
    west = [min(position.long for position in path.path) < at(380, 0)["long"] for path in completed.paths]
    assert len(calls.shares) == 3
    assert any(east)
    assert any(west)


def test_danger_zones_are_gone_round_and_the_danger_is_told():
    """The straight way to the east leads through a ferry's lane, which ends 40 m from the northern shore."""
    pond, launch = contour((0, 0), (800, 0), (800, 300), (0, 300)), at(10, 150)
    east = {"type": "FeatureCollection", "features": [spot(700, 140, 30, 40.0)]}
    lane = {"Name": "ferry", "Danger": 0.2, "Contour": contour((300, -5), (340, -5), (340, 260), (300, 260))}
    changes = {"BoundingBox": pond, "LaunchPoint": launch, "ForbiddenZones": [], "DangerZones": [lane]}
    given = mission("map&treat", prior=east, **changes)
    across = msgspec.structs.replace(OPTIONS, heading_rad=np.pi / 2)
    careful, _ = planned(given, across)
    careless, _ = planned(msgspec.structs.replace(given, danger_detour_m=0.0), across)
    around, through = lines(careful)["slave"], lines(careless)["slave"]
    assert careful.plan.slave_certificate.danger == 0.0
    assert careless.plan.slave_certificate.danger == pytest.approx(1.0 - 0.8**2)
    assert through.length < around.length
    assert careful.plan.certificate.danger > 0.3, "surveys cover the lane"
    judged = evaluate(careless)
    assert [vehicle.danger for vehicle in judged.vehicles] == pytest.approx(
        [careless.plan.certificate.danger, 1.0 - 0.8**2]
    )
    plain, _ = planned(msgspec.structs.replace(given, danger_zones=None), across)
    assert (plain.slave_path, plain.master_path) == (careless.slave_path, careless.master_path)
    assert plain.plan.certificate.danger is evaluate(plain).danger is None
