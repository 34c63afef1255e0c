"""Messages that are wrong: bytes changed, and fields changed in ways that bytes alone seldom are."""

from __future__ import annotations

import math
import random
import struct
from typing import Any

import msgspec

__all__ = ["mutated"]

NUMBERS: tuple[Any, ...] = (
    *(
        0,
        -1,
        1,
        2**31,
        2**63,
        -(2**63),
        2**64 - 1,
        0.0,
        -0.0,
        0.5,
        -1.0,
        1e-300,
        1e-9,
        1e6,
        1e9,
        1e16,
        1e300,
        -1e300,
    ),
    *(math.nan, math.inf, -math.inf),
)
OTHERS: tuple[Any, ...] = (
    None,
    True,
    "",
    "x",
    "\x00",
    b"",
    b"\xff",
    [],
    {},
    [[]],
    {"": 0},
    [math.nan, 0.0],
    [1e300] * 2,
)
COORDINATES = (0.0, 1.0, -1.0, 1e-9, 1e6, 2e7, 1e17, 1e300, -1e300, math.nan, math.inf)
COUNTS = (0, 1, 2, 3, 7, 255, 2**16, 2**31, 2**32 - 1)
NESTED = b"\x01\x07\x00\x00\x00\x01\x00\x00\x00" * 20_000 + b"\x01\x01\x00\x00\x00" + bytes(16)


def mutated(message: bytes, chance: random.Random) -> bytes:
    """A message with one to three changes, to its bytes or to its fields."""
    if chance.random() < 0.3:
        return _bytes_mutated(message, chance)
    content = msgspec.msgpack.decode(message)
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        content = _field_mutated(content, chance)
    return msgspec.msgpack.encode(content)


def _field_mutated(value: Any, chance: random.Random) -> Any:
    """`value` with a change somewhere inside."""
    if isinstance(value, dict) and value and chance.random() < 0.95:
        name = chance.choice(list(value))
        if chance.random() < 0.05:
            return {key: part for key, part in value.items() if key != name}
        return {**value, name: _field_mutated(value[name], chance)}
    if isinstance(value, list) and value and chance.random() < 0.9:
        return _list_mutated(value, chance)
    if isinstance(value, bytes) and value and chance.random() < 0.9:
        return _wkb_mutated(value, chance)
    if isinstance(value, float | int) and chance.random() < 0.9:
        return chance.choice((*NUMBERS, 1.01 * value, 1.0 + value, -1.0 * value))
    return chance.choice((*NUMBERS, *OTHERS))


def _list_mutated(value: list[Any], chance: random.Random) -> list[Any]:
    index = chance.randrange(len(value))
    kind = chance.random()
    if kind < 0.1:
        return value[:index] + value[index + 1 :]
    if kind < 0.2:
        return [*value[:index], value[index], *value[index:]]
    return [*value[:index], _field_mutated(value[index], chance), *value[index + 1 :]]


def _wkb_mutated(data: bytes, chance: random.Random) -> bytes:
    kind = chance.random()
    if kind < 0.05:
        return NESTED
    if kind < 0.15 and len(data) > 13:
        at = chance.choice((1, 5, 9))
        return data[:at] + struct.pack("<I", chance.choice(COUNTS)) + data[at + 4 :]
    if kind < 0.75 and len(data) >= 29:
        at = 13 + 8 * chance.randrange((len(data) - 13) // 8)
        (old,) = struct.unpack_from("<d", data, at)
        new = chance.choice((*COORDINATES, old + chance.gauss(0.0, 30.0), -old))
        return data[:at] + struct.pack("<d", new) + data[at + 8 :]
    return _bytes_mutated(data, chance)


def _bytes_mutated(data: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(data))
    match chance.randrange(4):
        case 0:
            return data[:at]
        case 1:
            return data[:at] + chance.randbytes(chance.randrange(1, 9)) + data[at:]
        case 2:
            return data[:at] + data[at + chance.randrange(1, 9) :]
        case _:
            return data[:at] + bytes([data[at] ^ 1 << chance.randrange(8)]) + data[at + 1 :]
