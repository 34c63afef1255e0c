"""Sites from GeoJSON."""

import json

import pytest

from oxbow.errors import InvalidMission
from oxbow.geometry.frame import Position
from oxbow.mission.file import Mission
from oxbow.site.geojson import ImportedMission, mission_from_geojson
from oxbow.site.site import Site
from tests.support.project import EXAMPLES

OUTER = [[1.0, 46.0], [1.1, 46.0], [1.1, 46.1], [1.0, 46.1], [1.0, 46.0]]
HOLE = [[1.04, 46.04], [1.04, 46.06], [1.06, 46.06], [1.06, 46.04], [1.04, 46.04]]
POLYGON = {"type": "Polygon", "coordinates": [OUTER, HOLE]}
LAUNCH = Position(46.0, 1.0)


def read(document, launch=LAUNCH, **changes) -> ImportedMission:
    return mission_from_geojson(json.dumps(document).encode(), launch=launch, **changes)


def imported(document, **changes) -> Mission:
    return read(document, **changes).mission


def feature(geometry, **properties):
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def collection(*geometries):
    return {"type": "FeatureCollection", "features": [feature(geometry) for geometry in geometries]}


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
        ({"type": "Polygon"}, r"coordinates: is missing"),
        ({"type": "Polygon", "coordinates": [[]]}, "0 distinct points"),
        ({"type": "Polygon", "coordinates": []}, "no polygon"),
        ({"type": "Topology", "objects": {}}, "Topology"),
        (
            collection(None, {"type": "LineString", "coordinates": [[1, 46], [2, 46]]}),
            "without a geometry, 1 Line",
        ),
        ({"type": "FeatureCollection", "features": [{"type": "Feature"}]}, r"features\[0\].geometry: is missing"),
        ({"type": "Polygon", "coordinates": [[[1.0, 46.0], [1.1, None], [1.1, 46.1]]]}, "null"),
        ({"type": "Polygon", "coordinates": [[[500000, 5e6], [500100, 5e6], [500100, 5.1e6]]]}, "projected"),
    ],
)
def test_what_is_no_site_is_refused(document, says):
    with pytest.raises(InvalidMission, match=says):
        imported(document)


def test_the_example_site_is_imported():
    data = (EXAMPLES / "reservoir.geojson").read_bytes()
    found = mission_from_geojson(data, launch=Position(43.5984, 2.7501), safety_m=10.0, length_m=30_000.0)
    assert Site.of(found.mission).outline.area > 1e5
    assert found.notes == ()


POINT = {"type": "Point", "coordinates": [1.0, 46.0]}


@pytest.mark.parametrize(
    ("document", "note"),
    [
        (collection(POLYGON, POINT), "1 Point"),
        (collection(None, POINT, POINT, POLYGON), "1 feature without a geometry, 2 Point"),
        ({"type": "GeometryCollection", "geometries": [POINT, POLYGON]}, "1 Point"),
        (
            collection({"type": "GeometryCollection", "geometries": [{"type": "GeometryCollection",
             "geometries": [{"type": "LineString", "coordinates": [[1, 46], [2, 46]]}, POLYGON]}]}),
            "1 LineString",
        ),
        (collection({"type": "Polygon", "coordinates": []}, POLYGON), ""),
    ],
)  # fmt: skip
def test_what_is_no_polygon_is_passed_over_with_a_note(document, note):
    found = read(document)
    assert found.mission.outline == imported(POLYGON).outline
    assert [note in text for text in found.notes] == ([True] if note else [])


def test_several_waters_are_listed_by_name_and_size():
    small = {"type": "Polygon", "coordinates": [HOLE]}
    waters = [feature(small, name="Tarn"), feature(POLYGON, name="Mere")]
    with pytest.raises(InvalidMission, match=r"1 \(Mere, 86.* km2\), 0 \(Tarn, 3.4.* km2\)"):
        imported({"type": "FeatureCollection", "features": waters})
    chosen = imported({"type": "FeatureCollection", "features": waters}, part=1)
    assert (chosen.site_name, len(chosen.outline)) == ("Mere", 4)


@pytest.mark.parametrize("ring", [OUTER[:-1], [*OUTER, OUTER[0]], [*OUTER, OUTER[0], OUTER[0]], OUTER[::-1]])
@pytest.mark.parametrize("height", [[], [12.5]])
def test_rings_closed_or_not_either_way_round_with_heights_or_without(ring, height):
    mission = imported({"type": "Polygon", "coordinates": [[point + height for point in ring]]})
    assert len(mission.outline) == 4
    assert Site.of(mission).outline == Site.of(imported({"type": "Polygon", "coordinates": [OUTER]})).outline


def named(crs):
    return {"type": "name", "properties": {"name": crs}}


@pytest.mark.parametrize(
    "crs",
    [
        None,
        "EPSG:4326",
        {"type": "EPSG", "properties": {"code": 4326}},
        *map(
            named,
            (
                "urn:ogc:def:crs:OGC:1.3:CRS84",
                "urn:ogc:def:crs:OGC::CRS84",
                "urn:ogc:def:crs:OGC:2:84",
                "urn:ogc:def:crs:EPSG::4326",
                "urn:ogc:def:crs:EPSG:8.9:4326",
                "urn:x-ogc:def:crs:EPSG:4326",
                "urn:ogc:def:crs:EPSG::4979",
                "http://www.opengis.net/def/crs/OGC/1.3/CRS84",
                "https://www.opengis.net/def/crs/EPSG/0/4326",
                "EPSG:4326",
                "epsg:4326",
                "OGC:CRS84",
                "CRS84",
                "CRS:84",
                "WGS 84",
            ),
        ),
    ],
)
def test_wgs84_by_any_of_its_names(crs):
    assert imported(POLYGON | {"crs": crs}).outline == imported(POLYGON).outline


@pytest.mark.parametrize(
    "crs",
    [
        "",
        7,
        [],
        {},
        {"type": "link", "properties": {"href": "http://example.org/crs/4326", "type": "proj4"}},
        {"type": "EPSG", "properties": {"code": 43260}},
        *map(
            named,
            (
                "urn:ogc:def:crs:EPSG::43260",
                "urn:ogc:def:crs:EPSG::14326",
                "EPSG:4326.1",
                "EPSG:43261",
                "urn:ogc:def:crs:EPSG::4267",
                "urn:ogc:def:crs:OGC:1.3:CRS83",
                "my system, not EPSG:4326",
                "EPSG:4326 + EPSG:5773",
                "4326",
                None,
            ),
        ),
    ],
)
@pytest.mark.parametrize("place", ["", "features[0].", "features[0].geometry."])
def test_another_system_is_refused_by_its_name(crs, place):
    document = collection(POLYGON | ({"crs": crs} if place.endswith("geometry.") else {}))
    if not place:
        document["crs"] = crs
    elif place == "features[0].":
        document["features"][0]["crs"] = crs
    with pytest.raises(InvalidMission) as caught:
        imported(document)
    assert caught.value.where == f"{place}crs"
    assert "WGS84" in caught.value.message


TEXT = json.dumps(feature(POLYGON, name="Étang")).replace("\\u00c9", "É")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_a_byte_order_mark_tells_the_encoding(encoding):
    assert mission_from_geojson(TEXT.encode(encoding), launch=LAUNCH).mission.site_name == "Étang"


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"\xff\xfe{\x00\x00\xd8", "UTF-16"),
        (TEXT.encode("latin-1"), "not UTF-8"),
        (TEXT.encode("utf-16-le"), "JSON"),
        (b"\xef\xbb\xbf", "JSON"),
        (b"", "JSON"),
    ],
)
def test_other_encodings_are_refused(data, says):
    with pytest.raises(InvalidMission, match=says):
        mission_from_geojson(data, launch=LAUNCH)


def cut(*parts):
    return {"type": "MultiPolygon", "coordinates": [[[*ring, ring[0]]] for ring in parts]}


def box(west, south, east, north):
    return [[west, south], [east, south], [east, north], [west, north]]


NEAR_FIJI = Position(-17.0, 179.95)
WEST, EAST = box(179.9, -17.02, 180, -16.95), box(-180, -17.02, -179.9, -16.95)


def area_km2(mission) -> float:
    return Site.of(mission).area_m2 / 1e6


@pytest.mark.parametrize(
    "document",
    [
        cut(WEST, EAST),
        cut(EAST, WEST),
        cut(WEST[::-1], EAST),
        cut(box(179.9, -17.02, 179.9999999, -16.95), EAST),
        cut(WEST, box(180, -17.02, 180.1, -16.95)),
        collection(cut(WEST), cut(EAST)),
        cut(WEST, box(-180, -17.02, -179.9, -16.99), box(-180, -16.99, -179.9, -16.95)),
    ],
)
def test_what_was_cut_at_the_antimeridian_is_one_water_again(document):
    found = read(document, launch=NEAR_FIJI)
    whole = imported(cut(box(179.9, -17.02, 180.1, -16.95)), launch=NEAR_FIJI)
    assert area_km2(found.mission) == pytest.approx(area_km2(whole), rel=1e-6)
    assert all(-180 <= place.long <= 180 for place in found.mission.outline)
    assert "antimeridian" in found.notes[-1]


def test_islands_on_the_antimeridian_and_beside_it_stay():
    """One is cut as the water is, by notches of its halves; the other is a hole of one half."""
    west = [[179.9, -17.0], [180, -17.0], [180, -16.99], [179.98, -16.99], [179.98, -16.97], [180, -16.97],
            [180, -16.95], [179.9, -16.95]]  # fmt: skip
    east = [[-180, -17.0], [-179.9, -17.0], [-179.9, -16.95], [-180, -16.95], [-180, -16.97],
            [-179.97, -16.97], [-179.97, -16.99], [-180, -16.99]]  # fmt: skip
    document = cut(west, east)
    document["coordinates"][0].append([*box(179.92, -16.99, 179.93, -16.98), [179.92, -16.99]])
    mission = imported(document, launch=Position(-16.96, 179.95))
    widths = sorted(
        (max(long) - min(long), len(long))
        for long in ([place.long % 360 for place in zone] for zone in mission.forbidden_zones)
    )
    assert [width for width, _ in widths] == pytest.approx([0.01, 0.05])


def test_waters_that_share_no_stretch_of_the_antimeridian_stay_apart():
    touching = cut(WEST, box(-180, -16.95, -179.9, -16.9), EAST, box(10, 46, 10.1, 46.1))
    with pytest.raises(InvalidMission, match="holds 2 polygons"):
        imported(touching, launch=NEAR_FIJI)
    corner = cut(WEST, box(-180, -16.95, -179.9, -16.9))
    with pytest.raises(InvalidMission, match="holds 2 polygons"):
        imported(corner, launch=NEAR_FIJI)
    shore = read(cut(WEST), launch=NEAR_FIJI)
    assert shore.notes == ()
    assert len(shore.mission.outline) == 4


def test_longitudes_are_counted_from_180_or_from_0():
    ring = [[long - 360, lat] for long, lat in OUTER]
    assert area_km2(imported({"type": "Polygon", "coordinates": [ring]})) == pytest.approx(86.0, rel=0.01)
    across = box(179.95, -17.02, -179.95, -16.95)
    assert area_km2(imported(cut(across), launch=NEAR_FIJI)) == pytest.approx(82.0, rel=0.02)
