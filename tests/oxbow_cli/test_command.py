"""What all commands have in common: help, one line for each error, and the exit status that goes with it."""

import json
import os
import signal
import subprocess
import sys
from importlib.metadata import version

import pytest

COMMANDS = ("plan", "up", "status", "evaluate", "picture", "inspect", "import")


def test_version(oxbow):
    assert oxbow("--version").stdout == f"oxbow {version('oxbow')}\n"


def test_help_lists_every_command(oxbow):
    result = oxbow("--help")
    assert result.returncode == 0
    assert all(f" {command} " in result.stdout for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_gives_an_example(oxbow, command):
    result = oxbow(command, "--help")
    assert result.returncode == 0
    assert f"oxbow {command}" in result.stdout.partition("Example")[2]


def test_usage_errors_are_invalid_input(oxbow):
    assert oxbow("plan").returncode == 2
    assert oxbow("plan", "pond.json", "--no-such-option").returncode == 2
    assert oxbow("no-such-command").returncode == 2


@pytest.mark.parametrize("arguments", [["plan", "--local"], ["plan"], ["evaluate"], ["picture", "-o", "a.png"]])
def test_a_file_that_is_not_there_is_invalid_input(oxbow, arguments):
    command, *options = arguments
    result = oxbow(command, "nothing.json", *options)
    assert result.returncode == 2
    assert result.stderr == "error: nothing.json: cannot be read: No such file or directory\n"


def test_an_error_names_the_field_and_the_value_in_one_line(oxbow, folder, pond):
    (folder / "bad.json").write_text(json.dumps(pond(Safety=-3.0)))
    result = oxbow("plan", "bad.json", "--local")
    assert result.returncode == 2
    assert result.stderr == "error: Safety: is -3.0; expected a number from 0 to 2.1e+07\n"
    assert result.stdout == ""


@pytest.mark.parametrize("arguments", [["plan", "--local"], ["evaluate"], ["picture", "-o", "a.png"]])
def test_a_file_that_is_no_json_is_named(oxbow, folder, arguments):
    (folder / "typo.json").write_text('{"MissionType": map}')
    command, *options = arguments
    result = oxbow(command, "typo.json", *options)
    assert result.returncode == 2
    assert result.stderr.startswith("error: typo.json: is not JSON")


def test_a_traceback_is_shown_only_when_asked_for(oxbow):
    assert "Traceback" not in oxbow("evaluate", "pond.json").stderr
    assert "Traceback" in oxbow("--debug", "evaluate", "pond.json").stderr


def shadowed(folder, module, code):
    """A folder that holds a module in place of another, to be put in PYTHONPATH."""
    (folder / "shadow").mkdir()
    (folder / "shadow" / f"{module}.py").write_text(code)
    return str(folder / "shadow")


@pytest.fixture
def heard_hangup():
    """SIGHUP as a terminal sends it: tests that run under `nohup` would have commands ignore it, and rightly."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize(("number", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
@pytest.mark.parametrize("command", [["plan", "--local"], ["evaluate"], ["picture", "-o", "pond.png"]])
@pytest.mark.usefixtures("heard_hangup")
def test_a_signal_ends_the_command_whatever_it_is_at(oxbow, folder, number, status, command):
    """Here, it comes while a library is imported that takes every exception for a fault of its own."""
    code = (
        "import os, signal\n"
        f"try:\n    os.kill(os.getpid(), signal.{number}); [0 for _ in range(9)]\n"
        "except BaseException as error:\n    raise ImportError('broken') from error\n"
    )
    first, *options = command
    result = oxbow(first, "pond.json", *options, PYTHONPATH=shadowed(folder, "shapely", code))
    assert (result.returncode, result.stdout, result.stderr) == (status, "", "")


def test_what_should_not_be_left_half_done_ends_before_the_command_does():
    code = (
        "import os, signal\nfrom oxbow_cli.interrupts import ending\nending.begin()\n"
        "try:\n    with ending.orderly():\n"
        "        with ending.holding_signals():\n            os.kill(os.getpid(), signal.SIGINT); print('held')\n"
        "        print('not reached')\n"
        "finally:\n    print('left in order')\n"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout.split("\n")) == (130, ["held", "left in order", ""])


def test_a_terminal_without_the_characters_shows_escapes(oxbow, folder):
    (folder / "Étang.rrd").touch()
    result = oxbow("inspect", "Étang.rrd", PYTHONIOENCODING="ascii")
    assert result.returncode == 0
    assert result.stdout.startswith("\\xc9tang.rrd\n")


@pytest.mark.parametrize("arguments", [["plan", "--local"], ["evaluate"], ["picture", "-o", "a.png"]])
@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("empty.json", "is empty"),
        ("folder.json", "cannot be read: Is a directory"),
        ("fifo.json", "cannot be read: is a pipe that nobody writes to"),
        ("circle.json", "symbolic links"),
        ("gone.json", "No such file"),
    ],
)
def test_what_is_no_file_is_told_in_one_line(oxbow, folder, arguments, name, told):
    (folder / "empty.json").touch()
    (folder / "folder.json").mkdir()
    os.mkfifo(folder / "fifo.json")
    (folder / "circle.json").symlink_to("circle.json")
    (folder / "gone.json").symlink_to("nothing.json")
    command, *options = arguments
    if command == "plan":
        options += ["-o", "planned.json"]
    result = oxbow(command, name, *options)
    assert result.returncode == 2
    assert result.stderr.startswith(f"error: {name}: ")
    assert result.stderr.count("\n") == 1
    assert told in result.stderr


def test_a_mission_is_read_from_a_pipe(folder, environment):
    command = [sys.executable, "-m", "oxbow_cli", "picture", "/dev/stdin", "-o", "pond.svg"]
    text = (folder / "pond.json").read_text()
    result = subprocess.run(command, input=text, cwd=folder, env=environment, text=True, check=False)
    assert result.returncode == 0


def test_an_input_is_not_overwritten(oxbow, folder):
    (folder / "pond.svg").write_bytes((folder / "pond.json").read_bytes())
    before = (folder / "pond.svg").read_bytes()
    assert oxbow("picture", "pond.svg", "-o", "pond.svg").returncode == 2
    assert oxbow("import", "pond.svg", "--launch", "1,2", "-o", "pond.svg").returncode == 2
    assert (folder / "pond.svg").read_bytes() == before


def test_a_home_that_is_no_folder_is_told_before_anything_is_started(oxbow):
    result = oxbow("up", "--home", "pond.json")
    assert (result.returncode, result.stderr) == (2, "error: pond.json: cannot be written: File exists\n")
