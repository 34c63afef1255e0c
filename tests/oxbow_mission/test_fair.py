"""Whose turn it is."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from oxbow.errors import Busy
from oxbow_mission.fair import FairQueue, Order, Turns


def test_clients_are_served_in_turn() -> None:
    waiting = FairQueue[str](most_items=10, most_bytes=100)
    for item in ("a1", "a2", "a3", "b1", "b2", "c1"):
        waiting.put(item[0], item, 1)
    assert [waiting.get() for _ in range(6)] == ["a1", "b1", "c1", "a2", "b2", "a3"]


def test_a_queue_is_bounded_for_each_client_and_in_bytes() -> None:
    waiting = FairQueue[str](most_items=2, most_bytes=10)
    waiting.put("a", "a1", 3)
    with pytest.raises(Busy, match="3 bytes of this client"):
        waiting.put("a", "a2", 3)
    waiting.put("a", "a2", 2)
    with pytest.raises(Busy, match="2 requests and 5 bytes of this client"):
        waiting.put("a", "a3", 0)
    with pytest.raises(Busy, match="5 bytes in all"):
        waiting.put("b", "b1", 6)
    waiting.put("b", "b1", 4)
    assert waiting.drop("a") == ["a1", "a2"]
    waiting.put("c", "c1", 6)
    assert [waiting.get(), waiting.get()] == ["b1", "c1"]


def test_what_is_larger_than_the_bound_is_taken_alone() -> None:
    waiting = FairQueue[str](most_items=2, most_bytes=10)
    waiting.put("a", "a1", 100)
    assert waiting.get() == "a1"


def test_a_closed_queue_gives_nothing() -> None:
    waiting = FairQueue[str](most_items=2, most_bytes=10)
    with ThreadPoolExecutor(1) as pool:
        got = pool.submit(waiting.get)
        waiting.close()
        assert got.result(5.0) is None


def test_turns_are_taken_one_at_a_time_and_by_whoever_waited_longest_for_one() -> None:
    turns = Turns(lambda _what: 1)
    served: list[str] = []
    first, queued = threading.Event(), threading.Barrier(5)

    def use(client: str) -> None:
        queued.wait()
        with turns.turn("path", client, lambda: False) as granted:
            assert granted
            served.append(client)

    with turns.turn("path", "a", lambda: False), turns.turn("contour", "b", lambda: False):
        threads = [threading.Thread(target=use, args=(client,)) for client in "aaab"]
        for thread in threads:
            thread.start()
        queued.wait()
        while len(turns._waiting["path"]) < 4:
            first.wait(0.01)
    for thread in threads:
        thread.join(5.0)
    assert served == ["b", "a", "a", "a"]


def test_who_had_little_goes_before_who_had_much() -> None:
    order = Order()
    for client, seconds in (("slow", 20.0), ("quick", 0.5), ("slow", 0.0)):
        order.note(client, seconds)
    assert order.next(["slow", "quick"]) == "quick"
    assert order.next(["slow", "quick", "new"]) == "new"


def test_who_waits_no_longer_has_no_turn() -> None:
    turns = Turns(lambda _what: 1)
    with turns.turn("path", "a", lambda: False), turns.turn("path", "b", lambda: True) as granted:
        assert not granted
    with turns.turn("path", "b", lambda: False) as granted:
        assert granted
