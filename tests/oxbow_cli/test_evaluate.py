import json
import subprocess
import sys

import pytest

from oxbow.mission.file import Mission, parse_mission
from oxbow_cli.comparison import compare
from tests.support.real_lakes import REFEREE, needs_referee


def mission(document) -> Mission:
    return parse_mission(json.dumps(document).encode())


@pytest.fixture
def walked(folder, pond, rows):
    path = folder / "walked.json"
    path.write_text(json.dumps(pond(Master_Path=rows)))
    return path


def test_measures_of_a_hand_made_path(oxbow, walked):
    found = json.loads(oxbow("evaluate", walked, "--json").stdout)
    assert found["crossings"] > 0
    assert not found["is_simple"]
    assert 200 < found["outside_m"] < 400
    assert found["starts_at_launch_m"] == found["ends_at_recovery_m"] == 0
    assert found["length_ratio"] == pytest.approx(found["length_m"] / 6000.0)
    low, high = found["cover_radius_m"]
    assert 10.0 <= low <= high <= low * 1.011
    assert found["judged_area"] == 1.0


def test_table_shows_every_measure(oxbow, walked):
    result = oxbow("evaluate", walked)
    assert result.returncode == 0
    names = json.loads(oxbow("evaluate", walked, "--json").stdout)
    assert all(name in result.stdout for name in names)


def test_a_comparison_says_who_is_better_at_what(oxbow, folder, pond, rows):
    every_third = [row for k in range(1, len(rows) - 1, 6) for row in rows[k : k + 2]]
    (folder / "dense.json").write_text(json.dumps(pond(Master_Path=rows)))
    (folder / "sparse.json").write_text(json.dumps(pond(Master_Path=[rows[0], *every_third, rows[-1]])))
    found = json.loads(oxbow("evaluate", "--compare", "dense.json", "sparse.json", "--json").stdout)
    assert found["files"] == ["dense.json", "sparse.json"]
    assert found["differences"] == []
    assert "mean_distance_m" in found["first_better"]
    assert {"outside_m", "turns", "least_leg_distance_m"} <= set(found["second_better"])
    assert not set(found["first_better"]) & set(found["second_better"])
    assert any("crosses itself" in rule for rule in found["first_breaks"])
    printed = oxbow("evaluate", "--compare", "dense.json", "sparse.json").stdout
    marked = f"* {found['first']['mean_distance_m']:.6g}"
    assert next(line for line in printed.splitlines() if marked in line).split()[0] == "mean_distance_m"
    assert "sparse.json: crosses itself" in printed
    assert "warning" not in printed


def test_a_path_is_as_good_as_itself(pond, rows):
    found = compare(mission(pond(Master_Path=rows)), mission(pond(Master_Path=rows)))
    assert found.first_better == found.second_better == ()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda _: {"Master_length": 7000.0}, "Master_length: 6000 and 7000 m"),
        (lambda _: {"Safety": 2.0}, "Safety: 5 and 2 m"),
        (lambda _: {"ForbiddenZones": []}, "ForbiddenZones: 1 and 0"),
        (lambda pond: {"BoundingBox": pond["BoundingBox"][:-1]}, "BoundingBox: "),
    ],
    ids=["length", "safety", "zones", "outline"],
)
def test_different_missions_are_told_apart(pond, rows, change, told):
    first, second = mission(pond(Master_Path=rows)), mission(pond(Master_Path=rows, **change(pond())))
    found = compare(first, second)
    assert [difference[: len(told)] for difference in found.differences] == [told]
    better = {*found.first_better, *found.second_better}
    assert not better & {"cover_radius_m", "mean_distance_m", "turns", "least_leg_distance_m"}


def test_the_same_water_written_otherwise_is_the_same_mission(pond, rows):
    outline = pond()["BoundingBox"]
    turned = outline[2::-1] + outline[:2:-1]
    assert not compare(
        mission(pond(Master_Path=rows)), mission(pond(Master_Path=rows, BoundingBox=turned))
    ).differences


def test_differences_are_printed(oxbow, folder, pond, walked, rows):
    (folder / "other.json").write_text(json.dumps(pond(Master_Path=rows, Master_length=7000.0)))
    printed = oxbow("evaluate", "--compare", walked, "other.json").stdout
    assert "warning: not the same mission: Master_length: 6000 and 7000 m" in printed


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (lambda pond: pond(), "other.json: Master_Path: has 0 waypoints"),
        (lambda pond: pond(Safety=-1.0), "other.json: Safety: is -1.0"),
        (
            lambda pond: pond(Safety=500.0, Master_Path=[pond()["LaunchPoint"]] * 2 + [pond()["BoundingBox"][1]]),
            "other.json: Safety: ",
        ),
        (lambda _: [], "other.json: is []; expected an object"),
    ],
    ids=["no path", "field", "geometry", "no object"],
)
def test_of_two_files_the_wrong_one_is_named(oxbow, folder, pond, walked, content, told):
    (folder / "other.json").write_text(json.dumps(content(pond)))
    for files in ((walked, "other.json"), ("other.json", walked)):
        result = oxbow("evaluate", "--compare", *files)
        assert result.returncode in (2, 3)
        assert told in result.stderr
        assert "walked.json" not in result.stderr


@pytest.mark.parametrize(
    "arguments", [[], ["pond.json", "--compare", "pond.json", "pond.json"]], ids=["none", "both"]
)
def test_one_file_or_two_to_compare(oxbow, arguments):
    result = oxbow("evaluate", *arguments)
    assert result.returncode == 2
    assert "--compare" in result.stderr


@needs_referee
def test_equals_the_referee_within_one_percent(oxbow, walked):
    found = json.loads(oxbow("evaluate", walked, "--json").stdout)
    judged = subprocess.run(
        [sys.executable, REFEREE, walked, "--json"], capture_output=True, text=True, check=True
    ).stdout
    for name, value in json.loads(judged).items():
        if name != "failed":
            assert found[name] == pytest.approx(value, rel=0.01, abs=1e-6), name


def test_a_file_without_a_path_is_invalid_input(oxbow):
    result = oxbow("evaluate", "pond.json")
    assert result.returncode == 2
    assert "Master_Path" in result.stderr


def test_a_path_of_one_place_is_invalid_input(oxbow, folder, pond):
    (folder / "still.json").write_text(json.dumps(pond(Master_Path=[pond()["LaunchPoint"]] * 3)))
    result = oxbow("evaluate", "still.json")
    assert result.returncode == 2
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
