"""Whole plans, judged: the project's own examples by its certificate, real lakes by an independent judge."""

import json

import pytest

from oxbow.contracts import Method
from oxbow.mission.file import PlanOptions, mission_json, read_mission
from oxbow.planning.pipeline import plan_mission
from oxbow_cli.evaluation import evaluate
from oxbow_cli.local import local_call
from tests.support.project import ROOT
from tests.support.real_lakes import mission_file, needs_referee, referee

CASES = [
    ("N43.9W070.5", Method.SPACE_FILLING_CURVE, 2.2, 1.25),
    ("N25.2E089.8", Method.TRANSECT, 2.4, 1.5),
    ("S04.2E015.4", Method.TOUR, 3.0, 1.6),
    ("N56.0E008.2", Method.WATERSHED, 2.4, 1.5),
]


@pytest.mark.parametrize("name", ["fleet", "lake", "meander"])
def test_example_surveys(name):
    path = ROOT / f"docs/examples/{name}.json"
    judged = evaluate(plan_mission(read_mission(path), call=local_call()))
    assert judged.is_simple
    assert judged.outside_m == 0
    assert judged.unsafe_m <= 0.01
    assert judged.starts_at_launch_m == judged.ends_at_recovery_m == 0
    assert 0.95 <= judged.length_ratio <= 1
    assert judged.q <= 3.2
    assert judged.p95_ratio <= 1.6


def test_the_example_treatment():
    completed = plan_mission(read_mission(ROOT / "docs/examples/treat.json"), call=local_call())
    judged = evaluate(completed)
    assert [vehicle.name for vehicle in judged.vehicles] == ["tern", "gull"]
    assert judged.outside_m == 0
    assert judged.unsafe_m <= 0.01
    assert judged.length_ratio <= 1
    treatment = completed.plan.treatment
    proposed = {name for sortie in treatment.further for name in sortie.hot_spots}
    assert all(spot.treated_share >= 0.99 or spot.hot_spot in proposed for spot in treatment.hot_spots)


@needs_referee
@pytest.mark.parametrize(("name", "method", "worst_q", "worst_p95"), CASES)
def test_real_lakes(name, method, worst_q, worst_p95):
    planned = plan_mission(read_mission(mission_file(name)), PlanOptions(method=method), call=local_call())
    judged = referee().judge(json.loads(mission_json(planned)))
    assert judged["is_simple"] == 1
    assert judged["outside_m"] <= 0.01
    assert judged["unsafe_m"] <= 0.01
    assert max(judged["starts_at_launch_m"], judged["ends_at_recovery_m"]) <= 1
    assert 0.95 <= judged["length_ratio"] <= 1
    assert judged["judged_area"] >= 0.99
    assert judged["q"] <= worst_q
    assert judged["p95_ratio"] <= worst_p95
