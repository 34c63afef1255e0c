from __future__ import annotations

import pytest

from oxbow.errors import ErrorCode, ErrorReply, InvalidRequest
from oxbow.stage.answered import Answered, digest
from oxbow.stage.wire import Done, Failed

REQUEST = b"a request"


def done(size: int, request_id: str = "request") -> Done:
    return Done(request_id=request_id, payload=bytes(size))


def test_the_oldest_answers_make_room_for_new_ones() -> None:
    answered = Answered(most_bytes=10_000)
    for i in range(10):
        answered.put(f"request-{i}", digest(REQUEST), done(2_000))
    kept = [i for i in range(10) if answered.get(f"request-{i}", REQUEST) is not None]
    assert kept == [7, 8, 9]


def test_an_answer_larger_than_all_room_is_not_kept() -> None:
    answered = Answered(most_bytes=10_000)
    error = ErrorReply(code=ErrorCode.INFEASIBLE, message="no water")
    answered.put("small", digest(REQUEST), Failed(request_id="small", error=error))
    answered.put("large", digest(REQUEST), done(20_000))
    assert answered.get("large", REQUEST) is None
    answered.put("next", digest(REQUEST), done(1))
    assert answered.get("next", REQUEST) == done(1)


def test_an_answer_that_is_kept_again_takes_its_room_once() -> None:
    answered = Answered(most_bytes=10_000)
    for _ in range(10):
        answered.put("same", digest(REQUEST), done(2_000))
    answered.put("other", digest(REQUEST), done(2_000))
    assert answered.get("same", REQUEST) == done(2_000)


def test_another_request_under_the_same_id_never_gets_its_answer() -> None:
    answered = Answered(most_bytes=10_000)
    answered.put("same", digest(REQUEST), done(1))
    with pytest.raises(InvalidRequest, match="request_id: is 'same', the id of another request"):
        answered.get("same", b"another request")
