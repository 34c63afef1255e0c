"""Bounds of lengths, speeds and distances in a Mission File: errors name its fields, their values and bounds."""

import json
import math
import re

import jsonschema
import pytest

from oxbow.contracts import Method
from oxbow.errors import Infeasible, InvalidMission
from oxbow.mission.file import Mission, parse_mission
from oxbow.mission.plan import PlanOptions
from oxbow.planning.pipeline import plan_mission
from oxbow_cli.local import local_call
from tests.support.project import SCHEMA

LEAST, MOST = 1e-3, 1e9
FARTHEST = 2.1e7
SQUARE = [{"lat": lat, "long": long} for lat, long in ((46.0, 1.0), (46.0, 1.02), (46.02, 1.02), (46.02, 1.0))]
LENGTHS = {
    "Master_length": (LEAST, MOST),
    "Slave_length": (LEAST, MOST),
    "Master_speed": (LEAST, MOST),
    "Slave_speed": (LEAST, MOST),
    "Minimal_spatial_rate": (LEAST, FARTHEST),
    "Swath": (LEAST, FARTHEST),
    "Footprint": (LEAST, FARTHEST),
    "Danger_detour": (0.0, MOST),
    "Safety": (0.0, FARTHEST),
    "Vehicles[1].Length": (LEAST, MOST),
    "Vehicles[1].Speed": (LEAST, MOST),
}


def document(**fields) -> dict:
    return {"MissionType": "map", "LaunchPoint": SQUARE[0], "BoundingBox": SQUARE} | fields


def mission(**fields) -> Mission:
    return parse_mission(json.dumps(document(**fields)).encode())


def fleet(**fields) -> list[dict]:
    """Two masters, the second with these fields."""
    return [{"Name": "a", "Role": "master"}, {"Name": "b", "Role": "master"} | fields]


def with_value(field: str, value: float) -> dict:
    own = field.removeprefix("Vehicles[1].")
    return {field: value} if own == field else {"Vehicles": fleet(**{own: value})}


def value_of(given: Mission, field: str) -> float:
    holder = given.vehicles[1] if given.vehicles else given
    own = field.removeprefix("Vehicles[1].").lower()
    (name,) = [name for name in holder.__struct_fields__ if name.removesuffix("_mps").removesuffix("_m") == own]
    return getattr(holder, name)


def planned(**fields) -> Mission:
    """By legs far apart, which are soon planned."""
    options = PlanOptions(method=Method.TRANSECT, time_limit_s=1e-3)
    return plan_mission(mission(Minimal_spatial_rate=500.0, **fields), options, call=local_call())


@pytest.mark.parametrize(("field", "bounds"), LENGTHS.items())
def test_bounds_are_accepted_and_what_is_beyond_is_refused_with_field_value_and_bounds(field, bounds):
    least, most = bounds
    for value in bounds:
        assert value_of(mission(**with_value(field, value)), field) == value
        jsonschema.validate(document(**with_value(field, value)), SCHEMA)
    for value in (math.nextafter(least, -math.inf), -1.0, math.nextafter(most, math.inf), 1e300):
        with pytest.raises(InvalidMission) as caught:
            mission(**with_value(field, value))
        assert str(caught.value) == f"{field}: is {value!r}; expected a number from {least:g} to {most:g}"
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(document(**with_value(field, value)), SCHEMA)


@pytest.mark.parametrize("length", [LEAST, 0.4])
@pytest.mark.parametrize(
    ("fields", "where"),
    [
        (lambda length: {"Master_length": length}, "Master_length"),
        (lambda length: {"Vehicles": fleet(Length=length)}, "Vehicles[1].Length"),
        (lambda length: {"Vehicles": fleet(Length=length)[1:]}, "Vehicles[0].Length"),
    ],
    ids=["one vehicle", "one of a fleet", "a vehicle that is named"],
)
def test_the_least_length_is_too_short_by_the_name_and_value_that_were_given(fields, where, length):
    with pytest.raises(Infeasible) as caught:
        planned(**fields(length))
    assert caught.value.where == where
    assert re.match(rf"is {length:g} m; expected more than \d", caught.value.message)


@pytest.mark.parametrize("vehicles", [{}, {"Vehicles": fleet(Length=MOST)}], ids=["one vehicle", "a fleet"])
def test_the_greatest_length_is_planned(vehicles):
    completed = planned(Master_length=MOST, **vehicles)
    assert all(len(each.path) > 10 for each in completed.planned_paths)
    assert "of the longest length" in " ".join(completed.plan.warnings)


@pytest.mark.parametrize("vehicles", [{}, {"Vehicles": fleet()}], ids=["one vehicle", "a fleet"])
@pytest.mark.parametrize("safety", [FARTHEST, 800.0])
def test_a_safety_that_leaves_no_water_is_told_in_the_mission_files_words(safety, vehicles):
    with pytest.raises(Infeasible) as caught:
        planned(Safety=safety, **vehicles)
    assert str(caught.value).startswith(f"Safety: is {safety:g} m, which leaves no free water")
    assert "safety_m" not in str(caught.value)


POINT = {
    "type": "Feature",
    "geometry": {"type": "Point", "coordinates": [1.01, 46.01]},
    "properties": {"value": 40.0},
}


@pytest.mark.parametrize("width", ["Swath", "Minimal_spatial_rate"])
def test_the_widest_swath_treats_a_point_in_one_pass(width):
    hot_spots = {"type": "FeatureCollection", "features": [POINT]}
    given = mission(MissionType="treat", PriorModel=hot_spots, **{width: FARTHEST})
    [treated] = plan_mission(given, call=local_call()).plan.treatment.hot_spots
    assert treated.treated_share == pytest.approx(1.0)


def test_the_greatest_spatial_rate_is_refused_by_its_own_name_where_it_exceeds_the_water():
    given = mission(Minimal_spatial_rate=FARTHEST)
    with pytest.raises(
        InvalidMission, match=r"^Minimal_spatial_rate: is 2\.1e\+07 m; expected at most the extent"
    ):
        plan_mission(given, PlanOptions(method=Method.TRANSECT), call=local_call())
