"""Stops and crashes: every accepted mission ends in a plan or an error, none twice under one revision."""

from __future__ import annotations

import random
import signal
import subprocess
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
import psutil
import pytest

from oxbow import Client
from oxbow.bus.client import Bus
from oxbow.contracts import MissionState, MissionStatus
from oxbow.errors import Internal, Unavailable
from oxbow.mission.file import parse_mission
from oxbow_mission.database import Database
from oxbow_mission.revision import Request
from oxbow_mission.schema import SCHEMA
from oxbow_mission.store import Store
from tests.support.mission_files import INFEASIBLE_SEED, POISON_SEED, listening, mission_file, revision_of

pytestmark = pytest.mark.processes

WAIT_S = 30.0
KILLS = 6
MISSIONS = 8

Process = subprocess.Popen[bytes]


def test_an_accepted_mission_waits_for_its_stages_and_outlives_a_stop(
    router: str, start_service: Callable[[], Process], start_stages: Callable[[], None]
) -> None:
    service = start_service()
    with Client(router, timeout_s=WAIT_S) as client:
        receipt = client.submit(mission_file(), mission_id="patient")
        service.send_signal(signal.SIGTERM)
        assert service.wait(WAIT_S) == 0
        start_service()
        assert client.status("patient").revision == receipt.revision
        start_stages()
        assert revision_of(client.plan(mission_file(), mission_id="patient")) == receipt.revision


def test_a_second_service_on_one_store_is_refused(router: str, start_service: Callable[[], Process]) -> None:
    start_service()
    with Client(router, timeout_s=WAIT_S):
        assert start_service().wait(WAIT_S) == 4


def test_a_full_disk_loses_no_mission(
    router: str, start_service: Callable[[], Process], start_stages: Callable[[], None]
) -> None:
    service = start_service()
    with Client(router, timeout_s=WAIT_S) as client:
        client.submit(mission_file(), mission_id="full")
        psutil.Process(service.pid).rlimit(psutil.RLIMIT_FSIZE, (1, 1))
        # The service says why and ends; on a busy machine its link may be gone before the reply is.
        with pytest.raises((Internal, Unavailable)):
            client.submit(mission_file(), mission_id="too-much")
        start_stages()
        assert service.wait(WAIT_S) == 1
        start_service()
        assert revision_of(client.plan(mission_file(), mission_id="full")) == 1
        assert [status.mission_id for status in client.statuses()] == ["full"]


def test_a_store_that_is_removed_ends_the_service_and_is_not_begun_anew(
    router: str, tmp_path: Path, start_service: Callable[[], Process]
) -> None:
    service = start_service()
    with Client(router, timeout_s=WAIT_S) as client:
        client.submit(mission_file(), mission_id="kept")
        (tmp_path / "missions.sqlite3").unlink()
        assert service.wait(WAIT_S) == 1
    assert start_service().wait(WAIT_S) == 4
    assert not (tmp_path / "missions.sqlite3").exists()


def test_what_was_kept_but_not_yet_published_is_published_at_the_start(
    bus: Bus, tmp_path: Path, start_service: Callable[[], Process]
) -> None:
    with Database(tmp_path, SCHEMA) as database:
        store = Store(database)
        store.accept("lake", Request(mission_file(), b"{}", "print"))
        job = store.claim()
        assert job is not None
        store.finish(job.revision, b"a plan")
    with listening(bus, "oxbow/v1/mission/lake/*") as samples:
        start_service()
        heard = [samples.get(timeout=WAIT_S) for _ in range(2)]
    assert heard[0] == ("oxbow/v1/mission/lake/plan", b"a plan")
    assert msgspec.json.decode(heard[1][1], type=MissionStatus).state is MissionState.DONE


def test_a_poisoned_mission_fails_alone_though_the_service_is_killed(
    router: str, start_service: Callable[[], Process], start_stages: Callable[[], None]
) -> None:
    start_stages()
    service = start_service()
    with Client(router, timeout_s=WAIT_S) as client:
        for number in range(10):
            seed = POISON_SEED if number == 3 else 50
            client.submit(mission_file(), mission_id=f"lake-{number}", seed=seed)
        for _ in range(3):
            service.kill()
            service.wait()
            service = start_service()
            give_up = time.monotonic() + WAIT_S
            while not client.statuses():
                assert time.monotonic() < give_up
        statuses = client.statuses()
        while not all(status.state.is_final for status in statuses):
            assert time.monotonic() < give_up
            time.sleep(0.05)
            statuses = client.statuses()
    failed = [status for status in statuses if status.state is MissionState.FAILED]
    assert [status.mission_id for status in failed] == ["lake-3"]
    assert failed[0].error is not None
    assert "invalid reply" in failed[0].error.message


def test_killed_at_random_moments(
    router: str, bus: Bus, start_service: Callable[[], Process], start_stages: Callable[[], None]
) -> None:
    """Two revisions each of several missions, while the service is killed whenever so many statuses came."""
    moments = random.Random(2016)
    heard = threading.Semaphore(0)
    published: defaultdict[tuple[str, int], set[bytes]] = defaultdict(set)
    lock = threading.Lock()

    def on_plan(key: str, payload: bytes) -> None:
        with lock:
            published[key.split("/")[-2], revision_of(parse_mission(payload))].add(payload)

    bus.subscribe("oxbow/v1/mission/*/plan", on_plan)
    bus.subscribe("oxbow/v1/mission/*/status", lambda _key, _payload: heard.release())
    start_stages()
    service = start_service()
    with Client(router, timeout_s=WAIT_S) as client, ThreadPoolExecutor(MISSIONS) as pool:

        def submit_twice(number: int) -> list[MissionStatus]:
            seed = INFEASIBLE_SEED if number == 0 else 40 * number
            return [
                client.submit(mission_file(Safety=safety), mission_id=f"lake-{number}", seed=seed)
                for safety in (1, 2)
            ]

        submitted = [pool.submit(submit_twice, number) for number in range(MISSIONS)]
        for _ in range(KILLS):
            for _ in range(moments.randrange(30)):
                heard.acquire(timeout=0.2)
            service.kill()
            service.wait()
            service = start_service()
        receipts = [receipt for future in submitted for receipt in future.result(WAIT_S)]
        assert [receipt.revision for receipt in receipts] == [1, 2] * MISSIONS

        give_up = time.monotonic() + WAIT_S
        while not all(status.state.is_final for status in client.statuses()):
            assert time.monotonic() < give_up
            time.sleep(0.05)
        latest = {status.mission_id: status for status in client.statuses()}
        kept = {(update.mission_id, update.revision): update.mission for update in client.plans(timeout_s=0.1)}

    planned = {(f"lake-{number}", revision) for number in range(1, MISSIONS) for revision in (1, 2)}
    assert kept.keys() == planned
    assert latest["lake-0"].state is MissionState.FAILED
    assert {status.revision for status in latest.values()} == {2}
    assert published.keys() == planned
    for revision, payloads in published.items():
        assert [parse_mission(payload) for payload in payloads] == [kept[revision]]
