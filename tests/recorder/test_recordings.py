"""Recordings of real plans, written and read back."""

import subprocess
import sys
from pathlib import Path

import pytest
import shapely

from oxbow.mission import read_mission
from oxbow.pipeline import plan_mission
from oxbow.recording import Layer, LayerKind, Stamped
from oxbow_cli.local import local_call
from oxbow_recorder.drawing import draw
from oxbow_recorder.recordings import IDLE_S, Recordings

LAKE = Path(__file__).parents[2] / "docs/examples/lake.json"
ENTITIES = """
/contour/raw /contour/simplified /contour/eroded
/decomposition/cells /decomposition/critical_points /decomposition/reeb
/path/circuit /path/start /path/ring /path/epochs /path/refined /path/refinement /path/path
/certificate/gaps /certificate/worst_gap /map/certificate/path /log/mission
"""
END = Layer(stage="mission", name="done", kind=LayerKind.LOG, text="done", scalars={"path_s": 1.0})


def stamped(layer: Layer, mission: str = "meander", run: str = "r1") -> Stamped:
    return Stamped(mission_id=mission, origin=(46.1, 1.9), request_id=run, time_s=1_700_000_000.0, layer=layer)


def rerun(*arguments: str | Path) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", *map(str, arguments)],
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def layers() -> list[Layer]:
    shown: list[Layer] = []
    plan_mission(read_mission(LAKE), call=local_call(shown.append))
    return [*shown, END]


def test_a_plan_is_recorded_and_read_back(layers, tmp_path):
    recordings = Recordings(tmp_path)
    for layer in layers:
        recordings.add(stamped(layer))
    file = tmp_path / "meander.rrd"
    assert [path.name for path in tmp_path.iterdir()] == ["meander.rrd"]
    assert "without error" in rerun("verify", file)
    content = rerun("print", file)
    for entity in ENTITIES.split():
        assert entity in content, entity
    assert "/viewport" in content, "the blueprint"


def test_every_layer_is_drawn(layers):
    for layer in (each for each in layers if each.geometries or each.scalars or each.text):
        assert list(draw(layer, None)), f"{layer.stage}/{layer.name}"


def test_another_run_replaces_the_recording_as_a_whole(tmp_path):
    recordings = Recordings(tmp_path)
    for run, name in (("r1", "old"), ("r2", "new")):
        recordings.add(stamped(Layer(stage="path", name=name, geometries=(shapely.Point(1, 2),)), run=run))
        recordings.add(stamped(END, run=run))
    content = rerun("print", tmp_path / "meander.rrd")
    assert "/path/new" in content
    assert "/path/old" not in content


def test_missions_at_once_have_a_file_each_and_close_finishes_them(tmp_path):
    recordings = Recordings(tmp_path)
    layer = Layer(stage="path", name="path", geometries=(shapely.LineString([(0, 0), (5, 5)]),))
    for number in range(5):
        recordings.add(stamped(layer, mission=f"m{number}"))
    assert not list(tmp_path.glob("m*.rrd"))
    recordings.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"m{number}.rrd" for number in range(5)]
    assert "without error" in rerun("verify", *sorted(tmp_path.iterdir()))


def test_an_idle_run_is_closed(tmp_path):
    now = [0.0]
    recordings = Recordings(tmp_path, clock=lambda: now[0])
    layer = Layer(stage="path", name="path", geometries=(shapely.Point(0, 0),))
    recordings.add(stamped(layer, mission="idle"))
    now[0] = 1e9 + IDLE_S
    recordings.add(stamped(layer, mission="busy"))
    assert (tmp_path / "idle.rrd").exists()
    recordings.close()


def test_points_rings_and_labels_are_all_drawn():
    ring = shapely.box(0, 0, 10, 10).difference(shapely.box(4, 4, 6, 6))
    layer = Layer(
        stage="x", name="y", geometries=(ring, shapely.Point(1, 2)), labels=("a", "b"), values=(0.0, 1.0)
    )
    drawn = {item.entity: item.archetype for item in draw(layer, None)}
    assert drawn.keys() == {"x/y/lines", "x/y/points"}
    assert len(drawn["x/y/lines"].strips) == 2
    assert drawn["x/y/points"].positions.as_arrow_array().to_pylist() == [[1.0, -2.0]]
