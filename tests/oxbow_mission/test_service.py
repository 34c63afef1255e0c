"""The mission service as a DSS and guidance see it: real processes, a real bus, a real store."""

from __future__ import annotations

import contextlib
import sqlite3
import threading
import time
from pathlib import Path
from typing import TypeVar

import msgspec
import pytest

from oxbow import Client
from oxbow.bus.client import Bus
from oxbow.contracts import PLAN_KEY, MissionState, MissionStatus, mission_key
from oxbow.errors import DeadlineExceeded, ErrorCode, Infeasible, Internal, InvalidMission, InvalidRequest
from oxbow.mission.file import parse_mission
from oxbow.wire import codec
from oxbow.wire.introspection import Info, Ping, Stats
from oxbow.wire.recording import LayerKind, Stamped
from tests.support.mission_files import (
    BLOOM,
    BROKEN_SEED,
    INFEASIBLE_SEED,
    Samples,
    listening,
    mission_file,
    revision_of,
)

pytestmark = pytest.mark.processes

T = TypeVar("T", Ping, Info, Stats)
WAIT_S = 20.0


def status_of(samples: Samples) -> MissionStatus:
    return msgspec.json.decode(samples.get(timeout=WAIT_S)[1], type=MissionStatus)


def final_status(samples: Samples) -> MissionStatus:
    while not (status := status_of(samples)).state.is_final:
        pass
    return status


# --------------------------------------------------------------------------- plan and submit


def test_plan_returns_the_completed_mission_file(client: Client) -> None:
    mission = client.plan(mission_file(Colour="blue"), mission_id="complete", seed=3)
    assert mission.plan is not None
    assert (mission.plan.mission_id, mission.plan.revision, mission.plan.seed) == ("complete", 1, 3)
    assert mission.extra == {"Colour": "blue"}
    assert mission.master_path is not None
    assert mission.master_path[0] == mission.launch


def test_progress_comes_in_order_and_names_each_stage(client: Client) -> None:
    heard: list[MissionStatus] = []
    done = threading.Event()

    def on_status(status: MissionStatus) -> None:
        heard.append(status)
        if status.state.is_final:
            done.set()

    client.plan(mission_file(), mission_id="progress", on_status=on_status)
    assert done.wait(WAIT_S)
    assert [status.state for status in heard] == ["accepted", *["planning"] * 5, "done"]
    assert [status.stage for status in heard[2:6]] == ["contour", "decomposition", "path", "certificate"]
    fractions = [status.fraction for status in heard]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_a_treatment_is_planned_by_its_own_stages(client: Client) -> None:
    heard: list[MissionStatus] = []
    file = mission_file(MissionType="treat", Swath=5.0, PriorModel=BLOOM)
    mission = client.plan(file, mission_id="treatment", on_status=heard.append)
    assert mission.slave_path is not None
    assert len(mission.slave_path) == 3
    assert mission.master_path is None
    assert mission.plan is not None
    assert mission.plan.treatment is not None
    assert [spot.hot_spot for spot in mission.plan.treatment.hot_spots] == ["features[0]"]
    assert [status.stage for status in heard if status.stage] == ["contour", "assignment", "certificate"]
    fractions = [status.fraction for status in heard]
    assert fractions == sorted(fractions)


def test_both_vehicles_are_planned_and_guidance_is_told_the_threshold(client: Client) -> None:
    threshold = {"Sensor": "chl", "Value": 30.0}
    client.plan(mission_file(MissionType="adap&treat", Bloom=threshold), mission_id="threshold")
    with client.plans("threshold", timeout_s=WAIT_S) as updates:
        mission = next(updates).mission
    assert mission.bloom is not None
    assert (mission.bloom.sensor, mission.bloom.value) == ("chl", 30.0)
    assert mission.master_path is not None
    assert mission.slave_path is not None


def test_the_same_request_is_answered_from_the_store(client: Client) -> None:
    first = client.plan(mission_file(), mission_id="same")
    assert client.plan(first, mission_id="same") == first
    assert client.submit(mission_file(), mission_id="same").state is MissionState.DONE
    assert revision_of(client.plan(mission_file(Safety=2), mission_id="same")) == 2


def test_an_infeasible_mission_fails_with_its_reason(client: Client) -> None:
    with pytest.raises(Infeasible, match="path: no water is left"):
        client.plan(mission_file(), mission_id="infeasible", seed=INFEASIBLE_SEED)
    status = client.status("infeasible")
    assert status.state is MissionState.FAILED
    assert status.error is not None
    assert status.error.code is ErrorCode.INFEASIBLE


def test_a_fault_of_a_stage_is_told_and_tried_anew_when_asked_again(client: Client) -> None:
    for revision in (1, 2):
        with pytest.raises(Internal, match="a fault of the stage"):
            client.plan(mission_file(), mission_id="broken", seed=BROKEN_SEED)
        assert client.status("broken").revision == revision


def test_a_deadline_is_kept(client: Client, bus: Bus) -> None:
    with listening(bus, mission_key("late", "status")) as statuses:
        client.submit(mission_file(), mission_id="late", deadline_s=0.3, seed=1_000)
        error = final_status(statuses).error
    assert error is not None
    assert error.code is ErrorCode.TIMEOUT
    with pytest.raises(DeadlineExceeded):
        client.plan(mission_file(), mission_id="late", seed=1_000, timeout_s=0.3)


@pytest.mark.parametrize(
    ("document", "message"),
    [
        (b"{", "Mission File: is not JSON"),
        (mission_file(MissionType="treat"), "PriorModel: has no hot spot"),
        (mission_file(Vehicles=[{"Name": "a", "Role": "crew"}]), r"Vehicles\[0\].Role: is \"crew\""),
        (mission_file(Safety=-1), "Safety: is -1"),
        (mission_file(LaunchPoint={"lat": 5.0, "long": 45.0}), "LaunchPoint: .*swapped"),
    ],
)
def test_an_invalid_mission_is_refused_by_query_and_by_put(
    client: Client, bus: Bus, document: bytes, message: str
) -> None:
    with pytest.raises(InvalidMission, match=message):
        bus.query(mission_key("invalid", "request"), document, timeout_s=WAIT_S)
    with listening(bus, mission_key("invalid", "status")) as samples:
        bus.publish(mission_key("invalid", "request"), document)
        status = status_of(samples)
    assert status.state is MissionState.FAILED
    assert status.error is not None
    with pytest.raises(InvalidMission, match=message):
        raise status.error.error()
    assert status.revision == 0
    with pytest.raises(InvalidRequest, match="not kept"):
        client.status("invalid")


def test_a_refused_put_changes_nothing_of_the_mission_and_publishes_no_replan(client: Client, bus: Bus) -> None:
    client.plan(mission_file(), mission_id="refused")
    with (
        listening(bus, mission_key("refused", "status")) as statuses,
        listening(bus, mission_key("refused", "replan")) as replans,
    ):
        bus.publish(mission_key("refused", "request"), b"{")
        assert status_of(statuses).revision == 0
        assert client.status("refused").state is MissionState.DONE
        bus.publish(mission_key("refused", "request"), mission_file())
        assert status_of(statuses).state is MissionState.DONE
        assert replans.empty()


def test_the_first_plan_after_a_failure_is_no_replan(client: Client) -> None:
    with pytest.raises(Infeasible):
        client.plan(mission_file(), mission_id="at-last", seed=INFEASIBLE_SEED)
    with client.replans("at-last", timeout_s=WAIT_S) as replans:
        for safety in (1, 2):
            client.plan(mission_file(Safety=safety), mission_id="at-last")
        assert next(replans).revision == 3


def test_an_id_that_cannot_be_kept_is_answered_under_its_encoded_form(client: Client, bus: Bus) -> None:
    with listening(bus, "oxbow/v1/mission/*/status") as samples:
        for bad_id in ("my lake", "*"):
            bus.publish(f"oxbow/v1/mission/{bad_id}/request", mission_file())
        keys = {samples.get(timeout=WAIT_S)[0] for _ in range(2)}
    assert keys == {"oxbow/v1/mission/my%20lake/status", "oxbow/v1/mission/%2A/status"}
    with pytest.raises(InvalidRequest, match="id: is 'my lake'"):
        client.submit(mission_file(), mission_id="my lake")


def test_unknown_parameters_are_refused(client: Client, bus: Bus) -> None:
    assert client.statuses() is not None
    client.plan(mission_file(), mission_id="asked")
    every = "method, seed, .*"
    for selector, given, expected in (
        (PLAN_KEY, "sed=1", every),
        (mission_key("asked", "request"), "sed=1", every),
        (mission_key("asked", "status"), "before=1", "none"),
        (mission_key("asked", "cancel"), "before=1", "none"),
        (mission_key("asked", "plan"), "before=1", "after and nothing else"),
        (f"{mission_key('asked', 'plan')}/*", "after=0;before=1", "after and nothing else"),
        ("oxbow/v1/stage/mission/*/@ping", "before=1", "none"),
    ):
        with pytest.raises(InvalidRequest, match=f"^parameters: has '(sed|before)'; expected {expected}"):
            bus.query(f"{selector}?{given}", mission_file(), timeout_s=WAIT_S)


def test_a_parameter_that_is_given_twice_is_refused(client: Client, bus: Bus) -> None:
    assert client.statuses() is not None
    twice = r"^parameters: has '(seed|after)' twice; expected each name once"
    for selector in (f"{PLAN_KEY}?seed=1;seed=2", f"{mission_key('asked', 'plan')}/*?after=1;after=1"):
        with pytest.raises(InvalidRequest, match=twice):
            bus.query(selector, mission_file(), timeout_s=WAIT_S)


def test_a_parameter_of_zenohs_own_is_no_part_of_a_question(client: Client, bus: Bus) -> None:
    client.plan(mission_file(), mission_id="asked")
    [(key, _)] = bus.query(f"{mission_key('asked', 'status')}?_anyke", timeout_s=WAIT_S)
    assert key == mission_key("asked", "status")


def test_what_is_unknown_cannot_be_cancelled_and_is_named(client: Client, bus: Bus) -> None:
    assert client.statuses() is not None
    with pytest.raises(InvalidRequest, match=r"^mission unheard-of: is not kept here"):
        bus.query(mission_key("unheard-of", "cancel"), timeout_s=WAIT_S)


# --------------------------------------------------------------------------- puts, plans and replans


def test_a_put_is_answered_by_status_and_plan(client: Client, bus: Bus) -> None:
    with (
        listening(bus, mission_key("put", "status")) as statuses,
        listening(bus, mission_key("put", "plan")) as plans,
    ):
        bus.publish(mission_key("put", "request"), mission_file())
        assert final_status(statuses).state is MissionState.DONE
        planned = parse_mission(plans.get(timeout=WAIT_S)[1])
    assert revision_of(planned) == 1
    assert client.status("put").state is MissionState.DONE


def test_a_put_of_what_is_known_is_answered_by_its_status(client: Client, bus: Bus) -> None:
    client.plan(mission_file(), mission_id="known")
    with listening(bus, mission_key("known", "status")) as statuses:
        bus.publish(mission_key("known", "request"), mission_file())
        assert status_of(statuses) == client.status("known")


def test_a_late_joiner_has_every_plan_once_and_in_order(client: Client) -> None:
    for safety in (1, 2):
        client.plan(mission_file(Safety=safety), mission_id="late-joiner")
    with client.plans("late-joiner", timeout_s=WAIT_S) as updates:
        assert [next(updates).revision for _ in range(2)] == [1, 2]
        client.plan(mission_file(Safety=3), mission_id="late-joiner")
        update = next(updates)
        assert (update.mission_id, update.revision, update.mission.safety_m) == ("late-joiner", 3, 3.0)
        updates.close()
        assert list(updates) == []


def test_only_new_plans_without_history(client: Client) -> None:
    client.plan(mission_file(), mission_id="news")
    with client.plans(history=False, timeout_s=WAIT_S) as updates:
        client.plan(mission_file(Safety=1), mission_id="news")
        assert next(updates).revision == 2


def test_plans_of_all_missions(client: Client) -> None:
    client.plan(mission_file(), mission_id="one-of-all")
    kept = {(update.mission_id, update.revision) for update in client.plans(timeout_s=0.1)}
    assert ("one-of-all", 1) in kept
    assert {mission_id for mission_id, _ in kept} <= {status.mission_id for status in client.statuses()}


def test_replans_are_the_plans_after_the_first(client: Client) -> None:
    client.plan(mission_file(), mission_id="guided")
    with client.replans("guided", timeout_s=WAIT_S) as replans:
        for safety in (1, 2):
            client.plan(mission_file(Safety=safety), mission_id="guided")
        assert [next(replans).revision for _ in range(2)] == [2, 3]
    assert [update.revision for update in client.replans("guided", timeout_s=0.1)] == [2, 3]


def test_updates_end_with_their_client(client: Client, router: str) -> None:
    assert client.statuses() is not None
    other = Client(router)
    updates = other.plans("nobody")
    threading.Timer(0.2, other.close).start()
    assert list(updates) == []


def test_history_by_key(client: Client, bus: Bus) -> None:
    for safety in (1, 2, 3):
        client.plan(mission_file(Safety=safety), mission_id="kept")

    def ask(key: str) -> list[tuple[str, int]]:
        replies = bus.query(f"oxbow/v1/mission/{key}", timeout_s=WAIT_S)
        return [
            (reply.removeprefix("oxbow/v1/mission/"), revision_of(parse_mission(plan))) for reply, plan in replies
        ]

    assert ask("kept/plan") == [("kept/plan", 3)]
    assert ask("kept/plan/2") == [("kept/plan/2", 2)]
    assert ask("kept/plan/*") == [(f"kept/plan/{revision}", revision) for revision in (1, 2, 3)]
    assert ask("kept/replan/*") == [(f"kept/replan/{revision}", revision) for revision in (2, 3)]
    assert ("kept/plan", 3) in ask("*/plan")
    with pytest.raises(InvalidRequest, match="kept/plan/4: is not kept here"):
        ask("kept/plan/4")


def test_an_unknown_mission_has_no_status(client: Client) -> None:
    with pytest.raises(InvalidRequest, match="unheard-of"):
        client.status("unheard-of")


def test_reports_are_stored(client: Client, bus: Bus, home: Path) -> None:
    client.plan(mission_file(), mission_id="reported")
    for mission_id, payload in (
        ("reported", b'{"v": 1}'),
        ("unheard-of", b"{}"),
        ("reported", b'{"v": 2}'),
    ):
        bus.publish(mission_key(mission_id, "report"), payload)
    give_up = time.monotonic() + WAIT_S
    while len(rows := stored_reports(home)) < 2:
        assert time.monotonic() < give_up
        time.sleep(0.02)
    assert rows == [("reported", b'{"v": 1}'), ("reported", b'{"v": 2}')]


def stored_reports(home: Path) -> list[tuple[str, bytes]]:
    with contextlib.closing(sqlite3.connect(f"file:{home}/missions.sqlite3?mode=ro", uri=True)) as db:
        return db.execute("SELECT mission_id, payload FROM report ORDER BY rowid").fetchall()


# --------------------------------------------------------------------------- layers


@pytest.mark.parametrize(("seed", "outcome"), [(0, "done"), (INFEASIBLE_SEED, "failed")])
def test_a_run_shows_its_site_and_its_outcome(client: Client, bus: Bus, seed: int, outcome: str) -> None:
    mission_id = f"shown-{outcome}"
    with listening(bus, "oxbow/v1/layer/*/mission/*") as samples:
        client.submit(mission_file(), mission_id=mission_id, seed=seed)
        shown = [codec.decode(samples.get(timeout=WAIT_S)[1], Stamped) for _ in range(2)]
    layers = {stamped.layer.name: stamped.layer for stamped in shown}
    assert layers["site"].labels == ("outline", "launch", "recovery")
    assert layers[outcome].kind is LayerKind.LOG
    assert {"contour_s", "decomposition_s", "path_s"} <= layers[outcome].scalars.keys()
    assert {stamped.mission_id for stamped in shown} == {mission_id}
    assert len({stamped.request_id for stamped in shown}) == 1
    assert shown[0].origin == pytest.approx((45.0, 5.0), abs=0.01)


# --------------------------------------------------------------------------- introspection


def test_the_service_tells_about_itself(client: Client, bus: Bus) -> None:
    client.plan(mission_file(), mission_id="counted")

    def ask(what: str, kind: type[T]) -> T:
        [(_, payload)] = bus.query(f"oxbow/v1/stage/mission/*/@{what}", timeout_s=WAIT_S)
        return msgspec.json.decode(payload, type=kind)

    ping, info, stats = ask("ping", Ping), ask("info", Info), ask("stats", Stats)
    assert bus.instances("mission") == (ping.instance,) == (info.instance,) == (stats.instance,)
    assert info.worker_pid == ping.pid
    assert stats.served >= 1
    assert 0.0 < stats.mean_s < WAIT_S
    assert stats.session_rss_bytes > 2**20
