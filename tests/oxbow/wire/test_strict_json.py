"""JSON from outside is what is expected, or an error that names what is wrong."""

from __future__ import annotations

import json
import random

import msgspec
import pytest

from oxbow.errors import InvalidRequest
from oxbow.wire.strict_json import decode_json


class Part(msgspec.Struct):
    number: float
    parts: list[int] = []


class Whole(msgspec.Struct):
    name: str
    part: Part
    parts: dict[str, Part] = {}


DOCUMENT = {
    "name": "é",
    "part": {"number": 1.5, "parts": [1, 2]},
    "parts": {"a": {"number": -1e5}},
    "odd": [None, True],
}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b'{"name": 1, "part": ', "document: is not JSON"),
        (b'{"name": 1, "part": {"number": 1}} {', "document: is not JSON"),
        (b'{"name": "x", "part": {"number": "1"}, "part": {}}', r"part\.number: is given twice; expected"),
        (
            b'{"name": "x", "part": {"number": 1, "parts": ["1"], "parts": []}}',
            r"part\.parts\[0\]: is given twice",
        ),
        (b'{"name": "x", "part": {"number": "1"}, "part": 5}', r"part\.number: is given twice; expected"),
        (b'{"name": 1, "\xff": 1, "part": {}}', "name: is 1; expected|document: is not JSON"),
        (b'{"name": "\xff", "part": {}}', "document: is not JSON: a string is not UTF-8"),
        (b'{\n"name": "x",\n"part": }\n', r"on line 3, in '.*\"part\": }'"),
    ],
)
def test_what_is_wrong_is_named(data: bytes, message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        decode_json(data, Whole, "document")


def test_a_changed_document_is_one_or_is_refused() -> None:
    chance, refused = random.Random(1), 0
    text = json.dumps(DOCUMENT, ensure_ascii=False).encode()
    for _ in range(5_000):
        data = bytearray(text)
        for _ in range(chance.randrange(1, 4)):
            at = chance.randrange(len(data))
            data[at : at + chance.randrange(3)] = chance.choice(
                (b"", b'"', b"[", b"}", b"1", b",", b"\xff", b"null")
            )
        try:
            decode_json(bytes(data), Whole, "document")
        except InvalidRequest:
            refused += 1
    assert refused > 2_500
