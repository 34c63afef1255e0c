"""What all commands have in common: help, one line for each error, and the exit status that goes with it."""

import json
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
    assert result.stderr == "error: Safety: is -3.0; expected a finite number >= 0\n"
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
