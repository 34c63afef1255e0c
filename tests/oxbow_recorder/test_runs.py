"""Which runs are recorded: their ends, and bounds on everything; with the processes that write."""

import os
import signal
import time
from contextlib import suppress

import msgspec
import psutil
import pytest
import shapely

from oxbow.contracts import layer_key
from oxbow.wire.codec import encode
from oxbow.wire.recording import Layer, LayerKind, Stamped
from oxbow_recorder import runs as runs_module
from oxbow_recorder.address import RecordedRun
from oxbow_recorder.files import holds
from oxbow_recorder.runs import IDLE_S, MOST_BEGUN, MOST_OPEN, MOST_WAITING, MOST_WRITERS, WAIT_S, Runs

pytestmark = pytest.mark.processes

POINT = (shapely.Point(1, 2),)


def show(runs, mission="m", run="r", name="path", stage="path", size=0, geometries=POINT):
    kind = LayerKind.LOG if stage == "mission" else LayerKind.GEOMETRY
    layer = Layer(stage=stage, name=name, kind=kind, geometries=geometries, text="x" * size)
    runs.take(
        layer_key(mission, stage, name),
        encode(Stamped(mission_id=mission, request_id=run, time_s=1.7e9, layer=layer)),
    )


def end(runs, mission="m", run="r", name="done"):
    show(runs, mission, run, name, "mission", size=4)


def until(condition, timeout_s=30.0):
    give_up = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < give_up
        time.sleep(0.02)


def names(folder):
    return {path.name for path in folder.iterdir() if not path.name.startswith(".")}


def writers():
    """The processes of all writers of this one."""
    found = []
    for each in psutil.Process().children():
        with suppress(psutil.NoSuchProcess):  # it is ending
            if "oxbow_recorder.process" in each.cmdline():
                found.append(each)
    return found


class Clock:
    """A clock that is set."""

    now_s = 0.0

    def __call__(self):
        return self.now_s


def pass_time(runs, clock):
    clock.now_s += 0.1
    runs.tick()


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def runs(tmp_path, clock):
    with Runs(tmp_path, clock=clock) as runs:
        yield runs
    assert not writers()


def test_a_run_is_recorded_from_its_first_layer_to_its_last(runs, tmp_path):
    for name in ("first", "second"):
        show(runs, name=name)
    end(runs)
    until((tmp_path / "m.rrd").exists)
    content = (tmp_path / "m.rrd").read_bytes()
    assert b"/path/first" in content
    assert b"/path/second" in content


@pytest.mark.parametrize("restarted", [False, True])
def test_late_layers_do_not_replace_a_finished_recording(runs, tmp_path, restarted, caplog):
    for number in range(20):
        for name in ("first", "second"):
            show(runs, f"m{number}", name=name)
        end(runs, f"m{number}")
    until(lambda: len(names(tmp_path)) == 20)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    if restarted:
        runs.close()
        runs = Runs(tmp_path)
    with runs:
        for number in range(20):
            for _ in range(3):
                show(runs, f"m{number}", name="late")
            end(runs, f"m{number}", name="failed")
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert len([record for record in caplog.records if "after its end" in record.message]) == 20


def test_another_run_takes_the_place_of_the_one_before(runs, tmp_path):
    """Where the end of a run was lost, the next run of the mission is its end."""
    for run in ("r1", "r2"):
        show(runs, run=run, name="first")
        show(runs, run=run, name="second")
    show(runs, run="r1", name="late")
    end(runs, run="r2")
    until(lambda: holds(tmp_path / "m.rrd", RecordedRun(mission_id="m", run_id="r2")))
    assert b"/path/late" not in (tmp_path / "m.rrd").read_bytes()


def test_a_run_of_one_layer_is_recorded_after_a_while(runs, tmp_path, clock):
    show(runs, name="only")
    runs.tick()
    assert not names(tmp_path)
    clock.now_s = WAIT_S + 0.1
    runs.tick()
    assert runs.counts().open == 1
    clock.now_s = WAIT_S + IDLE_S + 0.2
    runs.tick()
    until((tmp_path / "m.rrd").exists)


def test_a_flood_of_ids_is_bounded_and_does_not_cost_a_mission_its_recording(runs, tmp_path):
    for name in ("first", "second", "third"):
        show(runs, "real", name=name)
    for number in range(1_500):
        show(runs, f"flood{number}")
        if number % 10 == 0:
            show(runs, f"flood{number}", name="second")
        if number % 100 == 0:
            show(runs, "real", name=f"at{number}")
            runs.tick()
            assert runs.counts().open <= MOST_OPEN + MOST_WAITING
            assert len(writers()) <= MOST_WRITERS
    end(runs, "real")
    until((tmp_path / "real.rrd").exists)
    content = (tmp_path / "real.rrd").read_bytes()
    assert all(f"/path/{name}".encode() in content for name in ("first", "third", "at100", "at1400"))


def test_processes_are_renewed_so_that_nothing_adds_up(runs, tmp_path):
    seen = set()
    for number in range(2 * MOST_BEGUN + 1):
        show(runs, f"m{number}")
        end(runs, f"m{number}")
        until((tmp_path / f"m{number}.rrd").exists)
        seen |= set(runs.counts().writers)
        runs.tick()
    assert len(seen) == 3
    until(lambda: runs.tick() or len(writers()) == 1)


def test_a_process_with_nothing_to_record_ends(runs, clock):
    until(writers)
    clock.now_s = runs_module.SPARE_S + 1.0
    until(lambda: runs.tick() or not writers())
    show(runs)
    end(runs)
    until(writers)


def test_a_writer_that_dies_or_stops_costs_what_it_had_not_finished(runs, tmp_path, clock, caplog):
    show(runs, "lost")
    show(runs, "lost", name="second")
    until(lambda: any(tmp_path.glob(".lost.*.part.rrd")))
    (writer,) = writers()
    writer.kill()
    until(lambda: runs.tick() or runs.counts().open == 0)
    show(runs, "next")
    end(runs, "next")
    until(lambda: pass_time(runs, clock) or (tmp_path / "next.rrd").exists())
    assert "a writer failed" in caplog.text


def test_a_full_disk_is_named_and_costs_neither_older_recordings_nor_later_ones(
    tmp_path, clock, monkeypatch, caplog, capfd
):
    """The size of the files that the writer may write is limited, which rerun meets as a full disk."""
    monkeypatch.setattr("oxbow_recorder.writer.STUCK_S", 3.0)
    with Runs(tmp_path, clock=clock) as runs:
        end(runs, "older")
        until((tmp_path / "older.rrd").exists)
        before = (tmp_path / "older.rrd").read_bytes()
        (writer,) = writers()
        unlimited = writer.rlimit(psutil.RLIMIT_FSIZE)
        writer.rlimit(psutil.RLIMIT_FSIZE, (20_000, unlimited[1]))
        end(runs, "older", "r2")
        end(runs, "lost")
        until(lambda: runs.tick() or not runs.is_busy())
        assert str(tmp_path) in caplog.text + capfd.readouterr().err
        with suppress(psutil.NoSuchProcess):  # killed, where rerun waited for the file
            writer.rlimit(psutil.RLIMIT_FSIZE, unlimited)
        end(runs, "later")
        until(lambda: pass_time(runs, clock) or (tmp_path / "later.rrd").exists())
        assert (tmp_path / "older.rrd").read_bytes() == before


def test_a_layer_that_cannot_be_drawn_costs_that_layer_alone(runs, tmp_path):
    show(runs, name="first")
    broken = {"stage": "path", "name": "broken", "geometries": [b"\x01\x07" * 40]}
    payload = msgspec.msgpack.encode({"mission_id": "m", "request_id": "r", "time_s": 1.0, "layer": broken})
    runs.take(layer_key("m", "path", "broken"), payload)
    show(runs, name="third")
    end(runs)
    until((tmp_path / "m.rrd").exists)
    content = (tmp_path / "m.rrd").read_bytes()
    assert b"/path/first" in content
    assert b"/path/third" in content


def test_what_waits_is_recorded_when_it_is_closed(tmp_path):
    with Runs(tmp_path) as runs:
        show(runs, "one")
        show(runs, "two")
        show(runs, "two", name="second")
    assert names(tmp_path) == {"one.rrd", "two.rrd"}


def test_a_stopped_writer_does_not_hold_up_layers_or_the_end(tmp_path, monkeypatch):
    monkeypatch.setattr("oxbow_recorder.runs.END_S", 1.0)
    with Runs(tmp_path) as runs:
        until(writers)
        (writer,) = writers()
        os.kill(writer.pid, signal.SIGSTOP)
        for _ in range(20):
            show(runs, size=1_000_000)
    assert not writers()


def test_a_server_for_viewers_that_is_gone_costs_no_recording(tmp_path, monkeypatch):
    monkeypatch.setattr("oxbow_recorder.runs.END_S", 0.5)
    with Runs(tmp_path, "rerun+http://127.0.0.1:9/proxy") as runs:
        show(runs)
        end(runs)
        until((tmp_path / "m.rrd").exists)
    assert not writers()
