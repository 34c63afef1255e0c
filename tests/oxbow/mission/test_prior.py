"""The prior model: what it accepts, refuses and keeps, and where its weights come to lie."""

import json
import math
from contextlib import nullcontext

import jsonschema
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPoint, MultiPolygon, Point, Polygon, box

from oxbow.contracts import Variogram, VariogramModel
from oxbow.errors import InvalidMission, InvalidRequest
from oxbow.mission.file import mission_json, parse_mission
from oxbow.mission.plan import PlanOptions
from oxbow.mission.prior import PriorFeature, PriorModel, parse_prior, prior_document
from oxbow.planning.pipeline import plan_mission
from oxbow.site.site import Site
from oxbow.wire.codec import decode, encode
from oxbow_cli.local import local_call
from tests.support.project import SCHEMA

SQUARE = [(1.0, 46.0), (1.02, 46.0), (1.02, 46.02), (1.0, 46.02)]


def collection(*features, **members):
    return {"type": "FeatureCollection", "features": list(features)} | members


def feature(geometry, **properties):
    shape = json.loads(shapely.to_geojson(geometry)) if isinstance(geometry, shapely.Geometry) else geometry
    return {"type": "Feature", "geometry": shape, "properties": properties}


def mission(prior, shift=0.0):
    outline = [{"lat": lat, "long": long + shift} for long, lat in SQUARE]
    document = {"MissionType": "map", "LaunchPoint": outline[0], "BoundingBox": outline, "PriorModel": prior}
    return parse_mission(json.dumps(document).encode())


def weights(*features, shift=0.0):
    return Site.of(mission(collection(*features), shift)).weighted_areas


NEAR = box(1.0, 46.0, 1.01, 46.02)
CLAY = {"model": "matern32", "range_m": 250.0, "sill": 3.0, "nugget": 0.5}


def test_a_model_is_read():
    prior = mission(
        collection(feature(NEAR, weight=2), feature(Point(1.01, 46.01), value=7.5), variogram=CLAY)
    ).prior_model
    assert prior.features == (
        PriorFeature(geometry=NEAR, weight=2.0),
        PriorFeature(geometry=Point(1.01, 46.01), value=7.5),
    )
    assert prior.variogram == Variogram(model=VariogramModel.MATERN32, range_m=250.0, sill=3.0, nugget=0.5)


def test_what_is_not_known_is_kept():
    bloom = feature(NEAR, weight=2.0, value=3.0, name="north", source={"year": 2016}) | {"id": 7}
    given_prior = collection(bloom, crs=None, variogram=CLAY, bbox=[1, 46, 2, 47])
    assert json.loads(mission_json(mission(given_prior)))["PriorModel"] == given_prior


def test_a_missing_or_null_model_is_none():
    assert mission(None).prior_model is None
    assert "PriorModel" not in json.loads(mission_json(mission(None)))
    assert mission(None).variogram is None


@pytest.mark.parametrize(
    ("prior", "where", "says"),
    [
        ("blooms.geojson", "PriorModel", "blooms.geojson"),
        ([], "PriorModel", "object"),
        ({"type": "Feature"}, "PriorModel.type", "FeatureCollection"),
        (collection(4), "PriorModel.features[0]", "4"),
        (collection({"type": "Feature"}), "PriorModel.features[0].geometry", "missing"),
        (collection(feature(NEAR, weight=1), feature(NEAR)), "PriorModel.features[1].properties", "weight"),
        (collection(feature(NEAR, weight=-1)), "PriorModel.features[0].properties.weight", "-1"),
        (collection(feature(NEAR, weight="2")), "PriorModel.features[0].properties.weight", '"2"'),
        (collection(feature(NEAR, value=True)), "PriorModel.features[0].properties.value", "true"),
        (collection(feature(Point(1, 46), weight=3)), "PriorModel.features[0].properties.weight", "Point"),
        (collection(feature(LineString([(1, 2), (3, 4)]), weight=1)), "geometry.type", "LineString"),
        (collection(feature(box(1, 46, 2, 99), weight=1)), "geometry.coordinates[0][1]", "99"),
        (collection(feature(MultiPoint([(1, 2), (500, 2)]), value=1)), "geometry.coordinates[1]", "500"),
        (collection(feature(Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), weight=1)), "geometry", "0.5 0.5"),
        (
            collection(feature({"type": "Polygon", "coordinates": [[[0, 0], [1, 1]]]}, weight=1)),
            "[0]",
            "2 positions",
        ),
        (collection(feature({"type": "Polygon", "coordinates": []}, weight=1)), "geometry.coordinates", "[]"),
        (collection(feature(MultiPolygon(), weight=1)), "PriorModel.features[0].geometry", "without a position"),
        (collection(feature({"type": "Point", "coordinates": [1]}, value=1)), "geometry.coordinates", "[1]"),
        (collection(feature({"type": "Point", "coordinates": [1, "a"]}, value=1)), "coordinates[1]", '"a"'),
        (collection(crs={"name": "EPSG:3857"}), "PriorModel.crs", "3857"),
        (collection(variogram=3), "PriorModel.variogram", "3"),
        (collection(variogram=CLAY | {"model": "linear"}), "PriorModel.variogram.model", "linear"),
        (collection(variogram=CLAY | {"range_m": 0}), "PriorModel.variogram.range_m", "0"),
        (collection(variogram=CLAY | {"sill": -2}), "PriorModel.variogram.sill", "-2"),
        (collection(variogram=CLAY | {"nugget": 3.0}), "PriorModel.variogram.nugget", "sill"),
        (collection(variogram=CLAY | {"nuget": 1}), "PriorModel.variogram", "nuget"),
    ],
)
def test_errors_name_the_place_and_the_value(prior, where, says):
    with pytest.raises(InvalidMission) as caught:
        mission(prior)
    assert caught.value.where.startswith("PriorModel")
    assert where in caught.value.where
    assert says in str(caught.value)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_numbers_made_in_python_are_checked_too(wrong):
    for name in ("weight", "value"):
        with pytest.raises(InvalidMission, match=name):
            PriorFeature(geometry=NEAR, **{name: wrong})
    for name in ("range_m", "sill", "nugget"):
        with pytest.raises(InvalidRequest, match=name):
            Variogram(**CLAY | {name: wrong})


def test_weights_come_to_lie_in_the_sites_plane():
    (area,) = weights(feature(NEAR, weight=3))
    outline = Site.of(mission(None)).outline
    assert area.weight == 3.0
    assert area.area.intersection(outline).area == pytest.approx(outline.area / 2, rel=1e-4)


def test_the_last_of_overlapping_areas_counts():
    whole, inner = box(0.9, 45.9, 1.1, 46.1), box(1.005, 46.005, 1.01, 46.01)
    below, above = weights(feature(whole, weight=2), feature(inner, weight=0))
    assert (below.weight, above.weight) == (2.0, 0.0)
    assert below.area.intersection(above.area).area == pytest.approx(0.0, abs=1.0)
    assert [area.weight for area in weights(feature(inner, weight=0), feature(whole, weight=2))] == [2.0]
    assert [len(area.area.interiors) for area in weights(feature(whole, weight=2), feature(inner, weight=1))] == [
        1
    ]


def test_all_of_the_earth_is_cut_to_the_site():
    (area,) = weights(feature(box(-180, -90, 180, 90), weight=2))
    assert area.area.contains(Site.of(mission(None)).outline)
    assert area.area.area < 1.5 * Site.of(mission(None)).outline.area


@pytest.mark.parametrize(("shift", "turn"), [(-10.0, 0.0), (-10.0, 360.0), (170.0, -360.0)])
def test_longitudes_may_be_counted_from_anywhere(shift, turn):
    (area,) = weights(feature(shapely.affinity.translate(NEAR, shift + turn), weight=2), shift=shift)
    outline = Site.of(mission(None, shift)).outline
    assert area.area.intersection(outline).area == pytest.approx(outline.area / 2, rel=1e-4)


def test_a_site_across_the_antimeridian_has_the_weights_of_both_sides():
    halves = MultiPolygon([box(179.9, 45, 180, 47), box(-180, 45, -179.9, 47)])
    shift = 180.0 - 1.01
    areas = weights(feature(halves, weight=2), shift=shift)
    outline = Site.of(mission(None, shift)).outline
    assert sum(area.area.intersection(outline).area for area in areas) == pytest.approx(outline.area, rel=1e-6)


@pytest.mark.parametrize(
    "features",
    [
        [feature(box(2, 46, 3, 47), weight=5)],
        [feature(NEAR, weight=1)],
        [feature(NEAR, weight=4), feature(NEAR, weight=1)],
    ],
)
def test_weights_that_change_nothing_are_a_warning(features):
    site = Site.of(mission(collection(*features)))
    assert site.weighted_areas == ()
    (warning,) = site.warnings
    assert "PriorModel" in warning


def test_values_alone_give_no_weights_and_no_warning():
    site = Site.of(mission(collection(feature(NEAR, value=5))))
    assert site.weighted_areas == site.warnings == ()


def disc(draw):
    long, lat, radius = draw.uniform(0.995, 1.025), draw.uniform(45.995, 46.025), draw.uniform(1e-4, 0.02)
    return Point(long, lat).buffer(radius, quad_segs=3)


@settings(max_examples=40)
@given(st.lists(st.sampled_from([0.0, 0.5, 1.0, 2.0, 7.0]), min_size=1, max_size=8), st.integers(0, 2**16))
def test_every_place_has_the_weight_painted_on_it_last(given_weights, seed):
    draw = np.random.default_rng(seed)
    features = [PriorFeature(geometry=disc(draw), weight=weight) for weight in given_weights]
    bare = mission(None)
    site = Site.of(bare)
    painted = Site.of(parse_mission(mission_json(bare)[:-3] + b', "PriorModel": ' + as_json(features) + b"}"))
    lonlat = np.column_stack([draw.uniform(1.0, 1.02, 200), draw.uniform(46.0, 46.02, 200)])
    near_an_edge = np.min(
        [shapely.distance(one.geometry.exterior, shapely.points(lonlat)) for one in features], axis=0
    )
    lonlat = lonlat[near_an_edge > 1e-6]
    expected = np.ones(len(lonlat))
    for one in features:
        expected[shapely.contains_xy(one.geometry, lonlat)] = one.weight
    found = np.ones(len(lonlat))
    for area in painted.weighted_areas:
        found[shapely.contains_xy(area.area, site.frame.to_planar(lonlat))] = area.weight
    assert found.tolist() == expected.tolist()


def as_json(features):
    return json.dumps(prior_document(PriorModel(features=tuple(features)))).encode()


@settings(max_examples=40)
@given(
    weight=st.none() | st.floats(0, 1e9),
    value=st.floats(-1e9, 1e9),
    name=st.text(),
    geometry=st.sampled_from([NEAR, MultiPolygon([NEAR]), NEAR.difference(box(1.002, 46.002, 1.003, 46.003))]),
)
def test_a_model_survives_writing_and_reading(weight, value, name, geometry):
    one = PriorFeature(geometry=geometry, weight=weight, value=value, properties={"name": name}, extra={"id": 3})
    prior = PriorModel(features=(one,), variogram=Variogram(**CLAY), extra={"title": name})
    assert parse_prior(json.dumps(prior_document(prior) | {"variogram": CLAY}).encode()) == prior


def test_the_stages_get_what_they_need_of_it():
    asked = {}
    call = local_call()

    def noting(endpoint, request, *, part=""):
        asked[endpoint.stage] = decode(encode(request), endpoint.request)
        return call(endpoint, request, part=part)

    known = mission(collection(feature(NEAR, weight=2), variogram=CLAY))
    plan_mission(known, PlanOptions(time_limit_s=20.0), call=noting)
    assert asked["path"].weighted_areas == Site.of(known).weighted_areas
    assert asked["path"].time_limit_s == 20.0
    assert asked["certificate"].variogram == Variogram(**CLAY)


@pytest.mark.parametrize(
    ("prior", "is_valid"),
    [
        (collection(feature(NEAR, weight=2), feature(Point(1.01, 46.01), value=7), variogram=CLAY), True),
        (collection(variogram=None), True),
        (None, True),
        ("blooms.geojson", False),
        (collection(feature(NEAR)), False),
        (collection(feature(NEAR, weight=-1)), False),
        (collection(feature(Point(1, 46), weight=3)), False),
        (collection(feature(LineString([(1, 2), (3, 4)]), weight=1)), False),
        (collection(variogram=CLAY | {"model": "linear"}), False),
        (collection(variogram=CLAY | {"nuget": 1}), False),
    ],
)
def test_the_schema_takes_what_the_parser_takes(prior, is_valid):
    corners = [{"lat": lat, "long": long} for long, lat in SQUARE]
    document = {"MissionType": "map", "LaunchPoint": corners[0], "BoundingBox": corners, "PriorModel": prior}
    assert jsonschema.Draft202012Validator(SCHEMA).is_valid(document) is is_valid
    with nullcontext() if is_valid else pytest.raises(InvalidMission):
        mission(prior)
