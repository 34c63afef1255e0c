"""Sessions and their router: publish, subscribe, answer, query; the router away; leaving."""

from __future__ import annotations

import os
import signal
import threading
import time
import uuid
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from oxbow.bus.client import Bus, BusCall
from oxbow.bus.router import RouterProcess, free_endpoint, start_router
from oxbow.contracts import ANY_LAYER, live_key
from oxbow.errors import Busy, DeadlineExceeded, Infeasible, Internal, InvalidOption, Unavailable
from tests.support.bus_processes import end, launch, run_python, wait_gone, wait_until
from tests.support.echo_stage import ECHO, SQUARE, Deed, EchoRequest

pytestmark = pytest.mark.processes


@pytest.fixture
def other(router: RouterProcess) -> Iterator[Bus]:
    with Bus.connect(router.endpoint) as session:
        yield session


def ready(session: Bus, caller: Bus) -> None:
    """Wait until `caller` sees a token of `session`, and so what `session` declared before it."""
    name = uuid.uuid4().hex
    session.declare_live(live_key("test", name))
    wait_until(lambda: name in caller.instances("test"))


def test_samples_arrive_whole_and_in_order(bus: Bus, other: Bus) -> None:
    arrived: list[tuple[str, bytes]] = []
    subscription = other.subscribe("test/order/*", lambda key, payload: arrived.append((key, payload)))
    ready(other, bus)
    sent = [(f"test/order/{i % 3}", bytes([i % 256]) * i) for i in range(300)]
    for key, payload in sent:
        bus.publish(key, payload)
    wait_until(lambda: len(arrived) == len(sent))
    subscription.close()
    assert arrived == sent


def test_a_slow_subscriber_leaves_its_session_responsive(bus: Bus, other: Bus) -> None:
    released = threading.Event()
    subscription = other.subscribe("test/slow", lambda _key, _payload: released.wait(20.0), queue_size=4)
    other.answer("test/quick", lambda key, _parameters, _payload: [(key, b"still here")])
    ready(other, bus)
    for _ in range(600):
        bus.publish("test/slow", b"x")
    assert bus.query("test/quick", timeout_s=5.0) == [("test/quick", b"still here")]
    released.set()
    subscription.close()


def test_a_faulty_subscriber_loses_one_sample_only(bus: Bus, other: Bus) -> None:
    arrived: list[bytes] = []

    def receive(_key: str, payload: bytes) -> None:
        if payload == b"bad":
            raise ValueError("this one")
        arrived.append(payload)

    other.subscribe("test/faulty", receive)
    ready(other, bus)
    for payload in (b"first", b"bad", b"last"):
        bus.publish("test/faulty", payload, urgent=True)
    wait_until(lambda: b"last" in arrived)
    assert arrived == [b"first", b"last"]


def test_an_answer_sees_parameters_and_payload(bus: Bus, other: Bus) -> None:
    def echo(key: str, parameters: dict[str, str], payload: bytes) -> list[tuple[str, bytes]]:
        return [(key, f"{parameters} {payload!r}".encode())]

    other.answer("test/echo", echo, parameters=("method", "name", "flag"))
    ready(other, bus)
    [(_, reply)] = bus.query("test/echo?method=Transect;name=a%20lake;flag", b"body", timeout_s=5.0)
    assert reply.decode() == "{'method': 'Transect', 'name': 'a lake', 'flag': ''} b'body'"


def test_one_query_may_have_many_replies_from_many(bus: Bus, other: Bus) -> None:
    bus.answer("test/all/a", lambda key, _parameters, _payload: [(key, b"1"), (key, b"2")])
    other.answer("test/all/b", lambda key, _parameters, _payload: [("test/all/b", key.encode())])
    ready(other, bus)
    replies = bus.query("test/all/*", timeout_s=5.0, all_targets=True)
    assert sorted(payload for _, payload in replies) == [b"1", b"2", b"test/all/*"]


@pytest.mark.parametrize(
    ("raised", "kind", "message"),
    [
        (Infeasible("no water", where="Safety"), Infeasible, "Safety: no water"),
        (KeyError("a fault"), Internal, "KeyError: 'a fault'"),
    ],
)
def test_errors_travel_and_the_fault_is_coded(
    bus: Bus, other: Bus, raised: Exception, kind: type[Exception], message: str
) -> None:
    def refuse(_key: str, _parameters: dict[str, str], _payload: bytes) -> list[tuple[str, bytes]]:
        raise raised

    subscription = other.answer("test/refuse", refuse)
    ready(other, bus)
    with pytest.raises(kind, match=message):
        bus.query("test/refuse", timeout_s=5.0)
    subscription.close()


def test_queries_beyond_the_queue_are_answered_busy(bus: Bus, other: Bus) -> None:
    released, started = threading.Event(), threading.Event()

    def wait(key: str, _parameters: dict[str, str], _payload: bytes) -> list[tuple[str, bytes]]:
        started.set()
        released.wait(20.0)
        return [(key, b"done")]

    other.answer("test/wait", wait, queue_size=1)
    ready(other, bus)
    with ThreadPoolExecutor(4) as pool:
        first = pool.submit(bus.query, "test/wait", timeout_s=20.0)
        started.wait(20.0)
        others = [pool.submit(bus.query, "test/wait", timeout_s=20.0) for _ in range(3)]
        wait_until(lambda: sum(other.done() for other in others) == 2)
        released.set()
        failures = [query.exception() for query in others]
        assert first.result() == [("test/wait", b"done")]
    assert failures.count(None) == 1
    busy = [failure for failure in failures if failure is not None]
    assert all(isinstance(failure, Busy) and "1 queries are waiting" in failure.message for failure in busy)


def test_a_query_nobody_answers(bus: Bus, other: Bus) -> None:
    with pytest.raises(Unavailable, match="test/nobody: nobody answers"):
        bus.query("test/nobody", timeout_s=5.0)
    assert bus.query("test/nobody", timeout_s=5.0, may_be_empty=True) == []
    released = threading.Event()
    other.answer("test/silent", lambda _key, _parameters, _payload: [(str(released.wait(20.0)), b"")])
    ready(other, bus)
    with pytest.raises(DeadlineExceeded, match=r"test/silent: no answer within 0\.2 s"):
        bus.query("test/silent", timeout_s=0.2)
    released.set()


def test_closing_delivers_what_was_received_then_refuses(router: RouterProcess, bus: Bus) -> None:
    arrived: list[bytes] = []
    session = Bus.connect(router.endpoint)
    subscription = session.subscribe("test/close", lambda _key, payload: arrived.append(payload))
    session.declare_live(live_key("closing", "one"))
    wait_until(lambda: bus.instances("closing") == ("one",))
    bus.publish("test/close", b"x")
    wait_until(lambda: arrived)
    subscription.close()
    session.close()
    session.close()
    wait_until(lambda: bus.instances("closing") == ())
    with pytest.raises(Unavailable, match="closed"):
        session.publish("test/close", b"y")
    with pytest.raises(Unavailable, match="closed"):
        session.query("test/close", timeout_s=1.0)


def test_connecting_to_nothing_names_the_endpoint() -> None:
    with pytest.raises(Unavailable, match=r"tcp/127\.0\.0\.1:9: no router answers there within 0\.3 s"):
        Bus.connect("tcp/127.0.0.1:9", timeout_s=0.3)


def test_an_endpoint_without_a_protocol_is_refused() -> None:
    with pytest.raises(
        InvalidOption, match=r"endpoint: is 'localhost:7447'; expected PROTOCOL/ADDRESS, such as tcp/"
    ):
        Bus.connect("localhost:7447")


def test_ctrl_c_ends_a_program_that_waits_for_the_router() -> None:
    program = run_python(
        "from oxbow.bus.client import Bus; print('on', flush=True); Bus.connect('tcp/127.0.0.1:9', timeout_s=60)"
    )
    assert program.stdout is not None
    with program.stdout:
        assert program.stdout.readline().strip() == b"on"
        time.sleep(0.2)
        program.send_signal(signal.SIGINT)
        assert program.wait(10.0) != 0


def test_a_program_that_never_closes_its_bus_still_ends(router: RouterProcess, bus: Bus) -> None:
    program = run_python(
        "import sys, time; from oxbow.bus.client import Bus\n"
        "bus = Bus.connect(sys.argv[1])\n"
        "bus.subscribe('test/**', lambda key, payload: None); bus.answer('test/x', lambda *query: [])\n"
        "bus.declare_live('oxbow/v1/live/forgetful/one'); time.sleep(0.5)",
        router.endpoint,
    )
    assert program.stdout is not None
    program.stdout.close()
    while program.poll() is None:
        bus.publish("test/flood", b"x")
    assert program.returncode == 0


def test_services_and_callers_survive_restarts_of_the_router() -> None:
    router = start_router(timeout_s=20.0)
    replica = launch(router.endpoint, "r0")
    try:
        with Bus.connect(router.endpoint) as bus, ThreadPoolExecutor(6) as pool:
            call = BusCall(bus, mission_id="m1", deadline_s=time.time() + 40.0)
            layers: list[str] = []
            bus.subscribe(ANY_LAYER, lambda key, _payload: layers.append(key))
            requests = [EchoRequest(text=str(i), shape=SQUARE, seconds=0.01) for i in range(120)]
            replies = [pool.submit(call, ECHO, request) for request in requests]
            for share in (20, 60):
                wait_until(lambda share=share: sum(reply.done() for reply in replies) >= share)
                router.process.kill()
                router.process.wait()
                router = start_router(router.endpoint, timeout_s=20.0)
            assert [reply.result().text for reply in replies] == [str(i) for i in range(120)]
            call(ECHO, EchoRequest(shape=SQUARE, deed=Deed.SHOW))
            wait_until(lambda: len(layers) == 3)
    finally:
        end(replica)
        end(router.process)


def test_the_router_ends_on_sigterm_and_with_its_parent() -> None:
    router = start_router(timeout_s=20.0)
    router.process.terminate()
    assert router.process.wait(10.0) == 0
    parent = run_python(
        "import time; from oxbow.bus.router import start_router\n"
        "print(start_router(timeout_s=20.0).process.pid, flush=True)\n"
        "time.sleep(60)"
    )
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    os.kill(pid, 0)
    parent.kill()
    parent.wait()
    parent.stdout.close()
    wait_gone(pid)


def test_a_taken_port_is_reported(router: RouterProcess) -> None:
    with pytest.raises(Unavailable, match="the router did not come up"):
        start_router(router.endpoint, timeout_s=20.0)


def test_a_free_endpoint_keeps_the_host() -> None:
    assert free_endpoint("tcp/127.0.0.1:0").startswith("tcp/127.0.0.1:")
    assert not free_endpoint().endswith(":0")
