"""Vehicles, swaths and hot spots in a Mission File: what is accepted, what is refused and how it says so."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oxbow.contracts import Role
from oxbow.errors import InvalidMission
from oxbow.mission.file import MissionType, mission_json, parse_mission
from oxbow.site.site import Site

TYPES = [kind.value for kind in MissionType]


def at(lat, long):
    return {"lat": lat, "long": long}


SQUARE = [at(46.0, 1.0), at(46.0, 1.02), at(46.02, 1.02), at(46.02, 1.0)]
ISLAND = [at(46.004, 1.004), at(46.004, 1.008), at(46.008, 1.008), at(46.008, 1.004)]
BLOOM = {"Sensor": "chl", "Value": 30.0}


def spot(west, south, size=0.002, value=40.0, **properties):
    east, north = west + size, south + size
    ring = [[west, south], [east, south], [east, north], [west, north], [west, south]]
    geometry = {"type": "Polygon", "coordinates": [ring]}
    return {"type": "Feature", "geometry": geometry, "properties": {"value": value} | properties}


def points(*places, value=40.0):
    geometry = {"type": "MultiPoint", "coordinates": list(places)}
    return {"type": "Feature", "geometry": geometry, "properties": {"value": value}}


def prior(*features):
    return {"type": "FeatureCollection", "features": list(features)}


def parsed(kind="treat", **changes):
    fields = {"MissionType": kind, "LaunchPoint": at(46.0, 1.0), "BoundingBox": SQUARE, "Bloom": BLOOM}
    return parse_mission(json.dumps(fields | changes).encode())


def site(kind="treat", **changes):
    return Site.of(parsed(kind, **{"Swath": 10.0, "PriorModel": prior(spot(1.012, 46.012))} | changes))


def boat(name="a", role="slave", **fields):
    return {"Name": name, "Role": role} | fields


@pytest.mark.parametrize("kind", TYPES)
def test_without_vehicles_there_is_one_of_each_role_with_the_reports_fields(kind):
    fleet = {
        (vehicle.role, vehicle.name, vehicle.speed_mps, vehicle.length_m)
        for vehicle in (member.vehicle for member in site(kind).members)
    }
    of_role = {
        Role.MASTER: (Role.MASTER, "master", 1.0, 20_000.0),
        Role.SLAVE: (Role.SLAVE, "slave", 0.5, 15_000.0),
    }
    assert fleet == {of_role[role] for role in MissionType(kind).roles}


def test_what_a_vehicle_leaves_out_is_the_missions():
    boats = [boat("far", "master", Length=500.0, Start=at(46.001, 1.001)), boat("near", "master", Speed=3.0)]
    far, near = site("map", Vehicles=boats, Master_length=900.0, Master_speed=2.0).members
    assert (far.vehicle.length_m, far.vehicle.speed_mps) == (500.0, 2.0)
    assert (near.vehicle.length_m, near.vehicle.speed_mps) == (900.0, 3.0)
    assert near.vehicle.start == near.vehicle.recovery == far.vehicle.recovery != far.vehicle.start


@pytest.mark.parametrize(
    ("vehicles", "where", "says"),
    [
        ({}, "Vehicles", "list"),
        (["a"], "Vehicles[0]", "object"),
        ([boat(), boat("b"), boat()], "Vehicles[2].Name", "'a'"),
        ([boat("")], "Vehicles[0].Name", "empty"),
        ([boat(), boat("x" * 129)], "Vehicles[1].Name", "(129 characters); expected at most 128 characters"),
        ([boat("x" * 10**6), boat("x" * 10**6)], "Vehicles[0].Name", "(1000000 characters)"),
        ([{"Role": "slave"}], "Vehicles[0].Name", "missing"),
        ([boat(), boat("b", "captain")], "Vehicles[1].Role", "captain"),
        ([boat(Length=0.0)], "Vehicles[0].Length", "0.0"),
        ([boat(Speed=-1.0)], "Vehicles[0].Speed", "-1.0"),
        ([boat(Length="far")], "Vehicles[0].Length", "far"),
        ([boat(Start=at(95.0, 1.0))], "Vehicles[0].Start.lat", "95.0"),
        ([boat(Start={"lat": 46.0})], "Vehicles[0].Start", "long"),
        ([boat(role="master")], "Vehicles", "no slave"),
        ([], "Vehicles", "no slave"),
        ([boat(Start=at(46.03, 1.03))], "Vehicles[0].Start", "from the water, on land"),
        ([boat(), boat("b", Recovery=at(45.99, 1.0))], "Vehicles[1].Recovery", "from the water, on land"),
        ([boat(Start=at(46.006, 1.006))], "Vehicles[0].Start", "from the water, on land"),
    ],
)
def test_errors_name_the_vehicle_the_field_and_the_value(vehicles, where, says):
    with pytest.raises(InvalidMission) as caught:
        site(Vehicles=vehicles, ForbiddenZones=[ISLAND])
    assert caught.value.where.startswith(where)
    assert says in str(caught.value)


names = st.text(st.characters(codec="utf-8", categories=["L", "N", "P", "Zs"]), min_size=1, max_size=12)
given_boats = st.lists(
    st.fixed_dictionaries(
        {"Name": names, "Role": st.sampled_from(["master", "slave"])},
        optional={
            "Speed": st.floats(0.01, 100.0),
            "Length": st.floats(1.0, 1e6),
            "Start": st.just(at(46.01, 1.01)),
            "Colour": st.text(max_size=4),
        },
    ),
    max_size=5,
    unique_by=lambda each: each["Name"],
)


@settings(max_examples=40)
@given(boats=given_boats)
def test_vehicles_are_written_as_they_came(boats):
    boats = [*boats, boat("the one that is needed")]
    mission = parsed(Vehicles=boats, Swath=4.0)
    written = mission_json(mission)
    assert json.loads(written)["Vehicles"] == boats
    assert parse_mission(written) == mission


def test_vehicles_without_a_part_in_the_mission_are_a_warning():
    idle = site("map", Vehicles=[boat("a", "master"), boat("b")])
    assert [member.vehicle.name for member in idle.members] == ["a"]
    assert any("b take no part" in warning for warning in idle.warnings)


def test_values_at_or_above_the_threshold_are_hot_spots():
    features = [spot(1.001, 46.001, value=29.9), spot(1.005, 46.001, value=30.0), spot(1.012, 46.001, value=31.0)]
    assert [each.name for each in site(PriorModel=prior(*features)).hot_spots] == ["features[1]", "features[2]"]
    every = site(PriorModel=prior(*features), Bloom=None)
    assert [each.value for each in every.hot_spots] == [29.9, 30.0, 31.0]
    assert site("map", PriorModel=prior(*features)).hot_spots == ()


def test_a_point_is_a_disc_of_the_swath_and_points_close_together_are_one_hot_spot():
    near, far = [1.01, 46.01], [1.015, 46.015]
    (single,) = site(PriorModel=prior(points(near))).hot_spots
    assert single.area.area == pytest.approx(3.14 * 10.0**2, rel=0.03)
    joined = site(PriorModel=prior(points(near, [1.0101, 46.01], far))).hot_spots
    assert [each.name for each in joined] == ["features[0][0]", "features[0][1]"]


def test_the_minimal_spatial_rate_stands_in_for_the_swath():
    assert parsed(Minimal_spatial_rate=7.0).treated_swath_m == 7.0
    assert parsed(Minimal_spatial_rate=7.0, Swath=3.0).treated_swath_m == 3.0
    with pytest.raises(InvalidMission, match="Swath: is missing"):
        site(Swath=None)
    with pytest.raises(InvalidMission, match="Swath"):
        site(Swath=-3.0)


@pytest.mark.parametrize(
    ("features", "where", "says"),
    [
        ([spot(1.015, 46.015), spot(1.005, 46.005, 0.001)], "PriorModel.features[1]", "land"),
        ([points([1.006, 46.006])], "PriorModel.features[0]", "land"),
        ([spot(1.01, 46.01), spot(1.014, 46.01), spot(1.011, 46.011)], "PriorModel.features[2]", "features[0]"),
        ([spot(1.01, 46.01, 0.006), spot(1.011, 46.011, 0.001)], "PriorModel.features[1]", "features[0]"),
        ([spot(1.01, 46.01, value=3.0)], "PriorModel", "no hot spot"),
        ([spot(1.01, 46.01), spot(1.015, 46.01, value=0.0)], "PriorModel.features[1].properties.value", "is 0.0"),
        ([spot(1.01, 46.01, value=-2.0)], "PriorModel.features[0].properties.value", "is -2.0; expected > 0"),
        ([spot(1.10, 46.01)], "PriorModel", "no hot spot"),
    ],
    ids=[
        "island",
        "point on an island",
        "overlap",
        "nested",
        "below the threshold",
        "zero",
        "negative",
        "elsewhere",
    ],
)
def test_hot_spots_that_cannot_be_treated_are_named(features, where, says):
    threshold = -5.0 if where.endswith("value") else 30.0
    with pytest.raises(InvalidMission) as caught:
        site(PriorModel=prior(*features), ForbiddenZones=[ISLAND], Bloom={"Sensor": "chl", "Value": threshold})
    assert caught.value.where == where
    assert says in str(caught.value)


def test_hot_spots_that_touch_do_not_overlap():
    side_by_side = [spot(1.010, 46.01), spot(1.012, 46.01)]
    assert len(site(PriorModel=prior(*side_by_side)).hot_spots) == 2


def test_a_hot_spot_elsewhere_is_a_warning():
    found = site(PriorModel=prior(spot(1.01, 46.01), spot(2.0, 46.01)))
    assert len(found.hot_spots) == 1
    assert any("features[1] lies outside the water" in warning for warning in found.warnings)


def test_a_part_of_a_hot_spot_that_lies_elsewhere_is_a_warning():
    found = site(PriorModel=prior(points([1.01, 46.01], [1.0205, 46.01])))
    assert [each.name for each in found.hot_spots] == ["features[0][0]"]
    assert any("features[0][1] lies outside the water" in warning for warning in found.warnings)


@pytest.mark.parametrize("longs", [(1.004, 1.010, 1.016), (1.016, 1.004, 1.010)], ids=["eastwards", "mixed"])
def test_the_hot_spots_of_a_feature_are_numbered_as_they_are_given(longs):
    squares = [spot(long, 46.012)["geometry"]["coordinates"] for long in longs]
    many = {"type": "MultiPolygon", "coordinates": squares}
    polygons = {"type": "Feature", "geometry": many, "properties": {"value": 40.0}}
    found = site(PriorModel=prior(points(*([long, 46.005] for long in longs)), polygons)).hot_spots
    assert [each.name for each in found] == [f"features[{i}][{k}]" for i in range(2) for k in range(3)]
    middles = [each.area.centroid.x for each in found]
    ranks = sorted(range(3), key=longs.__getitem__)
    assert sorted(range(3), key=middles[:3].__getitem__) == ranks
    assert sorted(range(3), key=middles[3:].__getitem__) == ranks


def test_a_hot_spot_on_land_is_told_in_degrees():
    with pytest.raises(InvalidMission, match=r"at lat 46\.00\d+, long 1\.00\d+"):
        site(PriorModel=prior(spot(1.005, 46.005, 0.001)), ForbiddenZones=[ISLAND])


def test_paths_are_read_and_written():
    path = [at(46.0, 1.0), at(46.01, 1.01)]
    mission = parsed(Vehicles=[boat()], Paths=[{"Name": "a", "Role": "slave", "Path": path}])
    assert json.loads(mission_json(mission))["Paths"] == [{"Name": "a", "Role": "slave", "Path": path}]
    assert [planned.name for planned in mission.planned_paths] == ["a"]
    with pytest.raises(InvalidMission, match=r"Paths\[0\].Path\[1\].lat"):
        parsed(Paths=[{"Name": "a", "Role": "slave", "Path": [path[0], at(99.0, 1.0)]}])


@pytest.mark.parametrize("vehicles", [None, [boat(role="master"), boat("b", role="master")]])
def test_a_least_spacing_beyond_the_water_is_refused_however_many_share_it(vehicles):
    changes = {"Minimal_spatial_rate": 9000.0} | ({} if vehicles is None else {"Vehicles": vehicles})
    with pytest.raises(InvalidMission, match=r"Minimal_spatial_rate: is 9000 m; expected at most the extent"):
        Site.of(parsed("map", **changes))
