"""What the store promises, and a random walk through everything that can happen to it."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from oxbow.contracts import MissionState
from oxbow.errors import Infeasible, Internal, InvalidMission, InvalidRequest, OxbowError, Unavailable
from oxbow_mission.database import Database
from oxbow_mission.revision import QueuedMission, Request, Revision
from oxbow_mission.schema import SCHEMA
from oxbow_mission.store import Store


def request(content: str) -> Request:
    return Request(document=content.encode(), parameters=b"{}", fingerprint=f"print of {content}")


@contextlib.contextmanager
def opened(home: Path) -> Iterator[Store]:
    with Database(home, SCHEMA) as database:
        yield Store(database)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with opened(tmp_path) as found:
        yield found


def claimed(store: Store) -> QueuedMission:
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


def test_an_outcome_is_final(store: Store) -> None:
    store.accept("lake", request("a"))
    revision = claimed(store).revision
    store.finish(revision, b"plan")
    with pytest.raises(Internal, match="not being planned"):
        store.finish(revision, b"another plan")
    with pytest.raises(Internal, match="not being planned"):
        store.fail(revision, Infeasible("no water"))
    assert store.plan(revision) == b"plan"


def test_a_stop_or_a_crash_blames_no_mission(tmp_path: Path) -> None:
    for _ in range(20):
        with opened(tmp_path) as store:
            store.accept("lake", request("a"))
            claimed(store)
    with opened(tmp_path) as store:
        assert claimed(store).revision == Revision("lake", 1)


def test_deaths_of_planner_processes_are_counted_over_restarts(tmp_path: Path) -> None:
    for deaths in (1, 2):
        with opened(tmp_path) as store:
            store.accept("lake", request("a"))
            assert store.note_death(claimed(store).revision) == deaths


def test_each_client_has_its_own_row_to_wait_in(store: Store) -> None:
    for mission_id, client in (("a1", "a"), ("a2", "a"), ("b1", "b"), ("a3", "a")):
        store.accept(mission_id, request("x"), client)
    assert store.waiting_clients() == ["a", "b"]
    job = store.claim("b")
    assert job is not None
    assert (job.revision.mission_id, job.client) == ("b1", "b")
    assert store.claim("b") is None


def test_what_waits_can_be_failed_before_it_is_planned(store: Store) -> None:
    store.accept("lake", request("a"))
    [revision] = store.open_revisions("lake")
    store.fail(revision, Internal("cancelled"))
    assert store.claim() is None
    assert store.open_revisions("lake") == []


def test_a_row_that_cannot_be_read_hides_no_other(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    for mission_id in ("lake", "sea", "pond"):
        store.accept(mission_id, request("a"))
    with store.database.transaction() as db:
        db.execute("UPDATE revision SET state = 'odd' WHERE mission_id = 'sea'")
        db.execute("UPDATE revision SET error = '{' WHERE mission_id = 'pond'")
    assert [status.mission_id for status in store.statuses()] == ["lake"]
    assert "sea" in caplog.text
    assert "pond" in caplog.text
    assert store.accept("pond", request("a")).revision == 2


@pytest.mark.parametrize("mission_id", ["a" * 65_530, "@lake", "a/b", "*"])
def test_an_id_that_can_be_no_key_is_set_aside(tmp_path: Path, mission_id: str) -> None:
    with opened(tmp_path) as store:
        with pytest.raises(InvalidRequest):
            store.accept(mission_id, request("a"))
        store.accept("old", request("a"))
        with store.database.transaction() as db:
            db.execute("UPDATE revision SET mission_id = ?", (mission_id,))
        store.accept("lake", request("a"))
    with opened(tmp_path) as store:
        assert claimed(store).revision.mission_id == "lake"
        assert store.claim() is None
        assert store.unannounced() == []
        assert [status.mission_id for status in store.statuses()] == ["lake"]


def test_a_store_of_the_first_schema_is_read(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        store.accept("lake", request("a"))
        store.finish(claimed(store).revision, b"plan of a")
        with store.database.transaction() as db:
            db.execute("ALTER TABLE revision DROP COLUMN client")
            db.execute(
                "INSERT INTO revision (mission_id, revision, state, changed_s, accepted_s, fingerprint,"
                " parameters, document) VALUES ('lake', 2, 'failed', 0, 0, 'junk', x'', x'')"
            )
            db.execute("PRAGMA user_version = 1")
    with opened(tmp_path) as store:
        [status] = store.statuses()
        assert (status.revision, status.state) == (1, MissionState.DONE)
        assert store.accept("lake", request("b"), "client").revision == 2


class Walk(RuleBasedStateMachine):
    """Accept, plan, announce and crash in any order, beside a model of what must come of it."""

    def __init__(self) -> None:
        super().__init__()
        self.home = Path(tempfile.mkdtemp(prefix="oxbow-store-"))
        self.store = Store(Database(self.home, SCHEMA))
        self.contents: dict[str, list[str]] = {}
        self.plans: dict[Revision, bytes] = {}
        self.jobs: list[QueuedMission] = []

    def teardown(self) -> None:
        self.store.database.close()
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
        self.store.database.close()
        self.store = Store(Database(self.home, SCHEMA))
        self.jobs.clear()

    @invariant()
    def nothing_is_lost_or_changed(self) -> None:
        latest = {status.mission_id: status.revision for status in self.store.statuses()}
        assert latest == {mission_id: len(known) for mission_id, known in self.contents.items()}
        planned = self.store.planned()
        assert sorted(self.plans, key=lambda each: (each.mission_id, each.number)) == planned
        assert all(self.store.plan(revision) == plan for revision, plan in self.plans.items())


TestWalk = Walk.TestCase
TestWalk.settings = settings(max_examples=15, stateful_step_count=25)
