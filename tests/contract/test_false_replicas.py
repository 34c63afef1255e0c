"""What a caller makes of replicas that answer for another, wrongly, unreadably or not at all."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import msgspec
import pytest

from oxbow.bus import Envelope
from oxbow.bus.client import Bus, BusCall
from oxbow.bus.query import MSGPACK, Query
from oxbow.bus.router import RouterProcess
from oxbow.contracts import Endpoint
from oxbow.errors import ErrorCode, ErrorReply, Infeasible, Internal, InvalidOption, InvalidRequest
from oxbow.wire import codec
from oxbow.wire.envelope import StageError
from tests.support.bus_processes import end, launch, wait_until
from tests.support.echo_stage import ECHO, SQUARE, Echo, EchoRequest

pytestmark = pytest.mark.processes

ALONE: Endpoint[EchoRequest, Echo] = Endpoint("alone", EchoRequest, Echo)
FALSE = codec.encode(Echo(text="false", shape=SQUARE, pid=0))


def own(query: Query) -> bytes:
    return Envelope.decode(query.attachment).request_id.encode()


def reply(query: Query, payload: bytes, about: bytes | None) -> None:
    query.reply(query.key, payload, encoding=MSGPACK, attachment=about)


def fail(query: Query, request_id: str) -> None:
    error = ErrorReply(code=ErrorCode.INFEASIBLE, message="false")
    query.fail(StageError.about(request_id, error))


class Panic(BaseException):
    pass


def panic(_query: Query) -> None:
    raise Panic("on zenoh's thread")


FAULTS: dict[str, Callable[[Query], None]] = {
    "for another": lambda query: reply(query, FALSE, uuid.uuid4().hex.encode()),
    "for nobody": lambda query: reply(query, FALSE, None),
    "for no Unicode": lambda query: reply(query, FALSE, b"\xff\xfe"),
    "garbage": lambda query: reply(query, b"\xc1garbage", own(query)),
    "another message": lambda query: reply(query, codec.encode(EchoRequest(shape=SQUARE)), own(query)),
    "an error for another": lambda query: fail(query, "another"),
    "an error for nobody": lambda query: fail(query, ""),
    "an error that cannot be read": lambda query: query._query.reply_err(b"\xff{", encoding="application/json"),
    "an error of no known code": lambda query: query._query.reply_err(
        msgspec.json.encode({"code": "odd", "message": ""}), encoding="application/json"
    ),
    "an exception": panic,
    "silence": lambda _query: None,
}


@contextmanager
def false_replicas(session: Bus, bus: Bus, accept: Callable[[Query], None]) -> Iterator[None]:
    """Replicas called "false" of the stage that has a true one too, and of one that has none."""
    for endpoint in (ECHO, ALONE):
        session.declare_queryable(endpoint.instance_key("false"), accept)
        session.declare_live(endpoint.live_key("false"))
    wait_until(lambda: "false" in bus.instances("echo") and bus.instances("alone"))
    yield
    session.close()
    wait_until(lambda: "false" not in bus.instances("echo") and not bus.instances("alone"))


@pytest.fixture
def false_replica(router: RouterProcess, bus: Bus, request: pytest.FixtureRequest) -> Iterator[list[Query]]:
    """A replica with a fault; what it was asked."""
    asked: list[Query] = []
    fault = FAULTS[request.param]

    def accept(query: Query) -> None:
        asked.append(query)
        fault(query)
        with query:
            pass

    with Bus.connect(router.endpoint) as session, false_replicas(session, bus, accept):
        yield asked


@pytest.fixture(scope="module")
def true_replica(router: RouterProcess, bus: Bus) -> Iterator[None]:
    process = launch(router.endpoint, "true")
    wait_until(lambda: "true" in bus.instances("echo"))
    yield
    end(process)
    wait_until(lambda: "true" not in bus.instances("echo"))


@pytest.mark.parametrize("false_replica", FAULTS, indirect=True)
@pytest.mark.usefixtures("true_replica")
def test_beside_a_false_replica_every_answer_comes_from_the_true_one(
    call: BusCall, false_replica: list[Query]
) -> None:
    texts = [str(i) for i in range(4)]
    assert [call(ECHO, EchoRequest(text=text, shape=SQUARE)).text for text in texts] == texts
    assert false_replica


@pytest.mark.parametrize("false_replica", [name for name in FAULTS if name != "silence"], indirect=True)
def test_a_false_replica_alone_is_named(bus: Bus, false_replica: list[Query]) -> None:
    envelope = Envelope(request_id=uuid.uuid4().hex, deadline_s=time.time() + 20.0)
    with pytest.raises(Internal, match=r"alone/false (replied|sent) .*\(tried false: wrong answer\)"):
        bus.call(ALONE, EchoRequest(shape=SQUARE), envelope)
    assert len(false_replica) == 3


def test_a_false_replica_is_not_asked_again_while_a_true_one_is_busy(
    router: RouterProcess, bus: Bus, call: BusCall
) -> None:
    asked: list[str] = []

    def accept(query: Query) -> None:
        asked.append(query.key)
        with query:
            if query.key == ALONE.instance_key("false"):
                reply(query, FALSE, b"another")
            elif len(asked) < 6:
                busy = ErrorReply(code=ErrorCode.BUSY, message="later")
                query.fail(StageError.about(own(query).decode(), busy))
            else:
                reply(query, codec.encode(Echo(text="true", shape=SQUARE, pid=0)), own(query))

    with Bus.connect(router.endpoint) as session, false_replicas(session, bus, accept):
        session.declare_queryable(ALONE.instance_key("busy"), accept)
        session.declare_live(ALONE.live_key("busy"))
        wait_until(lambda: len(bus.instances("alone")) == 2)
        assert call(ALONE, EchoRequest(shape=SQUARE)).text == "true"
    assert asked.count(ALONE.instance_key("false")) == 1


def test_an_error_of_its_own_reaches_the_caller(router: RouterProcess, bus: Bus, call: BusCall) -> None:
    def accept(query: Query) -> None:
        with query:
            fail(query, own(query).decode())

    with (
        Bus.connect(router.endpoint) as session,
        false_replicas(session, bus, accept),
        pytest.raises(Infeasible, match="false"),
    ):
        call(ALONE, EchoRequest(shape=SQUARE))


@pytest.mark.parametrize("raised", [SystemExit(1), KeyboardInterrupt(), Panic("a fault"), ValueError("a fault")])
def test_an_answerer_that_raises_anything_answers_and_goes_on(
    router: RouterProcess, bus: Bus, raised: BaseException
) -> None:
    pending = [raised]

    def answer(key: str, _parameters: dict[str, str], _payload: bytes) -> Iterator[tuple[str, bytes]]:
        if pending:
            raise pending.pop()
        yield key, b"fine"

    with Bus.connect(router.endpoint) as session:
        session.answer("test/raises", answer)
        session.declare_live("oxbow/v1/live/test/raises")
        wait_until(lambda: "raises" in bus.instances("test"))
        with pytest.raises(Internal, match=f"test/raises: .*{type(raised).__name__}"):
            bus.query("test/raises", timeout_s=5.0)
        assert bus.query("test/raises", timeout_s=5.0) == [("test/raises", b"fine")]


@pytest.mark.parametrize("timeout_s", [float("nan"), float("inf"), 1e308, 3e6, -1.0])
def test_a_wait_that_is_none_is_refused(bus: Bus, timeout_s: float) -> None:
    with pytest.raises(InvalidOption, match=r"timeout_s: is .*; expected 0 to 604800 s"):
        bus.query("test/none", timeout_s=timeout_s)


@pytest.mark.parametrize("key", ["test/" + "x" * 65_500, "test/\ud800"])
def test_a_key_that_zenoh_would_panic_at_is_refused(bus: Bus, key: str) -> None:
    for use in (
        lambda: bus.publish(key, b""),
        lambda: bus.query(key, timeout_s=1.0),
        lambda: bus.declare_live(key),
        lambda: bus.audience(key),
        lambda: bus.subscribe(key, lambda _key, _payload: None),
        lambda: bus.answer(key, lambda _key, _parameters, _payload: []),
    ):
        with pytest.raises(InvalidRequest, match=r"key: is 'test/.*expected at most 4096 bytes of Unicode"):
            use()
    assert bus.query("test/none", timeout_s=1.0, may_be_empty=True) == []
