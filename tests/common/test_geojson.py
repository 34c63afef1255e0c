"""Sites from GeoJSON."""

import json
from pathlib import Path

import pytest

from oxbow.errors import InvalidMission
from oxbow.frame import Position
from oxbow.geojson import mission_from_geojson
from oxbow.site import Site

OUTER = [[1.0, 46.0], [1.1, 46.0], [1.1, 46.1], [1.0, 46.1], [1.0, 46.0]]
HOLE = [[1.04, 46.04], [1.04, 46.06], [1.06, 46.06], [1.06, 46.04], [1.04, 46.04]]
POLYGON = {"type": "Polygon", "coordinates": [OUTER, HOLE]}
LAUNCH = Position(46.0, 1.0)


def imported(document, **changes):
    return mission_from_geojson(json.dumps(document).encode(), launch=LAUNCH, **changes)


@pytest.mark.parametrize(
    "document",
    [
        POLYGON,
        {"type": "Feature", "properties": {}, "geometry": POLYGON},
        {"type": "FeatureCollection", "features": [{"type": "Feature", "properties": None, "geometry": POLYGON}]},
        {"type": "MultiPolygon", "coordinates": [POLYGON["coordinates"]]},
    ],
    ids=lambda document: document["type"],
)
def test_holes_become_forbidden_zones(document):
    mission = imported(document)
    assert len(mission.forbidden_zones) == 1
    assert mission.outline[1] == Position(46.0, 1.1)
    assert Site.of(mission).zones[0].area > 0


def test_the_given_fields_are_kept():
    mission = imported(POLYGON, safety_m=12.0, length_m=5000.0, recovery=Position(46.05, 1.0), site_name="Lake")
    assert (mission.safety_m, mission.master_length_m, mission.site_name) == (12.0, 5000.0, "Lake")
    assert mission.recovery == Position(46.05, 1.0)


@pytest.mark.parametrize(
    ("document", "says"),
    [
        ({"type": "Point", "coordinates": [1, 2]}, "Point"),
        ({"type": "FeatureCollection", "features": []}, "no polygon"),
        ({"type": "Polygon", "coordinates": [[[1.0, 46.0], [1.1, 46.0]]]}, "at least 3"),
        ({"type": "MultiPolygon", "coordinates": [[OUTER], [HOLE]]}, "2"),
        (POLYGON | {"crs": {"type": "name", "properties": {"name": "EPSG:3857"}}}, "crs"),
        ([], "GeoJSON"),
    ],
)
def test_what_is_no_site_is_refused(document, says):
    with pytest.raises(InvalidMission, match=says):
        imported(document)


def test_the_example_site_is_imported():
    data = (Path(__file__).parents[2] / "docs/examples/reservoir.geojson").read_bytes()
    mission = mission_from_geojson(data, launch=Position(43.5984, 2.7501), safety_m=10.0, length_m=30_000.0)
    assert Site.of(mission).outline.area > 1e5
