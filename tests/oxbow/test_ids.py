from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from oxbow.contracts import layer_key, live_key, mission_key
from oxbow.errors import InvalidRequest
from oxbow.ids import MOST_ID_CHARACTERS, checked_id


@pytest.mark.parametrize("text", ["lake", "a", "_", "-", "0f5c.1c2e-9", "x" * MOST_ID_CHARACTERS])
def test_an_id_is_taken_as_it_is(text: str) -> None:
    assert checked_id(text) == text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is ''; expected 1 to 128 of A-Z"),
        ("a/b", "is 'a/b'; expected"),
        ("lake\n", r"is 'lake\\n'; expected"),
        ("étang", "is 'étang'; expected"),
        ("@ping", "is '@ping'; .*none that begins with '@'"),
        ("..", r"is '\.\.'; .*none that begins with '\.'"),
        ("x" * 129, r"is 'x{40}'\.\.\. \(129 characters\); expected 1 to 128"),
        ("@" * 65_530, r"is '@{40}'\.\.\. \(65530 characters\); .*none that begins with '@'"),
    ],
)
def test_what_is_no_id_is_refused_by_name(text: str, message: str) -> None:
    with pytest.raises(InvalidRequest, match=f"mission: {message}") as caught:
        checked_id(text, where="mission")
    assert len(str(caught.value)) < 250


@given(st.text(max_size=200))
def test_every_key_has_the_chunks_it_should_have(text: str) -> None:
    try:
        keys = [mission_key(text, "plan"), live_key("path", text), layer_key(text, "path", text)]
    except InvalidRequest:
        return
    assert [key.count("/") for key in keys] == [4, 4, 5]
    assert all(len(key) < 400 and not {"*", "?", "#", "@"} & set(key) for key in keys)
