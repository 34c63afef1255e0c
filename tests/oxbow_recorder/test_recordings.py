"""Recordings of real plans, written and read back."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely

from oxbow.errors import Unavailable
from oxbow.geometry.route import RouteMethod
from oxbow.mission.file import read_mission
from oxbow.planning.pipeline import plan_mission
from oxbow.wire.recording import Layer, LayerKind, Stamped
from oxbow_cli.local import local_call
from oxbow_recorder.address import RecordedRun
from oxbow_recorder.blueprint import blueprint
from oxbow_recorder.drawing import draw
from oxbow_recorder.files import holds
from oxbow_recorder.recordings import Recordings
from tests.support.project import EXAMPLES

LAKE = EXAMPLES / "lake.json"
ENTITIES = """
/contour/raw /contour/simplified /contour/eroded
/decomposition/cells /decomposition/critical_points /decomposition/reeb
/path/circuit /path/start /path/ring /path/epochs /path/refined /path/refinement /path/path
/certificate/gaps /certificate/worst_gap /map/certificate/path /log/mission
"""
END = Layer(stage="mission", name="done", kind=LayerKind.LOG, text="done", scalars={"path_s": 1.0})


def stamped(layer: Layer, run: RecordedRun) -> Stamped:
    ids = {"mission_id": run.mission_id, "request_id": run.run_id}
    return Stamped(**ids, origin=(46.1, 1.9), time_s=1_700_000_000.0, layer=layer)


def record(recordings: Recordings, *layers: Layer, run: str = "r1") -> None:
    """Record a run from its first layer to its last."""
    whose = RecordedRun(mission_id="meander", run_id=run)
    for layer in layers:
        recordings.add(whose, stamped(layer, whose))
    recordings.finish(whose)


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
    record(Recordings(tmp_path), *layers)
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


def drawn_entities(layers):
    return {drawn.entity for layer in layers for drawn in draw(layer, None)}


def test_every_layer_of_a_plan_is_in_some_view(layers):
    """What no view of a flat stage contains would be recorded for nobody."""
    shown = drawn_entities(layer for layer in layers if layer.geometries or layer.kind is LayerKind.GRAPH)
    views = [str(content).lstrip("/").removesuffix("/**") for content in contents(blueprint().root_container)]
    unseen = {entity for entity in shown if not any(entity.startswith(view) for view in views)}
    assert unseen <= {"path/start/lines"}


def test_danger_zones_and_the_routes_of_every_method_are_in_some_view():
    shown: list[Layer] = []
    plan_mission(read_mission(LAKE.with_name("treat.json")), call=local_call(shown.append))
    entities = drawn_entities(shown)
    views = [str(content).removesuffix("/**") for content in contents(blueprint().root_container)]
    for name in ("danger_zones", *(f"routes_{method}" for method in RouteMethod)):
        assert f"assignment/{name}/lines" in entities
        assert f"assignment/{name}" in views


def contents(part):
    """The entities of all views of a container; those of a view with an origin of its own are all below it."""
    for inner in getattr(part, "contents", ()):
        if isinstance(inner, str):
            yield inner.replace("$origin", str(part.origin))
        else:
            yield from contents(inner)


def test_each_vehicle_has_one_colour_in_shares_and_paths():
    halves = (shapely.box(0, 0, 10, 10), shapely.box(10, 0, 20, 10))
    paths = tuple(half.exterior for half in halves)
    (shares,) = draw(Layer(stage="assignment", name="shares", geometries=halves, labels=("a", "b")), None)
    (certified,) = draw(Layer(stage="certificate", name="path", geometries=paths), None)
    colours = [drawn.archetype.colors.as_arrow_array().to_pylist() for drawn in (shares, certified)]
    assert colours[0] == colours[1]
    assert len(set(colours[0])) == 2


def test_parts_of_a_mission_lie_beside_one_another():
    line = Layer(stage="path", name="path", geometries=(shapely.LineString([(0, 0), (1, 1)]),))
    loop = Layer(stage="path", name="loop", kind=LayerKind.SCALARS, scalars={"length_m": 2.0})
    graph = Layer(
        stage="decomposition", name="reeb", kind=LayerKind.GRAPH, nodes=("open", "close"), edges=((0, 1),)
    )
    entities = [
        {each.entity for layer in (line, loop, graph) for each in draw(layer, None, part)} for part in ("", "a b")
    ]
    assert entities[0] == {"path/path/lines", "path/loop/length_m", "decomposition/reeb"}
    assert entities[1] == {r"path/path/a\ b/lines", r"path/loop/length_m/a\ b", r"decomposition/reeb/a\ b"}


def test_a_graph_has_its_nodes_where_its_edges_are():
    """Edges under another entity than the nodes' would join nodes of their own."""
    places = (shapely.Point(0, 0), shapely.Point(3_000, 0), shapely.Point(0, -4_000))
    nodes, edges = ("open", "split", "close"), ((0, 1), (1, 2))
    layer = Layer(stage="x", name="reeb", kind=LayerKind.GRAPH, geometries=places, nodes=nodes, edges=edges)
    drawn = list(draw(layer, None))
    assert [each.entity for each in drawn] == ["x/reeb"] * 2
    positions = np.array(drawn[0].archetype.positions.as_arrow_array().to_pylist())
    assert positions[2] - positions[0] == pytest.approx((positions[1] - positions[0])[::-1] * 4 / 3)
    assert 100 < np.ptp(positions) < 1_000, "as large as labels need, whatever the lake"


def test_an_island_does_not_repeat_the_label_of_its_water():
    ring = shapely.box(0, 0, 10, 10).difference(shapely.box(4, 4, 6, 6))
    (lines,) = draw(Layer(stage="x", name="y", geometries=(ring, ring), labels=("a", "b")), None)
    assert lines.archetype.labels.as_arrow_array().to_pylist() == ["a", "", "b", ""]


def test_another_run_replaces_the_recording_as_a_whole(tmp_path):
    recordings = Recordings(tmp_path)
    for run, name in (("r1", "old"), ("r2", "new")):
        record(recordings, Layer(stage="path", name=name, geometries=(shapely.Point(1, 2),)), END, run=run)
    content = rerun("print", tmp_path / "meander.rrd")
    assert "/path/new" in content
    assert "/path/old" not in content


def test_missions_at_once_have_a_file_each_and_close_finishes_them(tmp_path):
    recordings = Recordings(tmp_path)
    layer = Layer(stage="path", name="path", geometries=(shapely.LineString([(0, 0), (5, 5)]),))
    for number in range(5):
        run = RecordedRun(mission_id=f"m{number}", run_id="r1")
        recordings.add(run, stamped(layer, run))
    assert not list(tmp_path.glob("m*.rrd"))
    recordings.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"m{number}.rrd" for number in range(5)]
    assert "without error" in rerun("verify", *sorted(tmp_path.iterdir()))


def test_a_recording_says_which_run_it_is_of(tmp_path):
    record(Recordings(tmp_path), END, run="r12")
    held = [
        run
        for run in ("r12", "r1", "r123", "r2")
        if holds(tmp_path / "meander.rrd", RecordedRun(mission_id="meander", run_id=run))
    ]
    assert held == ["r12"]


def test_a_folder_that_cannot_be_written_is_named_once_and_costs_its_recordings_alone(tmp_path):
    (tmp_path / "file").touch()
    recordings = Recordings(tmp_path / "file")
    with pytest.raises(Unavailable, match=r"meander\.rrd: cannot be written"):
        record(recordings, END)
    record(recordings, END)  # later layers of that run have nowhere to go


def test_points_rings_and_labels_are_all_drawn():
    ring = shapely.box(0, 0, 10, 10).difference(shapely.box(4, 4, 6, 6))
    layer = Layer(
        stage="x", name="y", geometries=(ring, shapely.Point(1, 2)), labels=("a", "b"), values=(0.0, 1.0)
    )
    drawn = {item.entity: item.archetype for item in draw(layer, None)}
    assert drawn.keys() == {"x/y/lines", "x/y/points"}
    assert len(drawn["x/y/lines"].strips) == 2
    assert drawn["x/y/points"].positions.as_arrow_array().to_pylist() == [[1.0, -2.0]]
