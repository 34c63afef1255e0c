"""Whose a layer is: nothing is done with one whose ids could name a file elsewhere."""

import os
import time

import msgspec
import pytest
import shapely

from oxbow.contracts import layer_key
from oxbow.errors import InvalidRequest
from oxbow.wire.codec import encode
from oxbow.wire.recording import Layer, Stamped
from oxbow_recorder.address import MOST_LAYER_BYTES, RecordedRun, address_of
from oxbow_recorder.files import ABANDONED_S, part_path, recording_path, sweep

LONGEST_ID = "m" * 128


def layer_bytes(mission="m", run="r", stage="path", name="path"):
    layer = Layer(stage=stage, name=name, geometries=(shapely.Point(1, 2),))
    return encode(Stamped(mission_id=mission, request_id=run, time_s=1.7e9, layer=layer))


def test_a_layer_says_whose_it_is():
    address = address_of(layer_key("m", "path", "path"), layer_bytes())
    assert address.run == RecordedRun(mission_id="m", run_id="r")
    assert not address.is_last


@pytest.mark.parametrize("name", ["done", "failed"])
def test_the_last_layer_of_a_run_is_known(name):
    assert address_of(layer_key("m", "mission", name), layer_bytes(stage="mission", name=name)).is_last
    assert not address_of(layer_key("m", "path", name), layer_bytes(stage="path", name=name)).is_last


@pytest.mark.parametrize("text", ["../evil", "a/b", "/tmp/evil", "..\\x", "a b", "m*", "m\n", "m\0"])
@pytest.mark.parametrize("field", ["mission", "run", "stage", "name"])
def test_an_id_that_is_none_is_refused(field, text):
    with pytest.raises(InvalidRequest, match="expected"):
        address_of(layer_key("m", "path", "path"), layer_bytes(**{field: text}))


@pytest.mark.parametrize(
    "key", [layer_key("other", "path", "path"), layer_key("m", "other", "path"), layer_key("m", "path", "other")]
)
def test_key_and_message_have_to_agree(key):
    with pytest.raises(InvalidRequest, match="key other than its own"):
        address_of(key, layer_bytes())


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xc1",
        b"\x91" * 100_000,
        msgspec.msgpack.encode({"mission_id": 7, "layer": {"stage": "path", "name": "path"}}),
        layer_bytes().replace(b"\xa1m", b"\xa1\xff", 1),
        layer_bytes()[:-9],
        bytes(MOST_LAYER_BYTES + 1),
    ],
    ids=["empty", "no type", "nested", "number", "UTF-8", "cut", "enormous"],
)
def test_what_is_no_layer_is_refused(payload):
    with pytest.raises(InvalidRequest):
        address_of(layer_key("m", "path", "path"), payload)


def test_the_longest_ids_make_names_that_a_file_system_takes(tmp_path):
    run = RecordedRun(mission_id=LONGEST_ID, run_id=LONGEST_ID)
    for path in (recording_path(tmp_path, run), part_path(tmp_path, run)):
        path.touch()
        assert path.parent == tmp_path


def test_runs_of_a_mission_are_written_beside_one_another(tmp_path):
    parts = {part_path(tmp_path, RecordedRun(mission_id="m", run_id=run)) for run in ("r1", "r2")}
    assert len(parts) == 2


def test_what_was_left_behind_long_ago_is_swept_and_nothing_else(tmp_path):
    names = (".m.r.part.rrd", "m.rrd", ".m.rrd", "notes.part.rrd", ".part.rrd.txt", ".m.r.part.rrd.bak")
    old_s = time.time() - ABANDONED_S - 60
    for name in names:
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (old_s, old_s))
    (tmp_path / ".new.r.part.rrd").touch()
    (tmp_path / ".folder.part.rrd").mkdir()
    sweep(tmp_path)
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept == {*names[1:], ".new.r.part.rrd", ".folder.part.rrd"}
