import json
import subprocess
import sys
from pathlib import Path

import pytest

REFEREE = Path(__file__).parents[2] / "../shared/referee/referee.py"


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


def test_equals_the_referee_within_one_percent(oxbow, walked):
    if not REFEREE.exists():
        pytest.skip("no referee beside this checkout")
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
