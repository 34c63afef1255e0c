"""Whole plans, judged: the project's own examples by its certificate, real lakes by an independent judge."""

import importlib.util
import json
from pathlib import Path

import pytest

from oxbow.mission import mission_json, read_mission
from oxbow.pipeline import plan_mission
from oxbow_cli.evaluation import evaluate
from oxbow_cli.local import local_call

ROOT = Path(__file__).parents[2]
SHARED = ROOT / "../shared"
LAKES = [SHARED / f"data/missions/lake-{name}.json" for name in ("N43.9W070.5", "N44.6W073.3", "S04.2E015.4")]


@pytest.mark.parametrize("path", sorted((ROOT / "docs/examples").glob("*.json")), ids=lambda path: path.stem)
def test_examples(path):
    judged = evaluate(plan_mission(read_mission(path), call=local_call()))
    assert judged.is_simple
    assert judged.outside_m == 0
    assert judged.unsafe_m <= 0.01
    assert judged.starts_at_launch_m == judged.ends_at_recovery_m == 0
    assert 0.95 <= judged.length_ratio <= 1
    assert judged.q <= 3.2
    assert judged.p95_ratio <= 1.6


@pytest.mark.skipif(not SHARED.exists(), reason="needs the shared missions and their judge")
@pytest.mark.parametrize("path", LAKES, ids=lambda path: path.stem)
def test_real_lakes(path):
    spec = importlib.util.spec_from_file_location("referee", SHARED / "referee/referee.py")
    assert spec is not None
    referee = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(referee)
    judged = referee.judge(json.loads(mission_json(plan_mission(read_mission(path), call=local_call()))))
    assert judged["is_simple"] == 1
    assert judged["outside_m"] <= 0.01
    assert judged["unsafe_m"] <= 0.01
    assert max(judged["starts_at_launch_m"], judged["ends_at_recovery_m"]) <= 1
    assert 0.95 <= judged["length_ratio"] <= 1
    assert judged["judged_area"] >= 0.99
    assert judged["q"] <= 3
    assert judged["p95_ratio"] <= 1.6
