"""Missions planned in helper processes that hang, die, answer for another or say what no helper says."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import msgspec
import pytest

from oxbow.bus.client import Bus
from oxbow.contracts import MissionState, MissionStatus
from oxbow.errors import ErrorCode
from oxbow.planning.submission import SubmissionParameters
from oxbow_mission import planner as bounds
from oxbow_mission.database import Database
from oxbow_mission.planner import MAX_ATTEMPTS, Planner
from oxbow_mission.registry import Registry
from oxbow_mission.revision import Request, Revision
from oxbow_mission.schema import SCHEMA
from oxbow_mission.store import Store
from oxbow_mission.vitals import Vitals
from tests.support.mission_processes import STAGES, end, launch
from tests.support.project import ROOT

pytestmark = pytest.mark.processes

WAIT_S = 30.0


class Finals:
    """Outcomes as they come."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.statuses: dict[str, MissionStatus] = {}

    def note(self, status: MissionStatus) -> None:
        with self.changed:
            self.statuses[status.mission_id] = status
            self.changed.notify_all()

    def of(self, mission_id: str) -> MissionStatus:
        with self.changed:
            assert self.changed.wait_for(lambda: mission_id in self.statuses, WAIT_S)
            return self.statuses[mission_id]


@pytest.fixture(scope="module")
def planning(router: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Registry, Finals]]:
    stages = launch(*STAGES, "--connect", router)
    with pytest.MonkeyPatch.context() as patch, Bus.connect(router) as bus:
        patch.setenv("PYTHONPATH", str(ROOT))
        patch.setattr(bounds, "GRACE_S", 0.5)
        bus.wait_ready(["path"], WAIT_S)
        with (
            Database(tmp_path_factory.mktemp("planner"), SCHEMA) as database,
            Registry(Store(database), bus, most_running=2) as registry,
        ):
            finals = Finals()
            registry.on_final = finals.note
            vitals = Vitals(bus, "test", registry.store.waiting)
            with Planner(registry, bus, vitals, 2, 512, lambda: None, "tests.support.odd_helpers:plan"):
                yield registry, finals
    end(stages)


def accept(registry: Registry, mission_id: str, document: str, deadline_s: float = 30.0) -> None:
    parameters = msgspec.json.encode(SubmissionParameters(deadline_s=deadline_s))
    registry.accept(mission_id, Request(document.encode(), parameters, document), "")


@pytest.mark.parametrize(
    ("document", "code", "message"),
    [
        ("crashes", ErrorCode.INTERNAL, f"SIGSEGV; {MAX_ATTEMPTS} of them did"),
        ("needs memory", ErrorCode.INFEASIBLE, "needs more than the 512 MB"),
        ("hangs", ErrorCode.TIMEOUT, "stopped after"),
        ("raises", ErrorCode.INTERNAL, "out of the blue"),
        ("answers for another", ErrorCode.INTERNAL, "answered Checked"),
        ("asks for no stage", ErrorCode.INTERNAL, "none"),
        ("asks nonsense", ErrorCode.INVALID_REQUEST, ""),
        ("shows what is no layer", ErrorCode.INVALID_REQUEST, "expected 1 to 128"),
    ],
)
def test_each_mission_has_its_own_outcome_whatever_the_one_before_did(
    planning: tuple[Registry, Finals], document: str, code: ErrorCode, message: str
) -> None:
    registry, finals = planning
    mission_id = document.replace(" ", "-")
    accept(registry, mission_id, document, deadline_s=1.0 if document == "hangs" else 30.0)
    for number in range(3):
        accept(registry, f"{mission_id}-{number}", f"healthy {number} of {document}")
    error = finals.of(mission_id).error
    assert error is not None
    assert error.code is code
    assert message in error.message
    for number in range(3):
        assert finals.of(f"{mission_id}-{number}").state is MissionState.DONE
        plan = registry.store.plan(Revision(f"{mission_id}-{number}", 1))
        assert plan == f"healthy {number} of {document}".encode()


def test_no_plan_passes_for_that_of_another(planning: tuple[Registry, Finals]) -> None:
    registry, finals = planning
    for number in range(4):
        accept(registry, f"twice-{number}", "answers twice")
        accept(registry, f"once-{number}", f"once {number}")
    for number in range(4):
        assert finals.of(f"once-{number}").state is MissionState.DONE
        assert registry.store.plan(Revision(f"once-{number}", 1)) == f"once {number}".encode()


def test_helpers_that_are_killed_from_outside_cost_no_mission(planning: tuple[Registry, Finals]) -> None:
    registry, finals = planning
    for number in range(4):
        accept(registry, f"killed-{number}", "is killed now and then")
    assert {finals.of(f"killed-{number}").state for number in range(4)} == {MissionState.DONE}


def test_parameters_that_cannot_be_read_fail_their_mission_alone(planning: tuple[Registry, Finals]) -> None:
    registry, finals = planning
    registry.accept("unreadable", Request(b"?", b"{", "?"), "")
    accept(registry, "readable", "fine")
    assert finals.of("unreadable").state is MissionState.FAILED
    assert finals.of("readable").state is MissionState.DONE


def test_a_run_that_hangs_can_be_cancelled(planning: tuple[Registry, Finals]) -> None:
    registry, finals = planning
    accept(registry, "stuck", "hangs")
    while registry.statuses("stuck")[0].state is not MissionState.PLANNING:
        time.sleep(0.02)
    error = registry.cancel("stuck").error
    assert error is not None
    assert error.code is ErrorCode.CANCELLED
    for number in range(3):
        accept(registry, f"after-{number}", f"after {number}")
        assert finals.of(f"after-{number}").state is MissionState.DONE
