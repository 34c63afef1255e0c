"""`oxbow plan --local`: the command without processes beside it."""

import json
import os

import pytest

QUICK = ("--method", "Transect")
"""Where the method does not matter."""


def test_completes_the_file_and_keeps_what_it_does_not_know(oxbow, folder):
    result = oxbow("plan", "pond.json", "--local")
    assert result.returncode == 0, result.stderr
    assert "Plan of Pond" in result.stdout
    mission = json.loads((folder / "pond.json").read_text())
    assert mission["note"] == "kept"
    assert mission["Master_Path"][0] == mission["Master_Path"][-1] == mission["LaunchPoint"]
    assert mission["Plan"]["method"] == "SpaceFillingCurve"


def test_only_transects_have_a_heading(oxbow):
    assert "heading" not in oxbow("plan", "pond.json", "--local", "--time-limit", 0.1).stdout
    assert "heading" in oxbow("plan", "pond.json", "--local", "-o", "legs.json", "--method", "Transect").stdout


def test_a_name_is_plain_text(oxbow, folder, pond):
    (folder / "pond.json").write_text(json.dumps(pond(SiteName="Pond [red] :fish: [/]")))
    told = oxbow("plan", "pond.json", "--local", *QUICK).stdout
    assert "Plan of Pond [red] :fish: [/]" in told


def test_writes_elsewhere_when_asked(oxbow, folder):
    before = (folder / "pond.json").read_bytes()
    result = oxbow(
        "plan", "pond.json", "--local", "-o", "planned.json", "--json", "--seed", 7, "--heading", 30, *QUICK
    )
    assert result.returncode == 0, result.stderr
    assert (folder / "pond.json").read_bytes() == before
    printed = json.loads(result.stdout)
    assert printed["file"] == "planned.json"
    assert printed["Plan"] == json.loads((folder / "planned.json").read_text())["Plan"]
    assert printed["Plan"]["heading_deg"] == pytest.approx(30.0)
    assert printed["Plan"]["seed"] == 7


@pytest.mark.parametrize(
    ("fields", "options", "status", "told"),
    [
        ({"Safety": 500.0}, [], 3, ["Safety"]),
        ({"MissionType": "treat"}, [], 2, ["PriorModel", "treat"]),
        ({}, ["--timeout", "0.01"], 4, ["--timeout"]),
        ({}, ["--method", "Spiral"], 2, ["--method", "Spiral", "Transect"]),
        ({}, ["--router", "compass"], 2, ["--router", "compass", "incenters"]),
        ({}, ["--prior", "prior.json"], 2, ["prior.json"]),
        ({}, ["--connect", "tcp/127.0.0.1:7447"], 2, ["--local", "--connect"]),
        ({}, ["--record", "pond.rrd"], 2, ["--record"]),
        ({}, ["-o", "missing/planned.json"], 2, ["missing/planned.json", "does not exist"]),
        ({}, ["-o", "."], 2, ["is a folder"]),
        ({}, ["--seed", str(2**54)], 2, ["error: --seed: is 18014398509481984", f"at most {2**53}"]),
        ({}, ["--seed", str(2**70)], 2, ["error: --seed: is an integer of 71 bits"]),
        ({}, ["--heading", "nan"], 2, ["--heading", "nan", "degrees"]),
    ],
)
def test_on_any_failure_the_file_is_untouched(oxbow, folder, pond, fields, options, status, told):
    file = folder / "pond.json"
    file.write_text(json.dumps(pond(**fields)))
    before = file.read_bytes()
    result = oxbow("plan", "pond.json", "--local", *options)
    assert result.returncode == status
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
    assert all(word in result.stderr for word in told)
    assert file.read_bytes() == before
    assert [path.name for path in folder.iterdir()] == ["pond.json"]


def test_a_recording_is_named_as_the_viewer_needs_it(oxbow, folder):
    result = oxbow("plan", "pond.json", "--record", "pond.txt")
    assert result.returncode == 2
    assert result.stderr == "error: --record: is 'pond.txt'; expected a name that ends in .rrd\n"
    assert [path.name for path in folder.iterdir()] == ["pond.json"]


@pytest.mark.parametrize("option", ["--timeout", "--time-limit"])
@pytest.mark.parametrize("seconds", ["inf", "nan", "1e308", "0", "-1", "1e-300", "86401"])
def test_no_time_without_end_or_beginning(oxbow, option, seconds):
    result = oxbow("plan", "pond.json", "--local", f"{option}={seconds}")
    assert result.returncode == 2
    assert result.stderr.startswith(f"error: {option}: is ")
    assert result.stderr.endswith("; expected seconds, 0.001 to 86400\n")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["-o", "prior.json", "--prior", "prior.json"], "prior.json: is also 'prior.json'"),
        (["--prior", "link.json", "-o", "prior.json"], "prior.json: is also 'link.json'"),
        (["-o", "fifo"], "fifo: cannot be written: is not a regular file"),
        (["-o", "kept.json"], "kept.json: cannot be written: is write-protected"),
        (["-o", "circle.json"], "circle.json: cannot be written: its symbolic links form a loop"),
        (["-o", "pond.json/planned.json"], "does not exist"),
        (["-o", "x" * 300], "File name too long"),
    ],
)
def test_what_cannot_be_written_is_told_before_planning(oxbow, folder, options, told):
    """Planning would end in another error: there is no method of that name."""
    (folder / "prior.json").write_text('{"type": "FeatureCollection", "features": []}')
    (folder / "link.json").symlink_to("prior.json")
    (folder / "kept.json").touch(mode=0o444)
    (folder / "circle.json").symlink_to("circle.json")
    os.mkfifo(folder / "fifo")
    result = oxbow("plan", "pond.json", "--local", "--method", "None", *options)
    assert result.returncode == 2
    assert told in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_recording_takes_the_place_of_no_other_file(oxbow, folder):
    (folder / "pond.rrd").write_bytes((folder / "pond.json").read_bytes())
    result = oxbow("plan", "pond.rrd", "--record", "pond.rrd", "--method", "None")
    assert result.returncode == 2
    assert result.stderr.startswith("error: pond.rrd: is also 'pond.rrd'")
