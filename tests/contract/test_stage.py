"""A stage's processes: full, late, killed, poisoned, drained, asked about themselves."""

from __future__ import annotations

import os
import signal
import subprocess
import time
import uuid
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
import psutil
import pytest

from oxbow.bus import Envelope
from oxbow.bus.client import Bus, BusCall
from oxbow.bus.router import RouterProcess
from oxbow.contracts import INTROSPECTION, MAX_REQUEST_BYTES, any_introspection_key
from oxbow.errors import Busy, DeadlineExceeded, Infeasible, Internal, InvalidRequest, OxbowError, Unavailable
from oxbow.stage import serve_stage
from oxbow.wire import codec
from oxbow.wire.introspection import Info, Ping, Stats
from tests.support.bus_processes import Replica, end, launch, run_python, wait_gone, wait_until
from tests.support.echo_stage import ECHO, NAMES, SQUARE, Deed, EchoRequest

pytestmark = pytest.mark.processes

StartReplicas = Callable[..., list[Replica]]


def envelope(seconds: float = 30.0) -> Envelope:
    return Envelope(request_id=uuid.uuid4().hex, deadline_s=time.time() + seconds)


def stats(bus: Bus, instance: str = "r0") -> Stats:
    [(_, data)] = bus.query(ECHO.introspection_key(instance, "stats"), timeout_s=5.0)
    return msgspec.json.decode(data, type=Stats)


def ask(bus: Bus, request: EchoRequest, attachment: Envelope) -> bytes | OxbowError:
    """One query to the replica r0, without a retry."""
    try:
        [(_, reply)] = bus.query(
            ECHO.instance_key("r0"),
            codec.encode(request),
            timeout_s=20.0,
            attachment=msgspec.json.encode(attachment),
        )
    except OxbowError as error:
        return error
    return reply


def test_a_full_queue_answers_busy(start_replicas: StartReplicas, bus: Bus) -> None:
    start_replicas(1, "--queue", "1")
    with ThreadPoolExecutor(6) as pool:
        slow = EchoRequest(shape=SQUARE, seconds=0.4)
        answers = list(pool.map(lambda _: ask(bus, slow, envelope()), range(6)))
    busy = [answer for answer in answers if isinstance(answer, Busy)]
    assert 1 <= len(busy) <= 5
    assert len(busy) + sum(isinstance(answer, bytes) for answer in answers) == 6
    assert stats(bus).busy == len(busy)


def test_callers_get_past_a_full_queue(start_replicas: StartReplicas, call: BusCall) -> None:
    start_replicas(1, "--queue", "1")
    with ThreadPoolExecutor(8) as pool:
        requests = [EchoRequest(text=str(i), shape=SQUARE, seconds=0.05) for i in range(8)]
        replies = list(pool.map(lambda request: call(ECHO, request), requests))
    assert [reply.text for reply in replies] == [str(i) for i in range(8)]


def test_two_replicas_share_the_requests(start_replicas: StartReplicas, bus: Bus, call: BusCall) -> None:
    start_replicas(2)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: call(ECHO, EchoRequest(shape=SQUARE, seconds=0.01)), range(20)))
    served = [stats(bus, instance).served for instance in ("r0", "r1")]
    assert sum(served) == 20
    assert min(served) >= 2


def test_a_late_request_is_stopped_and_the_next_one_served(
    start_replicas: StartReplicas, bus: Bus, call: BusCall
) -> None:
    start_replicas()
    with pytest.raises(DeadlineExceeded, match="deadline"):
        bus.call(ECHO, EchoRequest(shape=SQUARE, seconds=60.0), envelope(1.0))
    assert call(ECHO, EchoRequest(text="next", shape=SQUARE)).text == "next"
    assert stats(bus).worker_restarts == 1


def test_a_request_whose_deadline_passed_in_the_queue_is_not_started(
    start_replicas: StartReplicas, bus: Bus, tmp_path: Path
) -> None:
    start_replicas()
    log, begun = str(tmp_path / "handled"), tmp_path / "begun"
    slow = EchoRequest(text="first", shape=SQUARE, seconds=1.0, path=log, begun=str(begun))
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(bus.call, ECHO, slow, envelope())
        wait_until(begun.exists)
        with pytest.raises(DeadlineExceeded):
            bus.call(ECHO, EchoRequest(text="late", shape=SQUARE, path=log), envelope(0.2))
        first.result()
    assert Path(log).read_text() == "first\n"


def test_no_live_replica_is_reported_by_name(bus: Bus, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bus, "patience_s", 0.0)
    with pytest.raises(
        Unavailable, match=r"echo: has no live replica on the bus at tcp/127\.0\.0\.1:\d+.*tried no replica"
    ):
        bus.call(ECHO, EchoRequest(shape=SQUARE), envelope())
    with pytest.raises(Unavailable, match=r"no live echo, path after 0\.1 s"):
        bus.wait_ready(["echo", "path"], 0.1)


def test_kill_9_of_one_of_two_replicas_loses_no_request(
    start_replicas: StartReplicas, bus: Bus, call: BusCall
) -> None:
    victim, _ = start_replicas(2)
    with ThreadPoolExecutor(8) as pool:
        requests = [EchoRequest(text=str(i), shape=SQUARE, seconds=0.01) for i in range(60)]
        replies = [pool.submit(call, ECHO, request) for request in requests]
        wait_until(lambda: sum(reply.done() for reply in replies) >= 15)
        victim.kill()
        assert [reply.result().text for reply in replies] == [str(i) for i in range(60)]
    wait_until(lambda: bus.instances("echo") == ("r1",))


def test_a_frozen_replica_is_left_for_another(start_replicas: StartReplicas, call: BusCall) -> None:
    frozen, _ = start_replicas(2)
    frozen.send_signal(signal.SIGSTOP)
    with ThreadPoolExecutor(4) as pool:
        replies = list(pool.map(lambda i: call(ECHO, EchoRequest(text=str(i), shape=SQUARE)), range(4)))
    assert [reply.text for reply in replies] == ["0", "1", "2", "3"]


def test_a_killed_worker_is_replaced_and_its_request_answered(
    start_replicas: StartReplicas, bus: Bus, call: BusCall, tmp_path: Path
) -> None:
    start_replicas()
    request = EchoRequest(text="at last", shape=SQUARE, deed=Deed.DIE_ONCE, path=str(tmp_path / "died"))
    assert call(ECHO, request).text == "at last"
    idle = msgspec.json.decode(bus.query(ECHO.introspection_key("r0", "info"), timeout_s=5.0)[0][1], type=Info)
    os.kill(idle.worker_pid, signal.SIGKILL)
    wait_gone(idle.worker_pid)
    assert call(ECHO, EchoRequest(text="again", shape=SQUARE)).text == "again"
    assert stats(bus).worker_restarts == 2


def test_a_request_that_kills_its_worker_ends_in_an_error(
    start_replicas: StartReplicas, bus: Bus, call: BusCall
) -> None:
    start_replicas()
    with pytest.raises(Internal, match=r"ended by SIGKILL; given up after .* \(tried r0: worker lost\)"):
        call(ECHO, EchoRequest(shape=SQUARE, deed=Deed.DIE))
    wait_until(lambda: stats(bus).worker_restarts == 3)
    assert call(ECHO, EchoRequest(text="unharmed", shape=SQUARE)).text == "unharmed"


def test_one_request_id_is_worked_on_once(start_replicas: StartReplicas, bus: Bus, tmp_path: Path) -> None:
    start_replicas()
    log = str(tmp_path / "handled")
    request, same = EchoRequest(text="once", shape=SQUARE, seconds=0.2, path=log), envelope()
    with ThreadPoolExecutor(3) as pool:
        answers = list(pool.map(lambda _: ask(bus, request, same), range(3)))
    answers.append(ask(bus, request, same))
    assert len(set(answers)) == 1
    assert Path(log).read_text() == "once\n"


def test_sigterm_answers_all_that_was_accepted(start_replicas: StartReplicas, bus: Bus) -> None:
    [replica] = start_replicas()
    with ThreadPoolExecutor(8) as pool:
        slow = EchoRequest(shape=SQUARE, seconds=0.1)
        answers = [pool.submit(ask, bus, slow, envelope()) for _ in range(8)]
        wait_until(lambda: (now := stats(bus)).served + now.queued >= 7)
        replica.terminate()
        assert all(isinstance(answer.result(), bytes) for answer in answers)
    assert replica.wait(10.0) == 0
    assert bus.instances("echo") == ()


def test_a_replica_tells_about_itself(start_replicas: StartReplicas, bus: Bus, call: BusCall) -> None:
    replicas = start_replicas(2)
    call(ECHO, EchoRequest(shape=SQUARE))
    told = {
        what: dict(bus.query(any_introspection_key(what), timeout_s=5.0, all_targets=True))
        for what in INTROSPECTION
    }
    for what, answers in told.items():
        assert set(answers) == {ECHO.introspection_key(instance, what) for instance in ("r0", "r1")}
    pings = [msgspec.json.decode(data, type=Ping) for data in told["ping"].values()]
    assert {ping.pid for ping in pings} == {replica.pid for replica in replicas}
    infos = [msgspec.json.decode(data, type=Info) for data in told["info"].values()]
    assert {(info.stage, info.handler) for info in infos} == {("echo", NAMES[1])}
    counts = [msgspec.json.decode(data, type=Stats) for data in told["stats"].values()]
    assert sum(count.served for count in counts) == 1
    assert all(count.session_rss_bytes > 2**20 and count.worker_rss_bytes > 2**20 for count in counts)
    schema = msgspec.json.decode(next(iter(told["schema"].values())))
    assert schema["request"] == {"$ref": "#/$defs/EchoRequest"}
    assert "Polygon as WKB" in schema["$defs"]["EchoRequest"]["properties"]["shape"]["description"]


def test_what_is_too_large_is_refused_by_size(start_replicas: StartReplicas, call: BusCall) -> None:
    start_replicas()
    with pytest.raises(InvalidRequest, match=rf"echo: is \d+ bytes; at most {MAX_REQUEST_BYTES}"):
        call(ECHO, EchoRequest(text="x" * (MAX_REQUEST_BYTES + 1), shape=SQUARE))
    with pytest.raises(Internal, match=rf"the reply is \d+ bytes; at most {MAX_REQUEST_BYTES}"):
        call(ECHO, EchoRequest(shape=SQUARE, deed=Deed.BLOAT))


ODD_ATTACHMENTS = [
    (b"", "attachment: is empty; expected JSON"),
    (b"\xff\xfe", "attachment: is not JSON"),
    (b'{"request_id":"\xff","deadline_s":1}', "attachment: is not JSON: a string is not UTF-8"),
    (b'{"a":' * 10_000, "attachment: is nested too deeply"),
    (b"[" * 100_000, "attachment: is 100000 bytes; at most 65536"),
    (b'{"request_id":"a/b","deadline_s":1}', "request_id: is 'a/b'"),
    (b'{"request_id":"r","deadline_s":1e300}', r"deadline_s: is 1e\+300; expected Unix time"),
    (b'{"request_id":"r","deadline_s":1,"mission_id":"@m"}', "mission_id: is '@m'"),
    (b'{"request_id":"r","deadline_s":1,"origin":[1e300,0]}', r"origin: is \(1e\+300, 0"),
    (b'{"request_id":"r","deadline_s":1,"part":"%s"}' % (b"p" * 200), r"part: is 'p+'\.\.\. \(200 characters\)"),
]


def test_every_query_has_an_answer(start_replicas: StartReplicas, bus: Bus) -> None:
    start_replicas()
    for attachment, message in ODD_ATTACHMENTS:
        with pytest.raises(InvalidRequest, match=message):
            bus.query(ECHO.instance_key("r0"), b"garbage", timeout_s=5.0, attachment=attachment)


def test_a_key_that_is_none_is_answered_by_those_that_are(start_replicas: StartReplicas, bus: Bus) -> None:
    start_replicas()
    key = ECHO.instance_key("r0")
    for unknown in ("ping", "a/b"):
        with pytest.raises(InvalidRequest, match=rf"key: is '{key}/{unknown}'; expected {key}, {key}/@ping"):
            bus.query(f"{key}/{unknown}", timeout_s=5.0)


def test_another_request_under_an_id_that_is_taken_gets_no_answer_of_it(
    start_replicas: StartReplicas, bus: Bus, tmp_path: Path
) -> None:
    start_replicas()
    same, begun = envelope(), tmp_path / "begun"
    slow = EchoRequest(text="first", shape=SQUARE, seconds=0.5, begun=str(begun))
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(ask, bus, slow, same)
        wait_until(begun.exists)
        while_at_work = ask(bus, EchoRequest(text="second", shape=SQUARE), same)
        assert isinstance(first.result(), bytes)
    afterwards = ask(bus, EchoRequest(text="third", shape=SQUARE), same)
    for refused in (while_at_work, afterwards):
        assert isinstance(refused, InvalidRequest)
        assert "the id of another request" in refused.message


def test_a_frozen_worker_costs_a_request_seconds_and_not_its_deadline(
    start_replicas: StartReplicas, bus: Bus, tmp_path: Path
) -> None:
    start_replicas()
    request = EchoRequest(text="thawed", shape=SQUARE, deed=Deed.FREEZE_ONCE, path=str(tmp_path / "frozen"))
    assert bus.call(ECHO, request, envelope(60.0)).text == "thawed"
    assert stats(bus).worker_restarts == 1


def test_a_stopped_worker_ends_with_its_session_process(start_replicas: StartReplicas) -> None:
    [replica] = start_replicas()
    worker = psutil.Process(replica.pid).children()[0]
    worker.suspend()
    wait_until(lambda: worker.status() == psutil.STATUS_STOPPED)
    replica.kill()
    wait_gone(worker.pid)


def test_too_little_memory_is_said_and_costs_no_worker(start_replicas: StartReplicas, bus: Bus) -> None:
    start_replicas(1, "--memory-mb", "500")
    with pytest.raises(Infeasible, match="echo: needs more than the 500 MB of memory"):
        bus.call(ECHO, EchoRequest(shape=SQUARE, deed=Deed.HUNGER), envelope())
    assert stats(bus).worker_restarts == 0


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("--instance=@x", "id: is '@x'"),
        ("--queue=0", "--queue: is '0'; expected a whole number from 1"),
        ("--memory-mb=9", "--memory-mb: is '9'; expected a whole number from 256"),
    ],
)
def test_an_option_that_cannot_be_is_refused_by_name(
    option: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        serve_stage(*NAMES, [option])
    assert message in capsys.readouterr().err


def test_the_worker_ends_with_its_session_process_even_in_the_middle_of_work(
    start_replicas: StartReplicas, bus: Bus, tmp_path: Path
) -> None:
    [replica] = start_replicas()
    worker, begun = psutil.Process(replica.pid).children()[0].pid, tmp_path / "begun"
    with ThreadPoolExecutor(1) as pool:
        lost = pool.submit(ask, bus, EchoRequest(shape=SQUARE, seconds=60.0, begun=str(begun)), envelope())
        wait_until(begun.exists)
        replica.kill()
        assert isinstance(lost.result(), Unavailable)
    wait_gone(worker)


def test_a_replica_ends_with_its_parent(router: RouterProcess, bus: Bus) -> None:
    parent = run_python(
        "import sys, time; from tests.support import bus_processes\n"
        "replica = bus_processes.launch(sys.argv[1], 'orphan')\n"
        "print(replica.pid, flush=True)\n"
        "time.sleep(60)",
        router.endpoint,
    )
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    wait_until(lambda: bus.instances("echo"))
    parent.kill()
    parent.wait()
    parent.stdout.close()
    wait_gone(pid)
    wait_until(lambda: not bus.instances("echo"))


def test_a_handler_that_cannot_be_imported_ends_the_replica(router: RouterProcess) -> None:
    program = run_python(
        "import sys; from oxbow.stage import serve_stage\n"
        f"serve_stage('{NAMES[0]}', '{NAMES[1]}_of_none', ['--connect', sys.argv[1]])",
        router.endpoint,
    )
    assert program.stdout is not None
    with program.stdout:
        assert program.stdout.read() == b""
    assert program.wait(20.0) == 1


def test_a_replica_waits_for_its_router_and_ends_when_told() -> None:
    replica = launch("tcp/127.0.0.1:9", "early", stderr=subprocess.PIPE)
    assert replica.stderr is not None
    try:
        with replica.stderr:
            assert b"waiting for it" in replica.stderr.readline()
        assert replica.poll() is None
        replica.terminate()
        assert replica.wait(10.0) == 0
    finally:
        end(replica)
