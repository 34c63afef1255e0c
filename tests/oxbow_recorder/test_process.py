"""The recorder as a process on the real bus: it finishes its files when told to end, and planning outlives it."""

import os
import signal
import subprocess
import sys
import time

import pytest
import shapely

from oxbow.bus import Session
from oxbow.bus.router import start_router
from oxbow.contracts import layer_key
from oxbow.wire.codec import encode
from oxbow.wire.recording import Layer, LayerKind, Stamped

pytestmark = pytest.mark.processes


@pytest.fixture
def bus():
    router = start_router()
    try:
        with Session.connect(router.endpoint) as session:
            yield session
    finally:
        router.process.terminate()
        router.process.wait(10)


@pytest.fixture
def recorder(bus, tmp_path):
    arguments = ["--connect", bus.endpoint, "--instance", "r1", "--folder", tmp_path, "--parent", os.getpid()]
    process = subprocess.Popen([sys.executable, "-m", "oxbow_recorder", *map(str, arguments)])
    try:
        wait_until(lambda: bool(bus.audience(layer_key("m", "path", "path"))))
        yield process
    finally:
        process.kill()
        process.wait(10)


def wait_until(holds):
    give_up = time.monotonic() + 30
    while not holds():
        assert time.monotonic() < give_up
        time.sleep(0.05)


def show(bus, step, mission="m", run="r", key=None):
    line = shapely.LineString([(0, 0), (step, 1)])
    layer = Layer(stage="path", name="path", step=step, geometries=(line,))
    put(bus, layer, mission, run, key)


def put(bus, layer, mission="m", run="r", key=None):
    key = key or layer_key(mission, layer.stage, layer.name)
    stamped = Stamped(mission_id=mission, request_id=run, time_s=1.7e9 + layer.step, layer=layer)
    bus.publish(key, encode(stamped), encoding="application/msgpack")


def end(bus, mission="m", run="r"):
    put(bus, Layer(stage="mission", name="done", kind=LayerKind.LOG, text="done"), mission, run)


def put_bytes(bus, payload):
    bus.publish(layer_key("m", "path", "path"), payload, encoding="application/msgpack")


def test_it_finishes_its_files_when_told_to_end(bus, recorder, tmp_path):
    for step in range(1, 20):
        show(bus, step)
    wait_until(lambda: any(tmp_path.glob(".*.rrd")))
    recorder.send_signal(signal.SIGTERM)
    assert recorder.wait(20) == 0
    verified = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", str(tmp_path / "m.rrd")],
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert verified.returncode == 0


def test_showing_goes_on_without_it(bus, recorder, tmp_path):
    show(bus, 1)
    wait_until(lambda: any(tmp_path.glob(".*.rrd")))
    recorder.kill()
    recorder.wait(10)
    wait_until(lambda: not bus.audience(layer_key("m", "path", "path")))
    for step in range(2, 500):
        show(bus, step)


def test_no_id_leads_out_of_the_folder_or_ends_it(bus, recorder, tmp_path):
    """What is put on a key is anybody's; what is no layer of its key costs that layer alone."""
    outside = tmp_path.parent / "evil.rrd"
    outside.write_text("kept")
    key = layer_key("m", "path", "path")
    for mission, run in (("../evil", "r"), ("m", "/../../evil"), (str(outside.with_suffix("")), "r"), ("", "r")):
        show(bus, 1, mission, run, key=key)
    show(bus, 1, "other", key=key)
    put_bytes(bus, b"\xc1")
    put_bytes(bus, b"\x91" * 100_000)
    for mission in ("m" * 128, "m"):
        show(bus, 1, mission, "r" * 128)
        end(bus, mission, "r" * 128)
    wait_until((tmp_path / "m.rrd").exists)
    assert recorder.poll() is None
    assert outside.read_text() == "kept"
    assert {path.name for path in tmp_path.iterdir()} == {"m.rrd", f"{'m' * 128}.rrd"}
