"""The embedded stack: planned on, looked at, killed in parts and as a whole; no process is ever left behind."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import psutil
import pytest

from oxbow import Client
from oxbow.bus.router import free_endpoint
from oxbow_cli.stack import SERVICES

pytestmark = pytest.mark.processes

OXBOW = (sys.executable, "-m", "oxbow_cli")
GONE_S = 10.0


def until(condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
    """Wait for a condition that other processes bring about."""
    give_up = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < give_up
        time.sleep(0.02)


def running(processes: list[psutil.Process]) -> list[psutil.Process]:
    """Those that still run; what waits to be reaped by its new parent does not."""
    return [process for process in processes if process.is_running() and process.status() != psutil.STATUS_ZOMBIE]


def family(process: subprocess.Popen[str]) -> list[psutil.Process]:
    return psutil.Process(process.pid).children(recursive=True)


def child(process: subprocess.Popen[str], module: str) -> psutil.Process:
    (found,) = [one for one in psutil.Process(process.pid).children() if module in one.cmdline()]
    return found


@pytest.fixture
def start(folder, environment) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start the command, and have it ended with the test."""
    started = []

    def run(*arguments: str, **more: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [*OXBOW, *arguments],
            cwd=folder,
            env=environment | more,
            stdout=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield run
    for process in started:
        process.terminate()
        process.communicate(timeout=30)


def test_plan_over_a_stack_of_its_own(oxbow, folder):
    result = oxbow("plan", "pond.json", "--record", "recordings/pond.rrd")
    assert result.returncode == 0, result.stderr
    mission = json.loads((folder / "pond.json").read_text())
    assert mission["note"] == "kept"
    assert mission["Plan"]["revision"] == 1
    assert (folder / "recordings" / "pond.rrd").stat().st_size > 0
    assert "recordings/pond.rrd" in result.stdout
    assert "oxbow inspect" in result.stdout


def test_a_recorder_that_does_not_start_costs_the_recording_alone(oxbow, folder):
    (folder / "oxbow_recorder.py").write_text("raise SystemExit(3)")
    result = oxbow("plan", "pond.json", PYTHONPATH=str(folder))
    assert result.returncode == 0, result.stderr
    assert "without recordings" in result.stderr
    assert "recording" not in result.stdout
    assert not list(folder.glob("**/*.rrd"))


def test_a_fault_of_the_mission_is_told_as_without_the_bus(oxbow, folder, pond):
    (folder / "pond.json").write_text(json.dumps(pond(Safety=500.0)))
    over_the_bus, here = oxbow("plan", "pond.json"), oxbow("plan", "pond.json", "--local")
    assert over_the_bus.returncode == here.returncode == 3
    assert over_the_bus.stderr == here.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_plan_leaves_no_process_and_no_trace(start, folder, number):
    before = (folder / "pond.json").read_bytes()
    plan = start("plan", "pond.json")
    until(lambda: len(family(plan)) > len(SERVICES))
    child(plan, "oxbow_path").suspend()  # it can neither get ready nor hear that it should end
    processes = family(plan)
    plan.send_signal(number)
    assert plan.communicate(timeout=GONE_S)[0] == ""
    assert plan.returncode == 128 + number
    until(lambda: not running(processes), GONE_S)
    assert (folder / "pond.json").read_bytes() == before


def test_processes_end_with_a_command_that_is_killed(start):
    plan = start("plan", "pond.json")
    until(lambda: len(family(plan)) > len(SERVICES))
    processes = family(plan)
    plan.kill()
    until(lambda: not running(processes), GONE_S)


def test_without_a_router_there_is_nothing_to_plan_on(oxbow):
    result = oxbow("plan", "pond.json", "--connect", free_endpoint())
    assert result.returncode == 4
    assert "oxbow up" in result.stderr


@pytest.mark.parametrize(
    "arguments", [["plan", "pond.json", "--connect", "nowhere"], ["status", "--connect", "nowhere"]]
)
def test_an_endpoint_that_is_none_is_invalid_input(oxbow, arguments):
    result = oxbow(*arguments)
    assert result.returncode == 2
    assert "nowhere" in result.stderr


@pytest.mark.parametrize("replicas", ["path", "path=0", "paths=2", "recorder=2"])
def test_replicas_that_make_no_sense_are_invalid_input(oxbow, replicas):
    result = oxbow("up", "--replicas", replicas)
    assert result.returncode == 2
    assert replicas in result.stderr


def test_a_stack_that_is_up(start, oxbow):
    endpoint = free_endpoint()
    up = start("up", "--listen", endpoint, "--replicas", "contour=2")
    assert up.stdout.readline() == f"ready: {endpoint}\n"

    planned = oxbow("plan", "pond.json", "--connect", endpoint, "--json")
    assert planned.returncode == 0, planned.stderr
    mission_id = json.loads(planned.stdout)["Plan"]["mission_id"]

    found = json.loads(oxbow("status", "--connect", endpoint, "--json").stdout)
    assert found["missing"] == []
    assert [process["service"] for process in found["processes"]].count("contour") == 2
    assert [process["service"] for process in found["processes"]].count("path") == max(2, os.cpu_count() or 1)
    assert [(mission["mission_id"], mission["state"]) for mission in found["missions"]] == [(mission_id, "done")]

    table = oxbow("status", "--connect", endpoint, COLUMNS="80")
    assert table.returncode == 0
    assert all(word in table.stdout for word in (*SERVICES, mission_id, "MiB"))

    second = oxbow("up", "--listen", endpoint, OXBOW_HOME="second")
    assert second.returncode == 4
    assert "router" in second.stderr

    killed = child(up, "oxbow_decomposition")
    killed.kill()
    until(lambda: not killed.is_running() or killed.status() == psutil.STATUS_ZOMBIE)
    again = oxbow("plan", "pond.json", "--connect", endpoint, "--seed", 1)
    assert again.returncode == 0, again.stderr
    assert child(up, "oxbow_decomposition").pid != killed.pid

    processes = family(up)
    for process in processes[::2]:
        process.suspend()
    up.send_signal(signal.SIGINT)
    assert up.wait(GONE_S) == 0
    until(lambda: not running(processes), GONE_S)


def test_what_freezes_is_replaced_and_missions_are_planned_all_the_same(start):
    endpoint = free_endpoint()
    up = start("up", "--listen", endpoint)
    assert up.stdout.readline() == f"ready: {endpoint}\n"
    for number, modules in enumerate((("oxbow_contour", "oxbow_recorder"), ("oxbow_mission", "oxbow.bus.router"))):
        frozen = [child(up, module) for module in modules]
        frozen += [one for process in frozen for one in process.children()]
        plan = start("plan", "pond.json", "--connect", endpoint, "--seed", str(number))
        wait_for_missions(endpoint, number + 1)
        for process in frozen:
            process.suspend()
        assert plan.wait(60) == 0
        assert not running(frozen)

    processes = family(up)
    for process in processes[::2]:
        process.suspend()
    up.kill()
    until(lambda: not running(processes), GONE_S)


def test_status_shows_what_does_not_run(start, oxbow, folder):
    (folder / "oxbow_recorder.py").write_text("raise SystemExit(3)")
    endpoint = free_endpoint()
    up = start("up", "--listen", endpoint, PYTHONPATH=str(folder))
    assert up.stdout.readline() == f"ready: {endpoint}\n"
    until(lambda: "recorder-1" in started_again(oxbow, endpoint))
    assert json.loads(oxbow("status", "--connect", endpoint, "--json").stdout)["missing"] == ["recorder"]
    table = oxbow("status", "--connect", endpoint).stdout
    assert "Started again" in table
    assert "recorder-1" in table


def started_again(oxbow: Callable[..., subprocess.CompletedProcess[str]], endpoint: str) -> set[str]:
    """Names of the processes that have been started more than once."""
    found = json.loads(oxbow("status", "--connect", endpoint, "--json").stdout)
    return {each["name"] for each in found["supervised"] if each["starts"] > 1}


def wait_for_missions(endpoint: str, count: int) -> None:
    """Wait until so many missions have been accepted."""
    with Client(endpoint) as client:
        until(lambda: len(client.statuses()) >= count)
