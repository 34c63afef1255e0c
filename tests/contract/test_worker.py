"""A worker process and its handle, whatever the handler raises and whatever the process says."""

from __future__ import annotations

import os
import signal
import threading
import time
import uuid
from collections.abc import Callable, Iterator

import msgspec
import pytest

from oxbow.bus import Envelope, Session
from oxbow.bus.client import Bus
from oxbow.bus.router import RouterProcess
from oxbow.errors import DeadlineExceeded, ErrorCode, Infeasible, Internal, OxbowError
from oxbow.stage.service import Stage
from oxbow.stage.watch import is_stopped
from oxbow.stage.wire import Done, Failed, Job, Shown
from oxbow.stage.worker import Worker, WorkerLost
from oxbow.wire import codec
from tests.support.bus_processes import wait_gone, wait_until
from tests.support.echo_stage import ECHO, NAMES, SQUARE, Deed, Echo, EchoRequest
from tests.support.project import ROOT

pytestmark = pytest.mark.processes

MEMORY_MB = 600


@pytest.fixture(scope="module")
def started() -> Iterator[Worker]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(ROOT))
        worker = Worker(*NAMES, "w", MEMORY_MB)
        worker.describe()
        yield worker
        worker.close()


@pytest.fixture
def worker(started: Worker) -> Worker:
    """A worker that is ready, whatever a test before has made of it."""
    if not started.alive():
        started.restart()
    return started


def job(deed: Deed = Deed.ECHO, *, text: str = "", seconds: float = 20.0, show: bool = False) -> Job:
    envelope = Envelope(request_id=uuid.uuid4().hex, deadline_s=time.time() + seconds, mission_id="m")
    request = EchoRequest(text=text, shape=SQUARE, deed=deed)
    return Job(envelope=envelope, payload=codec.encode(request), show=show)


def ignore(_shown: Shown) -> None:
    pass


def require_own_answer(worker: Worker) -> None:
    """The next job, asked of the same process or of the one in its place, gets its own answer."""
    if not worker.alive():
        worker.restart()
    text = uuid.uuid4().hex
    try:
        answer = worker.run(job(text=text), ignore)
    except WorkerLost:
        worker.restart()
        answer = worker.run(job(text=text), ignore)
    assert isinstance(answer, Done)
    assert codec.decode(answer.payload, Echo).text == text


@pytest.mark.parametrize(
    ("deed", "code", "message"),
    [
        (Deed.REFUSE, ErrorCode.INVALID_MISSION, "is wrong"),
        (Deed.GIVE_UP, ErrorCode.INFEASIBLE, "no water is left"),
        (Deed.BREAK, ErrorCode.INTERNAL, "ZeroDivisionError: a fault of the handler"),
        (Deed.LIE, ErrorCode.INTERNAL, "replied a str, not a Echo"),
        (Deed.EXIT, ErrorCode.INTERNAL, "SystemExit: 0"),
        (Deed.INTERRUPT, ErrorCode.INTERNAL, "KeyboardInterrupt"),
        (Deed.PANIC, ErrorCode.INTERNAL, "Panic: a fault of a library"),
        (Deed.UNPRINTABLE, ErrorCode.INTERNAL, "Unprintable: <exception str() failed>"),
        (Deed.SURROGATE, ErrorCode.INVALID_MISSION, "is '?'"),
        (Deed.RECURSE, ErrorCode.INTERNAL, "RecursionError: maximum recursion depth"),
        (Deed.BE_BUSY, ErrorCode.INTERNAL, "Busy: "),
        (Deed.BE_UNAVAILABLE, ErrorCode.INTERNAL, "Unavailable: "),
        (Deed.BE_LATE, ErrorCode.INTERNAL, "DeadlineExceeded: "),
        (Deed.HUNGER, ErrorCode.INFEASIBLE, "needs more than the 600 MB of memory"),
    ],
)
def test_whatever_a_handler_raises_is_an_answer_and_costs_no_process(
    worker: Worker, deed: Deed, code: ErrorCode, message: str
) -> None:
    pid, asked = worker.pid, job(deed)
    answer = worker.run(asked, ignore)
    assert isinstance(answer, Failed)
    assert (answer.request_id, answer.error.code) == (asked.envelope.request_id, code)
    assert message in answer.error.message
    require_own_answer(worker)
    assert worker.pid == pid


@pytest.mark.parametrize(
    ("deed", "kind", "message"),
    [
        (Deed.ANSWER_FOR_ANOTHER, WorkerLost, "sent an unexpected Done to request 'another'"),
        (Deed.FAIL_FOR_ANOTHER, WorkerLost, "sent an unexpected Failed to request 'another'"),
        (Deed.DESCRIBE, WorkerLost, "sent an unexpected Described"),
        (Deed.BABBLE, WorkerLost, "sent garbage"),
        (Deed.OVERFLOW, WorkerLost, "closed its pipe, or sent garbage"),
        (Deed.DIE, WorkerLost, "ended by SIGKILL"),
        (Deed.FREEZE, WorkerLost, "was frozen for 2 s"),
        (Deed.STARVE, Infeasible, "needs more than the 600 MB of memory"),
    ],
)
def test_a_process_that_does_not_answer_its_job_is_replaced(
    worker: Worker, deed: Deed, kind: type[OxbowError], message: str
) -> None:
    pid = worker.pid
    with pytest.raises(kind, match=message):
        worker.run(job(deed), ignore)
    wait_gone(pid)
    require_own_answer(worker)


@pytest.mark.parametrize("deed", [Deed.ANSWER_TWICE, Deed.ANSWER_LATER])
def test_a_second_answer_never_is_the_answer_to_the_next_job(worker: Worker, deed: Deed) -> None:
    first = job(deed)
    assert worker.run(first, ignore).request_id == first.envelope.request_id
    time.sleep(0.3)
    require_own_answer(worker)
    require_own_answer(worker)


@pytest.mark.parametrize(
    "raised", [OSError("no handles"), KeyboardInterrupt(), SystemExit(1), BaseException("panic")]
)
def test_an_exception_on_the_way_leaves_no_answer_behind(worker: Worker, raised: BaseException) -> None:
    def fail(_shown: Shown) -> None:
        raise raised

    with pytest.raises((type(raised), WorkerLost)):
        worker.run(job(Deed.SHOW, show=True), fail)
    assert not worker.alive()
    require_own_answer(worker)


def test_a_late_job_is_stopped(worker: Worker) -> None:
    request = EchoRequest(shape=SQUARE, seconds=60.0)
    late = Job(envelope=job(seconds=0.3).envelope, payload=codec.encode(request), show=False)
    with pytest.raises(DeadlineExceeded):
        worker.run(late, ignore)
    require_own_answer(worker)


def test_a_stopped_process_takes_no_job_and_holds_none_that_is_larger_than_the_pipe(worker: Worker) -> None:
    os.kill(worker.pid, signal.SIGSTOP)
    wait_until(lambda: is_stopped(worker.pid))
    assert not worker.alive()
    with pytest.raises(WorkerLost, match="was frozen"):
        worker.run(job(text="x" * 2**22), ignore)
    require_own_answer(worker)


def test_a_process_that_is_stopped_for_a_moment_goes_on(worker: Worker) -> None:
    os.kill(worker.pid, signal.SIGSTOP)
    wait_until(lambda: is_stopped(worker.pid))
    threading.Timer(0.2, os.kill, (worker.pid, signal.SIGCONT)).start()
    assert isinstance(worker.run(job(), ignore), Done)


class Faulty(Worker):
    """Raises what is pending before it runs a job."""

    pending: tuple[BaseException, ...] = ()

    def run(self, job: Job, on_shown: Callable[[Shown], None]) -> Done | Failed:
        if self.pending:
            raised, self.pending = self.pending[0], self.pending[1:]
            raise raised
        return super().run(job, on_shown)


def test_whatever_is_raised_around_a_worker_is_an_answer(
    router: RouterProcess, bus: Bus, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    faulty = Faulty(*NAMES, "faulty", MEMORY_MB)
    faulty.pending = (OSError("no handles"), SystemExit(1), KeyboardInterrupt(), BaseException("panic"))
    with Session.connect(router.endpoint) as session:
        stage = Stage(session, faulty, "faulty", 4, on_failure=lambda: None)
        same = job(text="at last")
        for raised in faulty.pending:
            with pytest.raises(Internal, match=type(raised).__name__):
                ask(bus, same)
        assert codec.decode(ask(bus, same), Echo).text == "at last"
        stage.drain()
    faulty.close()


def ask(bus: Bus, asked: Job) -> bytes:
    attachment = msgspec.json.encode(asked.envelope)
    [(_, reply)] = bus.query(ECHO.instance_key("faulty"), asked.payload, timeout_s=20.0, attachment=attachment)
    return reply
