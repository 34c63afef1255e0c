"""Queries that wait for a plan, on a real bus: they are answered, or let go."""

from __future__ import annotations

import queue
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from oxbow.bus.client import Bus
from oxbow.bus.query import Query
from oxbow.errors import Busy, DeadlineExceeded, Unavailable
from oxbow_mission import waiters as bounds
from oxbow_mission.revision import Revision
from oxbow_mission.waiters import Waiter, Waiters

pytestmark = pytest.mark.processes

KEY = "oxbow/v1/test/waiting"
WAIT_S = 20.0
LAKE = Revision("lake", 1)


class Askers:
    """Who ask at the bus, and their queries as they come in."""

    def __init__(self, bus: Bus, pool: ThreadPoolExecutor) -> None:
        self.bus = bus
        self.pool = pool
        self.queries: queue.SimpleQueue[Query] = queue.SimpleQueue()
        self.queryable = bus.declare_queryable(KEY, self.queries.put)

    def ask(self) -> tuple[Query, Future[list[tuple[str, bytes]]]]:
        answer = self.pool.submit(self.bus.query, KEY, timeout_s=WAIT_S)
        return self.queries.get(timeout=WAIT_S), answer


@pytest.fixture
def askers(bus: Bus) -> Iterator[Askers]:
    with ThreadPoolExecutor(4) as pool:
        asking = Askers(bus, pool)
        yield asking
        asking.queryable.undeclare()


def waiting(query: Query, client: str, seconds: float = WAIT_S, size: int = 1) -> Waiter:
    return Waiter(query, client, time.monotonic() + seconds, size)


def test_who_left_and_whose_time_is_up_is_let_go_and_nobody_else(askers: Askers) -> None:
    waiters = Waiters()
    (left, left_answer), (late, late_answer), (stays, stays_answer) = (askers.ask() for _ in range(3))
    waiters.add(LAKE, waiting(left, "left"))
    waiters.add(LAKE, waiting(late, "late", seconds=-1.0))
    waiters.add(LAKE, waiting(stays, "stays"))
    assert waiters.let_go({"left"}) == 2
    with pytest.raises(Unavailable):
        left_answer.result(WAIT_S)
    with pytest.raises(DeadlineExceeded, match="the mission is kept, ask again"):
        late_answer.result(WAIT_S)
    [waiter] = waiters.take(LAKE)
    assert waiters.take(LAKE) == []
    with waiter.query:
        waiter.query.reply(KEY, b"a plan")
    assert stays_answer.result(WAIT_S) == [(KEY, b"a plan")]


def test_one_client_has_its_own_places(askers: Askers, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "MOST_PER_CLIENT", 2)
    monkeypatch.setattr(bounds, "MOST_BYTES_PER_CLIENT", 10)
    waiters = Waiters()
    query, answer = askers.ask()
    waiters.add(LAKE, waiting(query, "a", size=100))  # one alone may be as large as it is
    with pytest.raises(Busy, match="100 bytes of this client"):
        waiters.add(LAKE, waiting(query, "a", size=1))
    waiters.add(LAKE, waiting(query, "b", size=1))
    waiters.add(LAKE, waiting(query, "b", size=1))
    with pytest.raises(Busy, match="2 queries of this client"):
        waiters.add(LAKE, waiting(query, "b", size=1))
    waiters.take(LAKE)
    waiters.add(LAKE, waiting(query, "b", size=1))
    waiters.let_go({"b"})
    with pytest.raises(Unavailable):
        answer.result(WAIT_S)
