"""Where commands write: nothing is overwritten that was not meant, and no plan is lost."""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from oxbow.errors import InvalidOption
from oxbow_cli.destination import Destination
from oxbow_cli.planning import _kept_recording
from oxbow_cli.scratch import scratch_folder

PLAN = b'{"plan": 1}\n'


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The folder for temporary files, for this test alone."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def lake(tmp_path):
    path = tmp_path / "lakes" / "lake.json"
    path.parent.mkdir()
    path.write_bytes(b"before")
    return path


def test_a_file_that_did_not_change_is_replaced(lake):
    Destination.of(lake).keep(PLAN)
    assert lake.read_bytes() == PLAN
    assert list(lake.parent.iterdir()) == [lake]


def test_a_new_file_is_made(lake):
    Destination.of(lake.with_name("new.json")).keep(PLAN)
    assert lake.with_name("new.json").read_bytes() == PLAN


@pytest.mark.parametrize("there_before", [True, False])
def test_an_edit_made_meanwhile_stays_and_the_plan_is_kept_beside_it(lake, there_before):
    if not there_before:
        lake.unlink()
    first, second = Destination.of(lake), Destination.of(lake)
    lake.write_bytes(b"edited")
    for destination, name in ((first, "lake.planned.json"), (second, "lake.planned-2.json")):
        with pytest.raises(InvalidOption, match="changed in the meantime") as caught:
            destination.keep(PLAN)
        assert f"kept in {str(lake.with_name(name))!r}" in str(caught.value)
        assert lake.with_name(name).read_bytes() == PLAN
    assert lake.read_bytes() == b"edited"


def test_a_removed_file_is_not_made_again(lake):
    destination = Destination.of(lake)
    lake.unlink()
    with pytest.raises(InvalidOption, match=r"lake\.planned\.json"):
        destination.keep(PLAN)
    assert not lake.exists()


def test_a_plan_whose_folder_is_gone_is_kept_among_the_temporary_files(lake, temporary):
    destination = Destination.of(lake)
    lake.unlink()
    lake.parent.rmdir()
    with pytest.raises(InvalidOption, match="kept in") as caught:
        destination.keep(PLAN)
    assert (temporary / "lake.planned.json").read_bytes() == PLAN
    assert str(temporary / "lake.planned.json") in str(caught.value)


def test_a_plan_that_fits_nowhere_leaves_nothing_half_written(lake, temporary):
    destination = Destination.of(lake)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4_096, before[1]))
    try:
        with pytest.raises(InvalidOption, match="File too large; the plan could not be kept anywhere"):
            destination.keep(b"x" * 10_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert lake.read_bytes() == b"before"
    assert list(lake.parent.iterdir()) == [lake]
    assert not list(temporary.iterdir())


def test_a_recording_that_cannot_be_kept_is_a_warning(tmp_path, lake, caplog):
    made = tmp_path / "made.rrd"
    made.write_bytes(b"recording")
    assert _kept_recording(made, lake / "recordings" / "lake.rrd") is None
    assert "the recording cannot be kept" in caplog.text
    assert _kept_recording(made, lake.parent / "recordings" / "lake.rrd").read_bytes() == b"recording"
    assert [path.name for path in (lake.parent / "recordings").iterdir()] == ["lake.rrd"]
    assert _kept_recording(made, lake) is None


def test_folders_of_commands_that_were_killed_are_swept_and_no_others(temporary):
    code = (
        "import time; from oxbow_cli.scratch import scratch_folder\n"
        "with scratch_folder() as folder: print(folder, flush=True); time.sleep(60)"
    )
    commands = [
        subprocess.Popen(
            [sys.executable, "-c", code],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"TMPDIR": str(temporary)},
        )
        for _ in range(2)
    ]
    folders = [command.stdout.readline().strip() for command in commands]
    commands[0].kill()
    commands[0].communicate()
    with scratch_folder():
        assert all(map(os.path.isdir, folders)), "too young to be swept"
    (temporary / "oxbow-plan-file").touch()
    (temporary / "oxbow-plan-link").symlink_to(temporary)
    (temporary / "another").mkdir()
    an_hour_ago = time.time() - 3600
    for path in temporary.iterdir():
        os.utime(path, (an_hour_ago, an_hour_ago), follow_symlinks=False)
    with scratch_folder() as own:
        names = {path.name for path in temporary.iterdir()} - {own.name}
    assert names == {Path(folders[1]).name, "oxbow-plan-file", "oxbow-plan-link", "another"}
    commands[1].kill()
    commands[1].communicate()


def test_a_mission_that_is_edited_while_it_is_planned_keeps_the_edit(folder, pond):
    """The prior is a pipe: the command has read the Mission File when it opens it, and waits for its content."""
    os.mkfifo(folder / "prior.json")
    command = subprocess.Popen(
        [sys.executable, "-m", "oxbow_cli", "plan", "pond.json", "--local", "--method", "Transect",
         "--prior", "prior.json"], cwd=folder, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    edited = json.dumps(pond(SiteName="Mere"))
    with (folder / "prior.json").open("w") as prior:
        (folder / "pond.json").write_text(edited)
        prior.write('{"type": "FeatureCollection", "features": []}')
    told = command.communicate(timeout=60)[1]
    assert command.returncode == 2
    assert "pond.json: was changed in the meantime, and is left as it is" in told
    assert (folder / "pond.json").read_text() == edited
    assert "Master_Path" in json.loads((folder / "pond.planned.json").read_text())
