"""`oxbow plan --prior` and `--time-limit`: what is known of the field, and how long to improve the path."""

import json

import pytest

from oxbow.mission.file import read_mission
from oxbow.site.site import Site
from oxbow_cli.arguments import with_prior

VARIOGRAM = {"model": "exponential", "range_m": 80.0, "sill": 2.0, "nugget": 0.1}
WEST_HALF = [[-73.41, 44.59], [-73.3975, 44.59], [-73.3975, 44.61], [-73.41, 44.61], [-73.41, 44.59]]
BLOOM = {
    "type": "Feature",
    "geometry": {"type": "Polygon", "coordinates": [WEST_HALF]},
    "properties": {"weight": 4.0, "season": "late summer"},
}
PRIOR = {"type": "FeatureCollection", "features": [BLOOM], "variogram": VARIOGRAM}
GRID = "ncols 2\nnrows 2\nxllcorner -73.4025\nyllcorner 44.595\ncellsize 0.005\n4 1\n4 1\n"


@pytest.fixture
def prior(folder):
    path = folder / "prior.geojson"
    path.write_text(json.dumps(PRIOR))
    return path


def planned(oxbow, folder, *options):
    result = oxbow("plan", "pond.json", "-o", "planned.json", "--method", "Transect", *options)
    assert result.returncode == 0, result.stderr
    return json.loads((folder / "planned.json").read_text())


def test_the_plan_keeps_the_prior_and_tells_the_kriging_variance(oxbow, folder, pond, prior):
    (folder / "pond.json").write_text(json.dumps(pond(Master_length=6000.0)))
    mission = planned(oxbow, folder, "--local", "--prior", prior.name)
    assert mission["PriorModel"] == PRIOR
    measures = mission["Plan"]["certificate"]
    assert 0 < measures["kriging_variance_mean"] < measures["kriging_variance_max"] < 1
    evaluated = json.loads(oxbow("evaluate", "planned.json", "--json").stdout)
    assert evaluated["kriging_variance_mean"] == pytest.approx(measures["kriging_variance_mean"], rel=0.01)


def test_without_a_prior_there_is_neither(oxbow, folder):
    mission = planned(oxbow, folder, "--local")
    assert "PriorModel" not in mission
    assert mission["Plan"]["certificate"]["kriging_variance_mean"] is None
    assert mission["Plan"]["time_limit_s"] is None


def test_a_prior_takes_the_place_of_the_missions_own(oxbow, folder, pond, prior):
    own = {"type": "FeatureCollection", "features": [], "title": "old"}
    (folder / "pond.json").write_text(json.dumps(pond(PriorModel=own)))
    assert planned(oxbow, folder, "--local", "--prior", prior.name)["PriorModel"] == PRIOR


@pytest.mark.usefixtures("prior")
def test_a_raster_and_a_polygon_weigh_the_same_water(folder):
    (folder / "prior.asc").write_text(GRID)
    mission = read_mission(folder / "pond.json")
    polygon, raster = (Site.of(with_prior(mission, folder / name)) for name in ("prior.geojson", "prior.asc"))
    areas = [
        [area.area.intersection(site.outline).area for area in site.weighted_areas] for site in (polygon, raster)
    ]
    assert len(areas[0]) == len(areas[1]) == 1
    assert areas[0] == pytest.approx(areas[1], rel=1e-4)
    assert with_prior(mission, None) is mission


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (json.dumps(PRIOR).replace("4.0", "-4.0"), "prior.geojson.features[0].properties.weight: is -4.0"),
        (json.dumps(PRIOR).replace("80.0", "0"), "prior.geojson.variogram.range_m: is 0"),
        (json.dumps(PRIOR).replace("-73.41,", "4000,"), "geometry.coordinates[0][0]: is [4000"),
        ("{", "prior.geojson: is not JSON"),
    ],
)
def test_a_prior_of_wrong_content_is_invalid_input(oxbow, folder, prior, text, told):
    prior.write_text(text)
    before = (folder / "pond.json").read_bytes()
    result = oxbow("plan", "pond.json", "--local", "--prior", prior.name)
    assert result.returncode == 2
    assert told in result.stderr
    assert result.stderr.count("\n") == 1
    assert (folder / "pond.json").read_bytes() == before


@pytest.mark.parametrize(
    ("limit", "told"), [("0", "--time-limit"), ("soon", "--time-limit"), ("300", "less than --timeout, 300 s")]
)
def test_a_time_limit_that_cannot_be_kept_is_invalid_input(oxbow, limit, told):
    result = oxbow("plan", "pond.json", "--local", "--time-limit", limit)
    assert result.returncode == 2
    assert told in result.stderr


@pytest.mark.processes
def test_over_the_bus_they_come_along(oxbow, folder, prior):
    mission = planned(oxbow, folder, "--prior", prior.name, "--time-limit", "60")
    assert mission["PriorModel"] == PRIOR
    assert mission["Plan"]["time_limit_s"] == 60.0
    assert mission["Plan"]["certificate"]["kriging_variance_mean"] > 0
