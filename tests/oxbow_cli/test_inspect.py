import os


def test_without_a_screen_it_says_where_the_recording_is_and_how_to_open_it(oxbow, folder):
    recording = folder / "home" / "recordings" / "pond.rrd"
    recording.parent.mkdir(parents=True)
    recording.touch()
    result = oxbow("inspect", "pond")
    assert result.returncode == 0
    assert result.stdout.splitlines()[0] == str(recording)
    assert "rerun pond.rrd" in result.stdout


def test_opens_the_viewer_where_there_is_a_screen(oxbow, folder):
    """A stand-in for the viewer's module tells what it was given."""
    (folder / "rerun.py").write_text("import sys; print('viewer', *sys.argv[1:]); sys.exit(7)")
    (folder / "own.rrd").touch()
    result = oxbow("inspect", "own.rrd", DISPLAY=":9", PYTHONPATH=os.fspath(folder), PYTHONUNBUFFERED="1")
    assert "viewer own.rrd" in result.stdout
    assert result.returncode == 7


def test_an_unknown_mission_is_invalid_input_and_lists_the_known(oxbow, folder):
    (folder / "home" / "recordings").mkdir(parents=True)
    (folder / "home" / "recordings" / ".pond.0123.part.rrd").touch()
    (folder / "home" / "recordings" / "lake.rrd").touch()
    result = oxbow("inspect", "pond")
    assert result.returncode == 2
    assert "there are lake" in result.stderr
    assert "part" not in result.stderr


def test_of_many_recordings_some_are_named(oxbow, folder):
    (folder / "home" / "recordings").mkdir(parents=True)
    for number in range(1_000):
        (folder / "home" / "recordings" / f"lake{number}.rrd").touch()
    result = oxbow("inspect", "pond")
    assert "lake1," in result.stderr
    assert "and 980 more" in result.stderr


def test_an_id_is_no_way_out_of_the_folder(oxbow):
    result = oxbow("inspect", "../../secret")
    assert result.returncode == 2
    assert "of A-Z a-z 0-9" in result.stderr
