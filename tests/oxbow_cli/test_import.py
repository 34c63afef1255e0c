import json

import pytest

SITE = {
    "type": "Feature",
    "properties": {"name": "South Pond"},
    "geometry": {
        "type": "Polygon",
        "coordinates": [
            [[170.0, -44.0], [170.01, -44.0], [170.01, -43.99], [170.0, -43.99], [170.0, -44.0]],
            [[170.004, -43.997], [170.006, -43.997], [170.005, -43.995], [170.004, -43.997]],
        ],
    },
}


@pytest.fixture
def site(folder):
    path = folder / "site.geojson"
    path.write_text(json.dumps(SITE))
    return path


def test_prints_a_mission_file(oxbow, site):
    result = oxbow("import", site, "--launch", "-43.999,170.001", "--safety", 5, "--length", 3000)
    assert result.returncode == 0
    mission = json.loads(result.stdout)
    assert mission["SiteName"] == "South Pond"
    assert mission["LaunchPoint"] == {"lat": -43.999, "long": 170.001}
    assert (mission["Safety"], mission["Master_length"]) == (5.0, 3000.0)
    assert len(mission["BoundingBox"]) == 4
    assert len(mission["ForbiddenZones"]) == 1


def test_writes_a_mission_file_that_can_be_evaluated_once_planned(oxbow, site, folder):
    arguments = ["--launch", "-43.999,170.001", "--recovery=-43.998,170.001", "--name", "Mere", "-o", "mere.json"]
    assert oxbow("import", site, *arguments).returncode == 0
    mission = json.loads((folder / "mere.json").read_text())
    assert mission["SiteName"] == "Mere"
    assert mission["RecoveryPoint"]["lat"] == -43.998


@pytest.mark.parametrize("launch", ["here", "1", "1,2,3", "-43.999;170.001"])
def test_a_launch_that_is_no_position_is_invalid_input(oxbow, site, launch):
    result = oxbow("import", site, "--launch", launch)
    assert result.returncode == 2
    assert result.stdout == ""
    assert result.stderr == f"error: --launch: is {launch!r}; expected LAT,LONG in degrees, such as 44.6,-73.3\n"


def test_swapped_degrees_are_told(oxbow, site):
    result = oxbow("import", site, "--launch", "170.001,-43.999")
    assert result.returncode == 2
    assert "swapped" in result.stderr


def test_what_is_passed_over_is_noted_beside_the_mission_file(oxbow, folder):
    point = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [170.0, -44.0]}}
    (folder / "site.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [SITE, point]}))
    result = oxbow("import", "site.geojson", "--launch", "-43.999,170.001")
    assert json.loads(result.stdout)["SiteName"] == "South Pond"
    assert result.stderr == "note: passed over 1 Point: only polygons are water\n"


def test_the_mission_file_is_utf8_on_any_terminal(oxbow, folder):
    (folder / "site.geojson").write_text(json.dumps(SITE | {"properties": {"name": "Étang 湖"}}))
    result = oxbow("import", "site.geojson", "--launch", "-43.999,170.001", PYTHONIOENCODING="ascii")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["SiteName"] == "Étang 湖"
