"""Fields without a meaning: kept, and told where one looks misspelt."""

import json

import pytest

from oxbow.mission.file import mission_json, parse_mission
from oxbow.site.site import Site

POND = [{"lat": lat, "long": long} for lat, long in ((46.0, 1.0), (46.0, 1.01), (46.01, 1.01), (46.01, 1.0))]
FIELDS = {"MissionType": "adap", "LaunchPoint": POND[0], "BoundingBox": POND}
BLOOM = {"Sensor": "chl", "Value": 30.0}


def warnings(**fields):
    mission = parse_mission(json.dumps(FIELDS | {"Bloom": BLOOM} | fields).encode())
    assert parse_mission(mission_json(mission)) == mission
    return Site.of(mission).warnings


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"Saftey": 10.0}, "Saftey is not a known field and is kept unchanged; did you mean Safety?"),
        ({"safety": 10.0}, "did you mean Safety?"),
        ({"Forbidden_Zones": []}, "did you mean ForbiddenZones?"),
        ({"Bloom": BLOOM | {"Sensors": "no3"}}, "Bloom.Sensors is not a known field"),
        (
            {"Vehicles": [{"Name": "a", "Role": "master", "length": 9.0}]},
            "Vehicles[0].length is not a known field",
        ),
        (
            {"DangerZones": [{"Contour": POND, "Danger": 0.1, "per": "metre"}]},
            "DangerZones[0].per is not a known field and is kept unchanged; did you mean Per?",
        ),
    ],
)
def test_a_field_that_looks_misspelt_is_told(fields, told):
    (warning,) = warnings(**fields)
    assert told in warning


def test_fields_of_others_are_kept_in_silence():
    assert warnings(Operator="A. Nobody", Depths=[1.0], Notes="none", Bloom=BLOOM | {"Unit": "ug/l"}) == ()
