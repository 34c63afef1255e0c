"""The Mission File: what it accepts, what it refuses and how it says so, and how it is written."""

import json
import math
import os
import resource
import stat

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oxbow.contracts import MAX_REQUEST_BYTES, Method
from oxbow.errors import Infeasible, InvalidMission
from oxbow.mission.file import Mission, mission_json, parse_mission, read_mission, write_mission
from oxbow.mission.plan import PlanOptions
from oxbow.planning.pipeline import plan_mission
from oxbow.site.site import Site
from oxbow_cli.local import local_call
from tests.support.project import EXAMPLES, SCHEMA

MISSIONS = sorted(EXAMPLES.glob("*.json"))


def at(lat, long):
    return {"lat": lat, "long": long}


SQUARE = [at(46.0, 1.0), at(46.0, 1.02), at(46.02, 1.02), at(46.02, 1.0)]


def given_mission(**changes):
    fields = {"MissionType": "map", "LaunchPoint": at(46.0, 1.0), "BoundingBox": SQUARE} | changes
    return {name: value for name, value in fields.items() if value is not ...}


def parsed(**changes):
    return parse_mission(json.dumps(given_mission(**changes)).encode())


def site(**changes):
    return Site.of(parsed(**changes))


def test_defaults_are_the_reports():
    mission = parsed()
    assert (mission.master_speed_mps, mission.slave_speed_mps) == (1.0, 0.5)
    assert (mission.master_length_m, mission.slave_length_m, mission.safety_m) == (20_000.0, 15_000.0, 0.0)
    assert mission.recovery is None
    assert Site.of(mission).launch == Site.of(mission).recovery


@pytest.mark.parametrize(
    ("changes", "where", "says"),
    [
        ({"MissionType": ...}, "MissionType", "missing"),
        ({"MissionType": "mapp"}, "MissionType", "mapp"),
        ({"LaunchPoint": ...}, "LaunchPoint", "missing"),
        ({"LaunchPoint": [46.0, 1.0]}, "LaunchPoint", "lat"),
        ({"LaunchPoint": "46, 1"}, "LaunchPoint", "46, 1"),
        ({"LaunchPoint": at("46", 1.0)}, "LaunchPoint.lat", "46"),
        ({"LaunchPoint": at(True, 1.0)}, "LaunchPoint.lat", "true"),
        ({"LaunchPoint": {"lat": 46.0}}, "LaunchPoint", "long"),
        ({"LaunchPoint": at(46.0, 1.0) | {"alt": 3}}, "LaunchPoint", "alt"),
        ({"BoundingBox": [*SQUARE, at(95.2, 1.0)]}, "BoundingBox[4].lat", "95.2"),
        ({"BoundingBox": [*SQUARE, at(120.0, 46.0)]}, "BoundingBox[4].lat", "swapped"),
        ({"BoundingBox": [*SQUARE, at(46.0, 999.0)]}, "BoundingBox[4].long", "999"),
        ({"ForbiddenZones": [SQUARE, [*SQUARE, at(-91.0, 0.0)]]}, "ForbiddenZones[1][4].lat", "-91"),
        ({"Safety": -1}, "Safety", "-1"),
        ({"Master_length": 0}, "Master_length", "0"),
        ({"Master_speed": -2.5}, "Master_speed", "-2.5"),
        ({"Minimal_spatial_rate": 0}, "Minimal_spatial_rate", "0"),
        ({"Master_length": "far"}, "Master_length", "far"),
        ({"MissionType": "adap"}, "Bloom", "missing"),
        ({"MissionType": "adap", "Bloom": {"Sensor": "chl"}}, "Bloom", "Value"),
        ({"InBox": SQUARE}, "InBox", "BoundingBox"),
    ],
)
def test_errors_name_the_field_and_the_value(changes, where, says):
    with pytest.raises(InvalidMission) as caught:
        parsed(**changes)
    assert where in caught.value.where or where in str(caught.value)
    assert says in str(caught.value)


@pytest.mark.parametrize("text", [b"", b"{", b"[]", b"nonsense", b'{"a": 1} trailing', b"\xff\xfe", b"null"])
def test_what_is_not_a_json_object_is_refused(text):
    with pytest.raises(InvalidMission, match="Mission File"):
        parse_mission(text)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_are_not_finite_are_refused(number):
    text = json.dumps(given_mission(Master_length=-7.5)).replace("-7.5", number)
    with pytest.raises(InvalidMission):
        parse_mission(text.encode())


def test_a_file_over_the_limit_is_refused():
    with pytest.raises(InvalidMission, match="at most"):
        parse_mission(b" " * (MAX_REQUEST_BYTES + 1))


@pytest.mark.parametrize(
    "outline",
    [
        [*SQUARE, SQUARE[0]],
        [SQUARE[0], SQUARE[0], *SQUARE, SQUARE[3]],
        SQUARE[::-1],
        SQUARE[2:] + SQUARE[:2],
    ],
    ids=["closed", "duplicates", "reversed", "rotated"],
)
def test_the_same_outline_gives_the_same_site(outline):
    assert site(BoundingBox=outline).outline.equals_exact(site().outline, 1e-6)


@pytest.mark.parametrize("outline", [SQUARE[:2], [SQUARE[0]] * 5, [SQUARE[0], SQUARE[1]] * 3, []])
def test_fewer_than_three_distinct_points_are_refused(outline):
    with pytest.raises(InvalidMission, match="at least 3"):
        site(BoundingBox=outline)


def test_points_on_one_line_are_refused():
    with pytest.raises(InvalidMission, match="on one line"):
        site(BoundingBox=[at(46.0, 1.0), at(46.01, 1.0), at(46.02, 1.0)])


def test_a_crossing_outline_is_refused_with_the_place():
    bow_tie = [SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]
    with pytest.raises(InvalidMission) as caught:
        site(BoundingBox=bow_tie)
    message = str(caught.value)
    assert "46.01" in message
    assert "1.01" in message
    assert "edge from point" in message


def test_the_older_name_of_the_outline_is_kept():
    mission = parsed(BoundingBox=..., InBox=SQUARE)
    written = json.loads(mission_json(mission))
    assert "InBox" in written
    assert "BoundingBox" not in written
    with pytest.raises(InvalidMission, match=r"InBox\[4\]"):
        parsed(BoundingBox=..., InBox=[*SQUARE, at(99.0, 0.0)])


def test_a_site_that_reaches_farther_than_300_km_is_refused():
    def strip(east):
        return [at(46.0, 1.0), at(46.0, east), at(46.1, east), at(46.1, 1.0)]

    with pytest.raises(InvalidMission, match="300 km"):
        site(BoundingBox=strip(9.2))
    assert site(BoundingBox=strip(8.0)).outline.area > 0


def test_a_launch_point_far_away_is_refused_and_a_swap_is_suspected():
    with pytest.raises(InvalidMission, match="LaunchPoint"):
        site(LaunchPoint=at(20.0, 1.0))
    with pytest.raises(InvalidMission, match="swapped"):
        site(LaunchPoint=at(1.0, 46.0))


def zone(south, west, north, east):
    return [at(south, west), at(south, east), at(north, east), at(north, west)]


def test_zones_may_overlap_touch_cross_and_split():
    zones = [
        zone(46.005, 1.005, 46.010, 1.010),
        zone(46.008, 1.008, 46.012, 1.012),
        zone(46.0, 1.015, 46.02, 1.016),
        zone(46.015, 0.99, 46.018, 1.003),
    ]
    assert len(site(ForbiddenZones=zones).zones) == 4


def test_a_zone_outside_is_a_warning_with_its_index():
    warnings = site(ForbiddenZones=[zone(46.005, 1.005, 46.01, 1.01), zone(47.0, 2.0, 47.1, 2.1)]).warnings
    assert len(warnings) == 1
    assert "ForbiddenZones[1]" in warnings[0]


def test_zones_that_cover_everything_are_infeasible():
    with pytest.raises(Infeasible, match="ForbiddenZones"):
        site(ForbiddenZones=[zone(45.9, 0.9, 46.1, 1.1)])


def test_a_site_across_the_antimeridian_is_planar():
    east = [at(-17.0, 179.95), at(-17.0, -179.95), at(-16.9, -179.95), at(-16.9, 179.95)]
    here = [at(-17.0, 9.95), at(-17.0, 10.05), at(-16.9, 10.05), at(-16.9, 9.95)]
    across = site(BoundingBox=east, LaunchPoint=east[0])
    assert across.outline.area == pytest.approx(site(BoundingBox=here, LaunchPoint=here[0]).outline.area, rel=1e-9)


json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**40), 2**40)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=60)
@given(
    extra=st.dictionaries(st.text(min_size=1, max_size=8).map(lambda name: f"x-{name}"), json_values, max_size=3),
    safety=st.floats(0, 1e4),
    length=st.floats(1e-3, 1e7),
    shift=st.floats(-30, 30),
    name=st.none() | st.text(max_size=10),
)
def test_round_trip_keeps_everything(extra, safety, length, shift, name):
    outline = [at(point["lat"] + shift, point["long"] + shift) for point in SQUARE]
    changes = {"Safety": safety, "Master_length": length, "BoundingBox": outline, "SiteName": name} | extra
    mission = parsed(**changes)
    again = parse_mission(mission_json(mission))
    assert again == mission
    assert again.extra == extra


@pytest.mark.parametrize("path", MISSIONS, ids=lambda path: path.stem)
def test_examples_are_missions(path):
    mission = read_mission(path)
    assert isinstance(mission, Mission)
    assert Site.of(mission).warnings == ()
    assert parse_mission(mission_json(mission)) == mission


def test_a_file_is_replaced_as_a_whole_and_keeps_its_mode(tmp_path):
    target, link = tmp_path / "lake.json", tmp_path / "link.json"
    target.write_bytes(b"old")
    target.chmod(0o640)
    link.symlink_to(target)
    write_mission(link, parsed())
    assert link.is_symlink()
    assert read_mission(target) == parsed()
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    assert sorted(tmp_path.iterdir()) == [target, link]


def test_what_is_no_regular_file_is_not_replaced(tmp_path):
    fifo = tmp_path / "lake.json"
    os.mkfifo(fifo)
    with pytest.raises(OSError, match="regular"):
        write_mission(fifo, parsed())
    assert fifo.is_fifo()


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "lake.json"
    target.write_bytes(b"old")
    pid = os.fork()
    if pid == 0:
        import signal

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64))
        try:
            write_mission(target, parsed())
        except OSError:
            os._exit(7)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 7
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_million_points_are_read():
    turn = np.linspace(0, 2 * math.pi, 1_000_000, endpoint=False)
    outline = ",".join(
        f'{{"lat":{46 + 0.5 * math.sin(t):.9f},"long":{1 + 0.5 * math.cos(t):.9f}}}' for t in turn.tolist()
    )
    text = '{"MissionType":"map","LaunchPoint":{"lat":46.0,"long":1.5},"BoundingBox":[' + outline + "]}"
    assert len(parse_mission(text.encode()).outline) == 1_000_000


@pytest.mark.parametrize("path", MISSIONS, ids=lambda path: path.stem)
def test_examples_and_their_plans_follow_the_schema(path):
    validator = jsonschema.Draft202012Validator(SCHEMA)
    validator.validate(json.loads(path.read_text()))
    completed = plan_mission(
        read_mission(path), PlanOptions(method=Method.TRANSECT, time_limit_s=1e-3), call=local_call()
    )
    validator.validate(json.loads(mission_json(completed)))


@pytest.mark.parametrize(
    "changes",
    [
        {"MissionType": "mapp"},
        {"LaunchPoint": [46.0, 1.0]},
        {"BoundingBox": SQUARE[:2]},
        {"Safety": -1},
        {"Master_length": 0},
        {"MissionType": "adap"},
        {"InBox": SQUARE},
        {"Swath": 0.0},
        {"Vehicles": [{"Name": "", "Role": "master"}]},
        {"Vehicles": [{"Name": "a", "Role": "captain"}]},
        {"Vehicles": [{"Name": "a", "Role": "master", "Length": 0.0}]},
        {"Vehicles": [{"Name": "a", "Role": "master", "Start": {"lat": 95.0, "long": 1.0}}]},
    ],
)
def test_the_schema_refuses_what_the_parser_refuses(changes):
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(given_mission(**changes), SCHEMA)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-32"])
def test_a_byte_order_mark_is_skipped(encoding):
    text = json.dumps(given_mission(SiteName="Étang"), ensure_ascii=False)
    assert parse_mission(text.encode(encoding)) == parsed(SiteName="Étang")
