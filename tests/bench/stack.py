"""A stack of processes as `oxbow up` runs it, and what it costs beside planning itself."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec
import psutil

import oxbow
from oxbow.bus.client import Bus, BusCall
from oxbow.bus.router import free_endpoint
from oxbow.contracts import ANY, STAGES, MissionKey, MissionState, MissionStatus
from oxbow.mission.file import Mission, PlanOptions, write_mission
from oxbow.planning.pipeline import plan_mission
from oxbow_cli.local import local_call
from tests.bench.lakes import lake
from tests.bench.results import Figure, Goal, Section, middle

__all__ = ["measure_bus", "measure_connect", "measure_load", "measure_memory", "measure_start"]

START_LIMIT_S = 30.0
LIMIT_S = 60.0
LOAD_LIMIT_S = 120.0
REPEATS = 5
PAIRS = 15
MISSIONS = 100
OXBOW = (sys.executable, "-m", "oxbow_cli")


def small_mission() -> Mission:
    """A mission that takes about as little planning as one can."""
    return lake(200, spacings=3.0)


@dataclass(frozen=True)
class Stack:
    """A stack that is up, and how long that took."""

    endpoint: str
    process: subprocess.Popen[str]
    started: float


@contextmanager
def running_stack(replicas: int = 1) -> Iterator[Stack]:
    """`oxbow up` on a free port with an empty store, stopped afterwards."""
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory(prefix="oxbow-bench-") as home, (Path(home) / "log").open("w") as log:
        options = [f"--replicas={stage.stage}={replicas}" for stage in STAGES]
        started = time.perf_counter()
        process = subprocess.Popen(
            [*OXBOW, "up", "--listen", endpoint, "--home", home, *options],
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )
        late = threading.Timer(START_LIMIT_S, process.kill)
        late.daemon = True
        late.start()
        try:
            assert process.stdout is not None
            is_ready = process.stdout.readline().startswith("ready")
            late.cancel()
            if not is_ready:
                raise RuntimeError(f"the stack did not start:\n{(Path(home) / 'log').read_text()}")
            yield Stack(endpoint, process, started)
        finally:
            process.terminate()
            process.wait(LIMIT_S)
            if process.stdout is not None:
                process.stdout.close()


def measure_start() -> Iterator[Section]:
    """From the start of `oxbow up` to the first mission that the mission service has accepted."""
    rows: list[dict[str, Figure]] = []
    for number in range(1, REPEATS + 1):
        with running_stack() as stack:
            ready_s = time.perf_counter() - stack.started
            with oxbow.Client(stack.endpoint) as client:
                mission_id = client.submit(small_mission()).mission_id
                accepted_s = time.perf_counter() - stack.started
                next(client.plans(mission_id, timeout_s=LIMIT_S))
            planned_s = time.perf_counter() - stack.started
        rows.append({"run": number, "ready": ready_s, "accepted": accepted_s, "planned": planned_s})
    goal = Goal("median to the first accepted", middle(rows, "accepted"), " s", at_most=4.0)
    yield Section("Start of the embedded stack, s since `oxbow up`", rows, [goal])


def measure_bus() -> Iterator[Section]:
    """The same mission planned in this process, over the bus, and by way of the mission service, in turns."""
    mission = small_mission()
    here = local_call()
    seconds: dict[str, list[float]] = {"local": [], "stages over the bus": [], "mission service": []}
    with running_stack() as stack, Bus.connect(stack.endpoint) as bus, oxbow.Client(stack.endpoint) as client:
        bus.wait_ready([endpoint.stage for endpoint in STAGES], START_LIMIT_S)
        for seed in range(PAIRS + 1):
            options = PlanOptions(seed=seed)  # another seed is another mission: none is answered from the store
            over_bus = BusCall(bus, deadline_s=time.time() + LIMIT_S)
            ways = {
                "local": lambda: plan_mission(mission, options, call=here),  # noqa: B023 - called at once
                "stages over the bus": lambda: plan_mission(mission, options, call=over_bus),  # noqa: B023
                "mission service": lambda: client.plan(mission, seed=options.seed, timeout_s=LIMIT_S),  # noqa: B023
            }
            for way, plan in ways.items():
                started = time.perf_counter()
                plan()
                seconds[way].append(time.perf_counter() - started)
    columns = [dict(zip(seconds, turn, strict=True)) for turn in list(zip(*seconds.values(), strict=True))[1:]]
    local_s = middle(columns, "local")
    rows: list[dict[str, Figure]] = []
    for way in seconds:
        ratio = middle([{way: turn[way] / turn["local"]} for turn in columns], way)
        added_s = middle([{way: turn[way] - turn["local"]} for turn in columns], way)
        rows.append(
            {"way": way, "median ms": 1e3 * middle(columns, way), "ratio": ratio, "added ms": 1e3 * added_s}
        )
    goals = [Goal(f"{row['way']} / local", float(row["ratio"]), at_most=1.3) for row in rows[1:]]
    note = f"{PAIRS} turns after one to warm up; planning itself took {1e3 * local_s:.0f} ms"
    yield Section("Bus over local: medians of turns", rows, goals, note)


def measure_connect() -> Iterator[Section]:
    """What the command adds to planning where a stack is up: wall time less the time from accepted to done."""
    rows: list[dict[str, Figure]] = []
    with running_stack() as stack, Bus.connect(stack.endpoint) as bus, tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "lake.json"
        write_mission(file, small_mission())
        times: dict[MissionState, float] = {}

        def note(_key: str, payload: bytes) -> None:
            status = msgspec.json.decode(payload, type=MissionStatus)
            times.setdefault(status.state, status.time_s)

        bus.subscribe(str(MissionKey(ANY, "status")), note)
        for seed in range(REPEATS + 1):
            times.clear()
            options = ["--connect", stack.endpoint, "--seed", str(seed), "-o", f"{folder}/planned.json", "--json"]
            started = time.perf_counter()
            done = subprocess.run(
                [*OXBOW, "plan", str(file), *options], check=True, capture_output=True, timeout=60
            )
            wall_s = time.perf_counter() - started
            assert json.loads(done.stdout)
            planning_s = times[MissionState.DONE] - times[MissionState.ACCEPTED]
            rows.append({"run": seed, "wall": wall_s, "planning": planning_s, "added": wall_s - planning_s})
    rows = rows[1:]
    goal = Goal("median added", middle(rows, "added"), " s", at_most=0.6)
    yield Section("`oxbow plan --connect`, s", rows, [goal])


def measure_load() -> Iterator[Section]:
    """Many missions handed in at once, through one replica of each stage and through two."""
    rows: list[dict[str, Figure]] = []
    for replicas in (1, 2):
        with running_stack(replicas) as stack, oxbow.Client(stack.endpoint) as client:
            updates = client.plans(history=False, timeout_s=LOAD_LIMIT_S)
            client.plan(small_mission(), mission_id="warm-up", timeout_s=LIMIT_S)
            next(updates)
            started = time.perf_counter()
            for seed in range(MISSIONS):
                client.submit(small_mission(), mission_id=f"load-{seed}", seed=seed, deadline_s=LOAD_LIMIT_S)
            accepted_s = time.perf_counter() - started
            arrived = [time.perf_counter() - started for _, _update in zip(range(MISSIONS), updates, strict=False)]
            states = [status.state for status in client.statuses()]
        rows.append(
            {
                "replicas": replicas,
                "done": states.count(MissionState.DONE) - 1,
                "failed": states.count(MissionState.FAILED),
                "all accepted s": accepted_s,
                "all planned s": arrived[-1],
                "missions / s": len(arrived) / arrived[-1],
            }
        )
    goals = [Goal(f"done with {row['replicas']} replicas", float(row["done"]), at_least=MISSIONS) for row in rows]
    yield Section(f"{MISSIONS} missions at once", rows, goals)


def measure_memory() -> Iterator[Section]:
    """Memory of each process of a stack that has planned nothing yet, and of one that has."""
    with running_stack() as stack, oxbow.Client(stack.endpoint) as client:
        time.sleep(1.0)
        before = _memory_mb(stack.process.pid)
        client.plan(small_mission(), timeout_s=LIMIT_S)
        after = _memory_mb(stack.process.pid)
    rows: list[dict[str, Figure]] = [
        {"process": name, "idle USS MB": uss, "idle RSS MB": rss, "after a plan USS MB": after[name][0]}
        for name, (uss, rss) in before.items()
        if name in after
    ]
    most = max(float(row["idle RSS MB"]) for row in rows)
    total: Figure = sum(float(row["idle USS MB"]) for row in rows)
    goal = Goal("largest idle RSS", most, " MB", at_most=200.0)
    yield Section("Memory of an idle stack", rows, [goal], note=f"USS of all processes together: {total:.0f} MB")


def _memory_mb(pid: int) -> dict[str, tuple[float, float]]:
    """USS and RSS of a process and its descendants, by what they run."""
    parent = psutil.Process(pid)
    return {
        _name(process): (process.memory_full_info().uss / 1e6, process.memory_info().rss / 1e6)
        for process in [parent, *parent.children(recursive=True)]
    }


def _name(process: psutil.Process) -> str:
    """The module that runs; a worker by its handler."""
    command = process.cmdline()
    module = command[command.index("-m") + 1] if "-m" in command else process.name()
    return f"{command[-3].partition('.')[0]} worker" if module == "oxbow.stage.process" else module
