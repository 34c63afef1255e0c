from __future__ import annotations

import threading
import time
from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from oxbow.bus.replicas import Replicas


def replicas(*alive: str, most_outstanding: int = 2) -> Replicas:
    known = Replicas(most_outstanding)
    for instance in alive:
        known.update("path", instance, alive=True)
    return known


def test_the_replica_with_the_fewest_requests_is_next() -> None:
    known = replicas("a", "b", "c")
    first = [known.acquire("path", (), 0.0) for _ in range(3)]
    assert sorted(map(str, first)) == ["a", "b", "c"]
    known.release("path", "b")
    assert known.acquire("path", (), 0.0) == "b"


def test_equals_take_turns() -> None:
    known = replicas("a", "b", "c")
    chosen = []
    for _ in range(6):
        instance = known.acquire("path", (), 0.0)
        assert instance is not None
        known.release("path", instance)
        chosen.append(instance)
    assert chosen == ["a", "b", "c"] * 2


def test_a_replica_to_avoid_is_chosen_only_where_no_other_lives() -> None:
    known = replicas("a", "b")
    assert [known.acquire("path", {"a"}, 0.0) for _ in range(3)] == ["b", "b", None]
    known.update("path", "b", alive=False)
    assert known.acquire("path", {"a"}, 0.0) == "a"


def test_a_stage_is_missing_since_its_last_replica_went_or_since_the_start() -> None:
    started = time.monotonic()
    known = replicas("a")
    assert known.missing_s("path") == 0.0
    assert 0.0 <= known.missing_s("contour") <= time.monotonic() - started
    gone = time.monotonic()
    known.update("path", "a", alive=False)
    assert known.missing_s("path") <= time.monotonic() - gone
    assert known.missing_s("contour") > known.missing_s("path")


def test_a_caller_waits_for_a_replica_to_come_or_to_be_free() -> None:
    known = replicas(most_outstanding=1)
    threading.Timer(0.05, known.update, ("path", "a", True)).start()
    assert known.acquire("path", (), 20.0) == "a"
    threading.Timer(0.05, known.release, ("path", "a")).start()
    assert known.acquire("path", (), 20.0) == "a"


def test_stages_are_apart_and_missing_ones_are_named() -> None:
    known = replicas("a")
    assert known.wait_alive(("path", "contour"), 0.0) == ("contour",)
    assert known.acquire("contour", (), 0.0) is None
    assert known.missing_s("path") == 0.0
    assert known.missing_s("contour") > 0.0
    known.update("path", "a", alive=False)
    assert known.alive("path") == ()
    assert known.missing_s("path") > 0.0


@given(
    st.lists(st.tuples(st.sampled_from(["come", "go", "acquire", "release"]), st.sampled_from("abc")), max_size=60)
)
def test_no_replica_is_overloaded_and_none_idles_while_another_has_more(events: list[tuple[str, str]]) -> None:
    known, alive, held = replicas(), set[str](), Counter[str]()
    for event, instance in events:
        if event in ("come", "go"):
            known.update("path", instance, alive=event == "come")
            (alive.add if event == "come" else alive.discard)(instance)
        elif event == "acquire":
            chosen = known.acquire("path", (), 0.0)
            free = [name for name in alive if held[name] < 2]
            assert (chosen is None) == (not free)
            if chosen is not None:
                assert held[chosen] == min(held[name] for name in free)
                held[chosen] += 1
        elif held[instance]:
            known.release("path", instance)
            held[instance] -= 1
