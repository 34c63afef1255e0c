"""What a client makes of what others put and answer: it follows plans of the mission service, and nothing else."""

from __future__ import annotations

import json
import logging
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import msgspec
import pytest

from oxbow import Client
from oxbow.bus.client import Bus
from oxbow.bus.router import start_router
from oxbow.contracts import PLAN_KEY, MissionState, MissionStatus, live_key, mission_key
from oxbow.errors import Cancelled, ErrorCode, Internal, InvalidRequest, OxbowError
from oxbow.mission.file import mission_json, parse_mission
from oxbow.planning.submission import Submission, SubmissionParameters
from tests.support.mission_files import listening, mission_file, revision_of
from tests.support.mission_processes import STAGES, end, launch

pytestmark = pytest.mark.processes

WAIT_S = 30.0


def forged(payload: bytes, **fields: Any) -> bytes:
    """A plan with other values in its `Plan` object."""
    document = json.loads(payload)
    document["Plan"] |= fields
    return json.dumps(document).encode()


# --------------------------------------------------------------------------- what is put by others


def delete(bus: Bus, key: str) -> None:
    bus._session.delete(key)


FALSE: dict[str, tuple[Callable[[Bus, str, bytes], None], str]] = {
    "malformed": (lambda bus, key, _plan: bus.publish(key, b"{"), "not JSON"),
    "no text": (lambda bus, key, _plan: bus.publish(key, b"\xff\xfe"), "ignored"),
    "without a plan": (lambda bus, key, _plan: bus.publish(key, mission_file()), "has no mission_id"),
    "deleted": (lambda bus, key, _plan: delete(bus, key), "ignored"),
    "of another mission": (
        lambda bus, key, plan: bus.publish(key, forged(plan, mission_id="another")),
        "is 'another'; expected that of its key",
    ),
    "a revision that jumps": (
        lambda bus, key, plan: bus.publish(key, forged(plan, revision=99)),
        "revision 99 is not kept with that content",
    ),
    "the next revision, forged": (
        lambda bus, key, plan: bus.publish(key, forged(plan, revision=2)),
        "revision 2 is not kept with that content",
    ),
    "revision 0": (lambda bus, key, plan: bus.publish(key, forged(plan, revision=0)), ""),
}


@pytest.mark.parametrize("what", FALSE)
def test_what_the_service_does_not_keep_is_named_and_passed_over(
    client: Client, bus: Bus, what: str, caplog: pytest.LogCaptureFixture
) -> None:
    put, reason = FALSE[what]
    mission_id = f"false-{what.replace(' ', '-').replace(',', '')}"
    first = client.plan(mission_file(), mission_id=mission_id)
    with client.plans(mission_id, timeout_s=WAIT_S) as updates, caplog.at_level(logging.WARNING):
        assert next(updates).revision == 1
        put(bus, mission_key(mission_id, "plan"), mission_json(first))
        client.plan(mission_file(Safety=3), mission_id=mission_id)
        update = next(updates)
    assert (update.revision, update.mission.safety_m) == (2, 3.0)
    assert reason in caplog.text


def test_false_statuses_are_named_and_passed_over(
    client: Client, bus: Bus, caplog: pytest.LogCaptureFixture
) -> None:
    heard: list[MissionStatus] = []
    begun = threading.Event()

    def on_status(status: MissionStatus) -> None:
        heard.append(status)
        begun.set()

    key = mission_key("false-status", "status")
    with ThreadPoolExecutor(1) as pool, caplog.at_level(logging.WARNING):
        planned = pool.submit(
            client.plan, mission_file(), mission_id="false-status", seed=500, on_status=on_status
        )
        assert begun.wait(WAIT_S)
        other = MissionStatus(mission_id="other", revision=9, state=MissionState.DONE, time_s=0.0)
        for payload in (b"{", b"\xff", b"[]", msgspec.json.encode(other)):
            bus.publish(key, payload)
        delete(bus, key)
        planned.result(WAIT_S)
    assert {status.mission_id for status in heard} == {"false-status"}
    assert "is of 'other'" in caplog.text


# --------------------------------------------------------------------------- what others answer


@pytest.fixture
def impostor() -> Iterator[tuple[str, dict[str, Any]]]:
    """A router, and someone on it who answers for the mission service by whatever a test wants."""
    running = start_router(timeout_s=WAIT_S)
    answers: dict[str, Any] = {}
    with Bus.connect(running.endpoint) as session:
        for what, key in (("plan", PLAN_KEY), ("status", "oxbow/v1/mission/*/*")):

            def answer(key: str, _parameters: Any, payload: bytes, what: str = what) -> Any:
                yield key, answers[what](payload)

            session.answer(key, answer, parameters=SubmissionParameters.__struct_fields__)
        session.declare_live(live_key("mission", "impostor"))
        yield running.endpoint, answers
    running.process.terminate()
    running.process.wait(10.0)


def planned(mission: bytes, **fields: Any) -> bytes:
    """A mission with the plan of another one, under an id of its own."""
    document = json.loads(mission)
    document["Plan"] = json.loads(PLAN) | {"mission_id": Submission(parse_mission(mission)).mission_id} | fields
    return json.dumps(document).encode()


PLAN = json.dumps(
    {
        "method": "Transect",
        "seed": 0,
        "spacing_m": 10.0,
        "length_m": 10.0,
        "max_length_m": 20.0,
        "duration_s": 10.0,
        "tolerance_m": 1.0,
        "compression": 1.0,
        "versions": {},
        "revision": 1,
        "certificate": {
            "length_m": 10.0,
            "duration_s": 10.0,
            "waypoints": 2,
            "is_simple": True,
            "crossings": 0,
            "outside_m": 0.0,
            "unsafe_m": 0.0,
            "components": 1,
            "free_area_m2": 1.0,
            "judged_area": 1.0,
            "cover_radius_m": [1.0, 2.0],
            "least_radius_m": 1.0,
            "q": 2.0,
            "mean_distance_m": 1.0,
            "p95_distance_m": 1.0,
            "mean_ratio": 1.0,
            "p95_ratio": 1.0,
        },
    }
)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda _mission: b"{", "is not a plan"),
        (lambda mission: mission, "is not a plan"),
        (lambda mission: planned(mission, mission_id="another"), "the plan of mission 'another'"),
        (lambda mission: planned(mission, revision=0), "revision 0"),
        (lambda mission: planned(mission_file(Safety=7), mission_id=own_id(mission)), "different content"),
    ],
)
def test_a_plan_that_is_not_of_the_mission_is_never_returned(
    impostor: tuple[str, dict[str, Any]], answer: Callable[[bytes], bytes], message: str
) -> None:
    endpoint, answers = impostor
    answers["plan"] = planned
    with Client(endpoint, timeout_s=WAIT_S) as client:
        assert revision_of(client.plan(mission_file())) == 1
        answers["plan"] = answer
        with pytest.raises(Internal, match=message):
            client.plan(mission_file())


def own_id(mission: bytes) -> str:
    return Submission(parse_mission(mission)).mission_id


def test_a_status_of_another_mission_is_never_returned(impostor: tuple[str, dict[str, Any]]) -> None:
    endpoint, answers = impostor
    other = MissionStatus(mission_id="other", revision=1, state=MissionState.DONE, time_s=0.0)
    with Client(endpoint, timeout_s=WAIT_S) as client:
        for payload in (b"{", msgspec.json.encode(other)):
            answers["status"] = lambda _document, payload=payload: payload
            calls: list[Callable[[], Any]] = [
                lambda: client.submit(mission_file(), mission_id="lake"),
                lambda: client.status("lake"),
                lambda: client.cancel("lake"),
            ]
            for call in calls:
                with pytest.raises(Internal, match="answered about another"):
                    call()


# --------------------------------------------------------------------------- what was not heard


def test_followers_catch_up_when_the_router_was_away(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    running = start_router(timeout_s=WAIT_S)
    processes = [
        launch(*STAGES, "--connect", running.endpoint),
        launch("-m", "oxbow_mission", "--connect", running.endpoint, "--home", str(tmp_path), "--workers", "2"),
    ]
    router = running.process
    try:
        with (
            Client(running.endpoint, timeout_s=WAIT_S) as client,
            client.plans("lake", history=False, timeout_s=WAIT_S) as updates,
        ):
            for revision in (1, 2, 3):
                client.submit(mission_file(Safety=revision), mission_id="lake", seed=300)
                router.kill()
                router.wait(10.0)
                time.sleep(0.5)  # long enough for the plan to be made, and published to nobody
                router = launch("-m", "oxbow.bus.router", "--listen", running.endpoint)
                assert next(updates).revision == revision
        outages = [record for record in caplog.records if "cannot ask" in record.message]
        assert len(outages) <= 6  # not one for each attempt
    finally:
        for process in (*processes, router):
            end(process)


# --------------------------------------------------------------------------- cancelling, and other clients


def test_a_mission_can_be_cancelled_while_it_waits_and_while_it_is_planned(client: Client, bus: Bus) -> None:
    with listening(bus, mission_key("running", "status")) as statuses, ThreadPoolExecutor(2) as pool:
        plans = []
        for mission_id, stage in (("running", "path"), ("waiting", "")):
            plans.append(pool.submit(client.plan, mission_file(), mission_id=mission_id, seed=3000))
            while (mission_id, stage) not in {(each.mission_id, each.stage) for each in client.statuses()}:
                time.sleep(0.02)
        for mission_id in ("waiting", "running"):
            status = client.cancel(mission_id)
            assert (status.mission_id, status.state) == (mission_id, MissionState.FAILED)
            assert status.error is not None
            assert status.error.code is ErrorCode.CANCELLED
        for plan in plans:
            with pytest.raises(Cancelled):
                plan.result(WAIT_S)
        while (msgspec.json.decode(statuses.get(timeout=WAIT_S)[1], type=MissionStatus)).error is None:
            pass
    client.plan(mission_file(), mission_id="after-them")
    assert client.status("running") == client.cancel("running")
    client.plan(mission_file(), mission_id="running")


def test_what_is_done_stays_done_and_what_is_unknown_is_said_to_be(client: Client) -> None:
    client.plan(mission_file(), mission_id="already-done")
    assert client.cancel("already-done").state is MissionState.DONE
    with pytest.raises(InvalidRequest, match="not kept"):
        client.cancel("unheard-of")


def test_another_clients_mission_does_not_wait_behind_those_of_one(client: Client, router: str) -> None:
    with Client(router, timeout_s=WAIT_S) as other:
        receipts = [client.submit(mission_file(), mission_id=f"slow-{number}", seed=3000) for number in range(4)]
        other.plan(mission_file(), mission_id="quick", seed=1)
        # The slow ones sleep, so they are not all done however busy the machine is.
        statuses = [client.cancel(receipt.mission_id) for receipt in receipts]
    assert MissionState.FAILED in {status.state for status in statuses}


def test_queries_of_a_client_that_left_hold_nothing(client: Client, router: str) -> None:
    leaver = Client(router, timeout_s=WAIT_S)

    def ask(number: int) -> None:
        with pytest.raises(OxbowError):
            leaver.plan(mission_file(Safety=number % 2), mission_id="left", seed=1000)

    threads = [threading.Thread(target=ask, args=(number,), daemon=True) for number in range(64)]
    for thread in threads:
        thread.start()
    while not [status for status in client.statuses() if status.mission_id == "left"]:
        time.sleep(0.02)
    leaver.close()
    client.plan(mission_file(), mission_id="stays")
    assert client.status("stays").state is MissionState.DONE
