"""Missions of several vehicles on the command line: planned, evaluated, compared and drawn."""

import json
import os

import pytest
from msgspec.structs import replace

from oxbow.contracts import Leg
from oxbow.mission.file import read_mission
from oxbow.site.site import Site
from oxbow_cli import chart, report, sheet
from oxbow_cli.picture import DANGER
from oxbow_cli.planning import PlannedMission
from tests.support.project import EXAMPLES

TREAT, FLEET = EXAMPLES / "treat.json", EXAMPLES / "fleet.json"


@pytest.fixture(scope="module")
def treated_once(warm_commands, tmp_path_factory):
    """The table that `oxbow plan` prints, and the file that it writes."""
    folder = tmp_path_factory.mktemp("treated")
    command = ["plan", str(TREAT), "--local", "-o", "treated.json"]
    result = warm_commands.run(command, cwd=folder, env=os.environ | {"COLUMNS": "160"}, output=folder)
    assert result.returncode == 0, result.stderr
    return result.stdout, (folder / "treated.json").read_bytes()


@pytest.fixture
def treated(folder, treated_once):
    table, file = treated_once
    (folder / "treated.json").write_bytes(file)
    return table


def test_the_table_tells_what_each_vehicle_does_and_what_is_left(treated):
    assert "tern" in treated
    assert "treats features[0]" in treated
    assert "100.0% treated" in treated
    assert "further sortie" in treated
    assert "passes over hot spots" in treated
    assert "half a swath is 5.0 m" in treated
    assert "least possible" not in treated
    assert "danger 0.0%" in treated
    assert "0.0% probability of harm" in treated


@pytest.mark.usefixtures("treated")
def test_every_vehicle_is_evaluated(oxbow):
    found = json.loads(oxbow("evaluate", "treated.json", "--json").stdout)
    assert [vehicle["name"] for vehicle in found["vehicles"]] == ["tern", "gull"]
    assert found["length_m"] == pytest.approx(sum(vehicle["length_m"] for vehicle in found["vehicles"]))
    assert found["length_ratio"] == max(vehicle["length_ratio"] for vehicle in found["vehicles"])
    assert [vehicle["danger"] for vehicle in found["vehicles"]] == [0.0, 0.0]
    assert "Path of gull" in oxbow("evaluate", "treated.json").stdout


@pytest.mark.usefixtures("treated")
def test_a_path_of_a_vehicle_that_takes_no_part_is_named(oxbow, folder):
    mission = json.loads((folder / "treated.json").read_text())
    mission["Paths"][0]["Name"] = "auk"
    (folder / "treated.json").write_text(json.dumps(mission))
    result = oxbow("evaluate", "treated.json")
    assert result.returncode == 2
    assert "Paths: has a path of 'auk'; expected one of tern, gull" in result.stderr


@pytest.mark.usefixtures("treated")
def test_all_paths_are_drawn_with_their_names(oxbow, folder):
    assert oxbow("picture", "treated.json", "-o", "treated.svg").returncode == 0
    drawn = (folder / "treated.svg").read_text()
    assert all(text in drawn for text in ("tern", "gull", "3 of 4 hot spots treated", DANGER))
    assert "widest gap" not in drawn
    assert oxbow("picture", "treated.json", "--gaps", "-o", "gaps.svg").returncode == 0
    assert "in half swaths of 5 m" in (folder / "gaps.svg").read_text()


def test_the_start_that_a_vehicle_has_to_itself_is_drawn():
    site = Site.of(read_mission(FLEET))
    _, axes = sheet.new_sheet(site)
    chart.draw_ends(axes, site)
    assert [text.get_text() for text in axes.texts] == ["launch and recovery", "coot: launch and recovery"]


@pytest.mark.usefixtures("treated")
def test_what_legs_of_a_fleet_need_over_land_is_reported_by_itself(folder, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    mission = read_mission(folder / "treated.json")
    plan, possible = mission.plan, {"least_ashore_m": 0.0, "most_unsafe_m": 20.0}
    legs = (Leg(ashore_m=1.01, unsafe_m=12.0, **possible), Leg(ashore_m=0.5, unsafe_m=3.0, **possible))
    own = {"outside_m": 1.51, "unsafe_m": 0.0}
    vehicles = tuple(
        replace(each, certificate=replace(each.certificate, legs=(leg,)))
        for each, leg in zip(plan.fleet.vehicles, legs, strict=True)
    )
    plan = replace(
        plan, certificate=replace(plan.certificate, **own), fleet=replace(plan.fleet, vehicles=vehicles)
    )
    report.print_plan(PlannedMission(replace(mission, plan=plan), None), folder / "treated.json")
    told = capsys.readouterr().out
    assert "0.00 m outside, 0.00 m within Safety; on its legs 1.51 m over land, 15 m within Safety" in told
