"""What the store promises, and a random walk through everything that can happen to it."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from oxbow.contracts import MissionState
from oxbow.errors import Infeasible, Internal, InvalidMission, OxbowError, Unavailable
from oxbow_mission.store import MAX_ATTEMPTS, Job, Request, Revision, Store


def request(content: str) -> Request:
    return Request(document=content.encode(), parameters=b"{}", fingerprint=f"print of {content}")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path) as opened:
        yield opened


def claimed(store: Store) -> Job:
    job = store.claim()
    assert job is not None
    return job


def test_same_content_is_one_revision(store: Store) -> None:
    first = store.accept("lake", request("a"))
    assert store.accept("lake", request("a")) == first
    assert (first.revision, first.state) == (1, MissionState.ACCEPTED)


def test_new_content_is_a_new_revision_and_so_is_a_return_to_the_old(store: Store) -> None:
    assert [store.accept("lake", request(content)).revision for content in "aba"] == [1, 2, 3]


def test_ids_do_not_share_revisions(store: Store) -> None:
    assert [store.accept(mission_id, request("a")).revision for mission_id in ("lake", "sea")] == [1, 1]


@pytest.mark.parametrize(
    ("error", "revision"),
    [
        (Infeasible("no water"), 1),
        (InvalidMission("wrong"), 1),
        (Unavailable("no path stage"), 2),
        (Internal("?"), 2),
    ],
)
def test_only_a_failure_that_could_go_away_is_tried_again(store: Store, error: OxbowError, revision: int) -> None:
    store.accept("lake", request("a"))
    store.fail(claimed(store).revision, error)
    again = store.accept("lake", request("a"))
    assert again.revision == revision


def test_claims_in_order_of_arrival(store: Store) -> None:
    for mission_id in ("b", "a", "c"):
        store.accept(mission_id, request("x"))
    assert [claimed(store).revision.mission_id for _ in range(3)] == ["b", "a", "c"]
    assert store.claim() is None


def test_a_revision_waits_until_the_one_before_is_announced(store: Store) -> None:
    for content in "ab":
        store.accept("lake", request(content))
    first = claimed(store)
    assert store.claim() is None
    store.finish(first.revision, b"plan of a")
    assert store.claim() is None
    store.mark_announced(first.revision)
    assert claimed(store).request == request("b")


def test_a_refused_request_is_kept_as_a_failure_beside_the_plan(store: Store) -> None:
    store.accept("lake", request("a"))
    store.finish(claimed(store).revision, b"plan of a")
    refused = store.refuse("lake", "print of junk", InvalidMission("is not JSON", where="Mission File"))
    assert (refused.revision, refused.state) == (2, MissionState.FAILED)
    assert refused.error is not None
    assert refused.error.where == "Mission File"
    assert store.planned("lake") == [Revision("lake", 1)]
    assert store.refuse("lake", "print of junk", InvalidMission("is not JSON")).revision == 2


def test_an_outcome_is_final(store: Store) -> None:
    store.accept("lake", request("a"))
    revision = claimed(store).revision
    store.finish(revision, b"plan")
    with pytest.raises(Internal, match="not being planned"):
        store.finish(revision, b"another plan")
    with pytest.raises(Internal, match="not being planned"):
        store.fail(revision, Infeasible("no water"))
    assert store.plan(revision) == b"plan"


def test_one_process_at_a_time(store: Store, tmp_path: Path) -> None:
    with pytest.raises(Unavailable, match="process id"):
        Store(tmp_path)
    store.close()
    Store(tmp_path).close()


def test_a_newer_schema_is_left_alone(store: Store, tmp_path: Path) -> None:
    store.close()
    db = sqlite3.connect(store.path)
    db.execute("PRAGMA user_version = 99")
    db.close()
    with pytest.raises(Unavailable, match="schema 99"):
        Store(tmp_path)


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(Unavailable, match="cannot keep missions"):
        Store(tmp_path / "file" / "home")
    (tmp_path / "missions.sqlite3").write_bytes(b"no database" * 1000)
    with pytest.raises(Unavailable, match="not a database"):
        Store(tmp_path)


def test_what_kills_the_service_time_after_time_fails(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.accept("lake", request("a"))
    for _ in range(MAX_ATTEMPTS):
        with Store(tmp_path) as store:
            claimed(store)
    with Store(tmp_path) as store:
        assert store.claim() is None
        [status] = store.unannounced()
    assert status.error is not None
    assert f"died {MAX_ATTEMPTS} times" in status.error.message


def test_an_orderly_stop_is_no_attempt(tmp_path: Path) -> None:
    for content in ["a"] * (2 * MAX_ATTEMPTS):
        with Store(tmp_path) as store:
            store.accept("lake", request(content))
            store.release(claimed(store).revision)
    with Store(tmp_path) as store:
        assert claimed(store).revision == Revision("lake", 1)


def test_reports_are_kept_in_order(store: Store) -> None:
    for payload in (b"1", b"2"):
        store.add_report("lake", payload)
    store.add_report("sea", b"3")
    assert store.reports("lake") == [b"1", b"2"]


class Walk(RuleBasedStateMachine):
    """Accept, plan, announce and crash in any order, beside a model of what must come of it."""

    def __init__(self) -> None:
        super().__init__()
        self.home = Path(tempfile.mkdtemp(prefix="oxbow-store-"))
        self.store = Store(self.home)
        self.contents: dict[str, list[str]] = {}
        self.plans: dict[Revision, bytes] = {}
        self.jobs: list[Job] = []

    def teardown(self) -> None:
        self.store.close()
        shutil.rmtree(self.home)

    @rule(mission_id=st.sampled_from(["lake", "sea"]), content=st.sampled_from("ab"))
    def accept(self, mission_id: str, content: str) -> None:
        known = self.contents.setdefault(mission_id, [])
        if known[-1:] != [content]:
            known.append(content)
        assert self.store.accept(mission_id, request(content)).revision == len(known)

    @rule()
    def claim(self) -> None:
        job = self.store.claim()
        if job is not None:
            content = self.contents[job.revision.mission_id][job.revision.number - 1]
            assert job.request == request(content)
            assert job.revision not in self.plans
            self.jobs.append(job)

    @precondition(lambda self: self.jobs)
    @rule(position=st.integers(0, 9))
    def finish(self, position: int) -> None:
        job = self.jobs.pop(position % len(self.jobs))
        plan = f"plan {len(self.plans)}".encode()
        self.store.finish(job.revision, plan)
        self.plans[job.revision] = plan

    @rule()
    def announce(self) -> None:
        for status in self.store.unannounced():
            self.store.mark_announced(Revision.of(status))

    @rule()
    def crash(self) -> None:
        self.store.close()
        self.store = Store(self.home)
        self.jobs.clear()

    @invariant()
    def nothing_is_lost_or_changed(self) -> None:
        latest = {status.mission_id: status.revision for status in self.store.statuses()}
        assert latest == {mission_id: len(known) for mission_id, known in self.contents.items()}
        planned = self.store.planned()
        assert sorted(self.plans, key=lambda each: (each.mission_id, each.number)) == planned
        assert all(self.store.plan(revision) == plan for revision, plan in self.plans.items())


TestWalk = Walk.TestCase
TestWalk.settings = settings(max_examples=15, stateful_step_count=25, deadline=None, derandomize=True)
