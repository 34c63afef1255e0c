"""Requests checked in helper processes that hang, die, answer for another or say what no helper says."""

from __future__ import annotations

import queue
from collections.abc import Iterator

import pytest

from oxbow.errors import Busy, Infeasible, Internal, InvalidMission, OxbowError
from oxbow_mission import checks as bounds
from oxbow_mission.checks import Checks, Incoming
from oxbow_mission.wire import Check, Checked
from tests.support.project import ROOT

pytestmark = pytest.mark.processes

WAIT_S = 30.0
Outcomes = queue.SimpleQueue[tuple[str, Checked | OxbowError]]


class Noted(Incoming):
    """A request whose outcome is put into a queue."""

    def __init__(self, document: str, outcomes: Outcomes, client: str = "", size: int = 1) -> None:
        self.document = document
        self.outcomes = outcomes
        self.client = client
        self.size = size

    def check(self) -> Check:
        return Check(document=self.document.encode(), parameters={})

    def accept(self, checked: Checked) -> None:
        self.outcomes.put((self.document, checked))

    def fail(self, error: OxbowError) -> None:
        self.outcomes.put((self.document, error))


@pytest.fixture(scope="module")
def checks() -> Iterator[Checks]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(ROOT))
        patch.setattr(bounds, "SLOW_S", 3.0)
        with Checks(512, "tests.support.odd_helpers:check") as opened:
            yield opened


def outcome_of(checks: Checks, document: str) -> Checked | OxbowError:
    outcomes: Outcomes = queue.SimpleQueue()
    checks.put(Noted(document, outcomes))
    return outcomes.get(timeout=WAIT_S)[1]


def test_one_that_hangs_keeps_no_other_waiting_and_is_refused_with_what_would_be_accepted(checks: Checks) -> None:
    assert isinstance(outcome_of(checks, "warm up"), Checked)
    outcomes: Outcomes = queue.SimpleQueue()
    for size in (2, 2**24):
        checks.put(Noted("hangs", outcomes, size=size))
    for number in range(20):
        checks.put(Noted(f"quick {number}", outcomes, client=f"client {number}"))
    arrived = [outcomes.get(timeout=WAIT_S) for _ in range(22)]
    assert [document for document, _ in arrived[-2:]] == ["hangs", "hangs"]
    found = dict(arrived)
    assert all(isinstance(found[f"quick {number}"], Checked) for number in range(20))
    error = found["hangs"]
    assert isinstance(error, InvalidMission)
    assert "takes more than 3 s to check" in error.message
    assert "expected contours with fewer points" in error.message


@pytest.mark.parametrize(
    ("document", "error"),
    [
        ("crashes", Internal),
        ("is killed", Internal),
        ("needs memory", Infeasible),
        ("is refused", InvalidMission),
        ("raises", Internal),
        ("answers for another", Internal),
        ("asks", Internal),
        ("sends garbage", Internal),
    ],
)
def test_each_has_its_own_outcome_whatever_the_one_before_did(
    checks: Checks, document: str, error: type[OxbowError]
) -> None:
    assert isinstance(outcome_of(checks, document), error)
    for other in ("lake", "sea"):
        checked = outcome_of(checks, other)
        assert isinstance(checked, Checked)
        assert checked.mission_id == other


def test_no_answer_passes_for_that_of_another_request(checks: Checks) -> None:
    for _ in range(3):
        outcome_of(checks, "answers twice")
        checked = outcome_of(checks, "lake")
        assert isinstance(checked, Checked)
        assert checked.mission_id == "lake"


def test_what_takes_a_while_is_accepted_in_the_slow_lane(checks: Checks) -> None:
    assert isinstance(outcome_of(checks, "takes a while"), Checked)


def test_one_client_can_fill_its_own_places_alone(checks: Checks) -> None:
    outcomes: Outcomes = queue.SimpleQueue()
    for _ in range(bounds.MOST_ITEMS + 8):
        checks.put(Noted("takes a while", outcomes, client="greedy", size=2**24))
    assert isinstance(outcomes.get(timeout=WAIT_S)[1], Busy)
    checks.put(Noted("lake", outcomes, client="modest", size=2**24))
    checks.drop("greedy")
    while (found := outcomes.get(timeout=WAIT_S))[0] != "lake":
        pass
    assert isinstance(found[1], Checked)
