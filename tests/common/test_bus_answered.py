from __future__ import annotations

from oxbow.errors import ErrorCode, ErrorReply
from oxbow.stage.answered import Answered
from oxbow.stage.wire import Done, Failed


def test_the_oldest_answers_make_room_for_new_ones() -> None:
    answered = Answered(most_bytes=10_000)
    for i in range(10):
        answered.put(f"request-{i}", Done(payload=bytes(2_000)))
    kept = [i for i in range(10) if answered.get(f"request-{i}") is not None]
    assert kept == [7, 8, 9]


def test_an_answer_larger_than_all_room_is_not_kept() -> None:
    answered = Answered(most_bytes=10_000)
    answered.put("small", Failed(error=ErrorReply(code=ErrorCode.INFEASIBLE, message="no water")))
    answered.put("large", Done(payload=bytes(20_000)))
    assert answered.get("large") is None
    answered.put("next", Done(payload=b"x"))
    assert answered.get("next") == Done(payload=b"x")
