"""What stages call a field, and what the Mission File calls it: one table, which has all that they speak of."""

import ast
import json
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import fields

from oxbow.contracts import AssignRequest, CertifyRequest, ContourRequest, PathRequest, Vehicle
from oxbow.errors import Infeasible, InvalidMission, OxbowError
from oxbow.mission.file import JSON_NAMES, OutlineName, parse_mission
from oxbow.mission.vehicles import GivenVehicle
from oxbow.planning.field_names import FieldNames
from oxbow.planning.pipeline import plan_mission
from oxbow.site.site import Site
from oxbow_cli.local import local_call
from tests.support.project import ROOT

STAGES = ("contour", "decomposition", "path", "assignment", "certificate")
SOURCES = sorted(
    source
    for folder in (
        *(f"services/oxbow_{stage}" for stage in STAGES),
        "common/oxbow/contracts",
        "common/oxbow/geometry",
    )
    for source in (ROOT / folder).rglob("*.py")
)


def at(x_m, y_m):
    return {"lat": 46.0 + y_m / 111_150.0, "long": 1.0 + x_m / 77_470.0}


def rectangle(west, south, east, north):
    return [at(west, south), at(east, south), at(east, north), at(west, north)]


def mission(vehicles=None, outline="BoundingBox", **changes):
    document = {
        "MissionType": "map",
        "LaunchPoint": at(50, 50),
        outline: rectangle(0, 0, 400, 200),
        "Safety": 5.0,
        "Master_length": 2000.0,
        "Vehicles": vehicles,
    }
    return parse_mission(json.dumps(document | changes).encode())


def boat(name, **own):
    return {"Name": name, "Role": "master", "Length": 2000.0} | own


def texts_of(source):
    """The strings of a module without docstrings; what an f-string fills in is `{}`."""
    tree = ast.parse(source.read_text())
    inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    inner |= {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inner:
            yield node.value


def test_every_field_that_a_stage_speaks_of_is_in_the_table():
    quoted = {name for source in SOURCES for text in texts_of(source) for name in re.findall("`([^`]*)`?", text)}
    given_mission = mission()
    names = FieldNames.of_mission(given_mission, Site.of(given_mission)).names
    assert {"safety_m", "least_width_m", "shore_tolerance_m", "min_spacing_m"} <= quoted <= set(names)


READERS = {
    ROOT / "common/oxbow" / name for name in ("wire/codec.py", "wire/strict_json.py", "planning/field_names.py")
}
"""Modules that read the backquotes of others, in patterns."""


def test_nothing_but_a_field_that_a_stage_speaks_of_is_between_backquotes():
    others = {source for folder in ("common", "services") for source in (ROOT / folder).rglob("*.py")}
    others -= {*SOURCES, *READERS}
    assert len(others) > 100
    assert [text for source in sorted(others) for text in texts_of(source) if "`" in text] == []


def field_names(*structs):
    return {field.name for struct in structs for field in fields(struct)}


def require_field(name, given_mission):
    """Fail where a mission has no field of that name."""
    vehicle = re.fullmatch(r"Vehicles\[(\d+)\]\.(\w+)", name)
    if vehicle is None:
        assert name in {*JSON_NAMES.values(), *OutlineName}
        return
    [field] = [field.name for field in fields(GivenVehicle) if field.encode_name == vehicle[2]]
    # A place that a vehicle does not give is the mission's own, and is called that.
    assert field == "length_m" or getattr(given_mission.vehicles[int(vehicle[1])], field) is not None


place = st.builds(at, st.integers(10, 390), st.integers(10, 190))
own_fields = st.fixed_dictionaries({}, optional={"Start": place, "Recovery": place})
# Names may hold what means something in a text: quotes, backquotes, fields of others.
vehicle_names = st.sampled_from(["a", "b'", '"c"', "`safety_m`", "vehicle 'a': start", "d\n", "é"])
fleets = st.lists(st.tuples(vehicle_names, own_fields), max_size=4, unique_by=lambda pair: pair[0])
missions = st.builds(
    lambda fleet, outline, rest: mission([boat(name, **own) for name, own in fleet] or None, outline, **rest),
    fleets,
    st.sampled_from(["BoundingBox", "InBox"]),
    st.fixed_dictionaries({}, optional={"RecoveryPoint": place, "Swath": st.just(8.0)}),
)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(missions)
def test_the_table_leads_from_fields_of_requests_to_fields_of_the_mission(given_mission):
    site = Site.of(given_mission)
    names = dict(FieldNames.of_mission(given_mission, site).names)
    for member in site.members:
        for field in ("start", "recovery", "length_m"):
            assert field in field_names(Vehicle)
            require_field(names.pop(member.vehicle.field(field)), given_mission)
        of_member = FieldNames.of_member(member).names
        assert set(of_member) <= field_names(PathRequest)
        for name in of_member.values():
            require_field(name, given_mission)
    for index in range(len(site.ends)):
        require_field(names.pop(f"places[{index}]"), given_mission)
    assert set(names) <= field_names(AssignRequest, CertifyRequest, ContourRequest, PathRequest)
    for name in names.values():
        require_field(name, given_mission)


plain = st.text(alphabet="abc_m \n.", max_size=8)
quoted = st.sampled_from(["safety_m", "places[1]", "vehicle 'a': start", "safety", "oxbow plan", " safety_m"])


@settings(max_examples=100, derandomize=True)
@given(st.lists(st.tuples(plain, quoted), max_size=4), plain)
def test_known_names_between_backquotes_are_replaced_and_nothing_else_is(pieces, rest):
    known = {
        "safety_m": "Safety",
        "places[1]": "RecoveryPoint",
        "vehicle 'a': start": "Vehicles[0].Start",
        "a": "A",
    }
    text = "".join(f"{before}`{name}`" for before, name in pieces) + rest
    expected = "".join(f"{before}{known.get(name, f'`{name}`')}" for before, name in pieces) + rest
    assert FieldNames(known).in_text(text) == expected


ACROSS = {"ForbiddenZones": [rectangle(190, -10, 210, 210)]}
"""A zone from shore to shore: two waters, of which one is that of the first start."""
EAST = at(350, 150)


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"RecoveryPoint": EAST}, "RecoveryPoint"),
        ({"Vehicles": [boat("a"), boat("b", Recovery=EAST)]}, "Vehicles[1].Recovery"),
        ({"Vehicles": [boat("a"), boat("b", Start=EAST)]}, "Vehicles[1].Start"),
        ({"Vehicles": [boat("a", Start=at(60, 60), Recovery=EAST), boat("b")]}, "Vehicles[0].Recovery"),
        ({"Vehicles": [boat("a"), boat("b", Start=at(60, 60))], "RecoveryPoint": EAST}, "RecoveryPoint"),
    ],
)
def test_the_place_that_is_cut_off_is_the_one_that_is_named(changes, where):
    with pytest.raises((Infeasible, InvalidMission)) as raised:
        plan_mission(mission(**ACROSS | changes), call=local_call())
    assert raised.value.where == where


def test_an_error_keeps_its_kind_and_what_is_no_field_keeps_its_name():
    names = FieldNames({"launch": "LaunchPoint", "safety_m": "Safety"})
    with pytest.raises(OxbowError) as raised, names.in_errors():
        raise Infeasible("has no room for `safety_m`; see `oxbow plan`", where="launch")
    assert type(raised.value) is Infeasible
    assert str(raised.value) == "LaunchPoint: has no room for Safety; see `oxbow plan`"
