"""Danger zones in a Mission File: what is accepted, what is refused, and what becomes of them in the plane."""

import json
import math

import jsonschema
import pytest
import shapely
from shapely import box

from oxbow.contracts import DANGER_DETOUR_M, AssignRequest, Per, Vehicle
from oxbow.errors import InvalidMission, InvalidRequest
from oxbow.mission.file import mission_json, parse_mission
from oxbow.site.site import Site
from tests.support.project import SCHEMA


def at(lat, long):
    return {"lat": lat, "long": long}


def square(south, west, size=0.004):
    return [at(south, west), at(south, west + size), at(south + size, west + size), at(south + size, west)]


def zone(danger=0.1, contour=None, **fields):
    return {"Contour": contour or square(46.004, 1.004), "Danger": danger} | fields


def document(**changes):
    fields = {"MissionType": "map", "LaunchPoint": at(46.0, 1.0), "BoundingBox": square(46.0, 1.0, 0.02)}
    return fields | changes


def parsed(**changes):
    return parse_mission(json.dumps(document(**changes)).encode())


def site(*zones, **changes):
    return Site.of(parsed(DangerZones=list(zones), **changes))


def test_zones_come_to_the_plane_with_their_names():
    found = site(zone(Name="ferry"), zone(0.002, Per="metre"))
    assert [(each.name, each.probability, each.per) for each in found.danger_zones] == [
        ("ferry", 0.1, Per.CROSSING),
        ("DangerZones[1]", 0.002, Per.METRE),
    ]
    assert found.danger_detour_m == DANGER_DETOUR_M
    assert site(zone(), Danger_detour=0).danger_detour_m == 0.0
    forbidden = Site.of(parsed(ForbiddenZones=[square(46.004, 1.004)]))
    assert found.danger_zones[0].area.equals(forbidden.zones[0])
    assert (found.area_m2, found.zones) == (Site.of(parsed()).area_m2, ())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"DangerZones": [zone(1.0)]},
            "DangerZones[0].Danger: is 1.0; expected 0 <= danger < 1 (what must not be entered belongs in"
            " ForbiddenZones)",
        ),
        ({"DangerZones": [zone(), zone(-0.1)]}, "DangerZones[1].Danger: is -0.1; expected 0 <= danger < 1"),
        ({"DangerZones": [zone("high")]}, 'DangerZones[0].Danger: is "high"; expected a finite number'),
        ({"DangerZones": [{"Danger": 0.1}]}, "DangerZones[0].Contour: is missing"),
        ({"DangerZones": [zone(Per="mile")]}, 'DangerZones[0].Per: is "mile"; expected one of metre, crossing'),
        ({"DangerZones": {}}, "DangerZones: is {}; expected a list"),
        ({"DangerZones": [[]]}, "DangerZones[0]: is []; expected an object"),
        ({"DangerZones": [zone(contour=square(46.0, 1.0)[:2])]}, "DangerZones[0].Contour: has 2 distinct points"),
        (
            {"DangerZones": [zone(contour=[at(46.0, 1.0), at(46.001, 1.001), at(46.002, 1.002)])]},
            "DangerZones[0].Contour: has all its points on one line",
        ),
        (
            {"DangerZones": [zone(contour=[*square(46.0, 1.0), at(99.0, 1.0)])]},
            "DangerZones[0].Contour[4].lat: is 99",
        ),
        ({"Danger_detour": -1.0}, "Danger_detour: is -1.0; expected a number from 0 to 1e+09"),
        (
            {"Vehicles": [{"Name": "a", "Role": "master", "Danger_factors": {"features[0]": 0.5}}]},
            "Vehicles[0].Danger_factors['features[0]']: is 0.5; expected a finite number >= 1",
        ),
        (
            {"Vehicles": [{"Name": "a", "Role": "master", "Danger_factor": 0.5}]},
            "Vehicles[0].Danger_factor: is 0.5; expected a finite number >= 1",
        ),
    ],
)
def test_errors_name_the_zone_the_field_and_the_value(changes, says):
    with pytest.raises(InvalidMission) as caught:
        Site.of(parsed(**changes))
    assert says in str(caught.value)


@pytest.mark.parametrize("number", ["NaN", "1e999"])
def test_a_danger_that_is_no_finite_number_is_refused(number):
    text = json.dumps(document(DangerZones=[zone(0.125)])).replace("0.125", number)
    with pytest.raises(InvalidMission):
        parse_mission(text.encode())


def test_a_zone_outside_the_water_is_a_warning():
    found = site(zone(contour=square(47.0, 1.0)), zone(0.2))
    assert [each.probability for each in found.danger_zones] == [0.2]
    assert "DangerZones[0] lies outside BoundingBox: it has no effect" in found.warnings


def test_all_that_a_zone_encloses_is_dangerous():
    south_west, south_east, north_east, north_west = square(46.004, 1.004)
    found = site(zone(contour=[south_west, north_east, south_east, north_west]))
    whole = shapely.union_all([each.area for each in found.danger_zones])
    assert whole.area == pytest.approx(site(zone()).danger_zones[0].area.area / 2, rel=1e-3)
    assert "DangerZones[0] meets itself: all that it encloses is dangerous" in found.warnings


def test_zones_are_written_as_they_came():
    given = [zone(Name="ferry", Per="metre", Colour="red"), zone(0.3, Per="crossing")]
    boats = [{"Name": "a", "Role": "master", "Danger_factor": 1.5, "Danger_factors": {"features[0]": 3.0}}]
    mission = parsed(DangerZones=given, Danger_detour=250.0, Vehicles=boats)
    written = json.loads(mission_json(mission))
    assert (written["DangerZones"], written["Danger_detour"], written["Vehicles"]) == (given, 250.0, boats)
    assert parse_mission(mission_json(mission)) == mission
    assert not {"DangerZones", "Danger_detour"} & json.loads(mission_json(parsed())).keys()


def test_the_schema_accepts_and_refuses_what_the_parser_does():
    jsonschema.validate(document(DangerZones=[zone(), zone(0.2, Per="metre", Name="a")], Danger_detour=0), SCHEMA)
    for changes in ({"DangerZones": [zone(1.0)]}, {"DangerZones": [zone(Per="mile")]}, {"Danger_detour": -1.0}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(document(**changes), SCHEMA)


def test_messages_refuse_what_is_out_of_range():
    boat = {"name": "tern", "length_m": 100.0, "start": (0.0, 0.0), "recovery": (0.0, 0.0)}
    for factor in (0.9, math.nan, math.inf):
        with pytest.raises(InvalidRequest, match=r"'tern': danger_factor: is .* >= 1"):
            Vehicle(**boat, danger_factor=factor)
    with pytest.raises(InvalidRequest, match=r"danger_detour_m: is -1\.0"):
        AssignRequest(free=box(0, 0, 1, 1), vehicles=(Vehicle(**boat),), danger_detour_m=-1.0)
