"""JSON that comes from outside, decoded into typed structures, with errors that name field and value."""

from __future__ import annotations

import re
from typing import Any, TypeVar

import msgspec

from oxbow.errors import InvalidMission

__all__ = ["decode_json"]

T = TypeVar("T")

_MISTYPED = re.compile(r"(?P<problem>.*?)(?: - at `\$\.?(?P<path>.*)`)?", re.DOTALL)
_MISSING = re.compile(r"Object missing required field `(.*)`")
_UNKNOWN = re.compile(r"Object contains unknown field `(.*)`")
_BYTE = re.compile(r" \(byte (\d+)\)")
_PLAIN_NAMES = {
    "float": "a number",
    "int": "a whole number",
    "str": "a string",
    "bool": "true or false",
    "object": "an object",
    "array": "a list",
}


def decode_json(data: bytes, kind: type[T], name: str) -> T:
    """Decode `data` as `kind`, a type that msgspec can decode; nothing is converted on the way.

    Parameters
    ----------
    data
        JSON in UTF-8.
    kind
        The structure to expect.
    name
        What the document is called in errors.

    Raises
    ------
    InvalidMission
        `data` is not JSON (the message tells the line and what stands there) or not of this kind (the
        error tells the field with its index, its value and what would be accepted).
    """
    try:
        return msgspec.json.decode(data, type=kind)
    except msgspec.ValidationError as error:
        raise _mistyped(str(error), data, name) from error
    except msgspec.DecodeError as error:
        raise InvalidMission(f"is not JSON: {_located(str(error), data)}", where=name) from error
    except RecursionError as error:
        raise InvalidMission("is nested too deeply to be read", where=name) from error
    except UnicodeDecodeError as error:
        raise InvalidMission(f"is not JSON: not UTF-8 at byte {error.start}", where=name) from error


def _located(problem: str, data: bytes) -> str:
    """The problem with its line and the text that stands there, in place of a byte offset."""
    match = _BYTE.search(problem)
    if match is None:
        return problem
    byte = int(match[1])
    line = data.count(b"\n", 0, byte) + 1
    seen = data[max(byte - 30, 0) : byte + 12].decode("utf-8", "replace")
    hint = "; NaN and Infinity are not JSON" if re.search(r"NaN|Infinity", seen) else ""
    return f"{problem[: match.start()]} on line {line}, in {' '.join(seen.split())!r}{hint}"


def _mistyped(text: str, data: bytes, name: str) -> InvalidMission:
    match = _MISTYPED.fullmatch(text)
    problem, path = (match["problem"], match["path"] or "") if match else (text, "")
    if missing := _MISSING.fullmatch(problem):
        return InvalidMission("is missing; it is required", where=f"{path}.{missing[1]}".lstrip("."))
    if unknown := _UNKNOWN.fullmatch(problem):
        return InvalidMission(f"has a field {unknown[1]!r}, which has no meaning here", where=path or name)
    value = _value_at(path, data)
    return InvalidMission(f"is {value}; {_expected(problem)}" if value else problem, where=path or name)


def _expected(problem: str) -> str:
    if problem == "Number out of range":
        return "expected a finite number"
    kinds = re.match(r"Expected `([a-z |]+)`(.*?)(, got .*)?$", problem)
    if kinds is None:
        return problem[0].lower() + problem[1:]
    return "expected " + " or ".join(_PLAIN_NAMES.get(kind, kind) for kind in kinds[1].split(" | ")) + kinds[2]


def _value_at(path: str, data: bytes) -> str:
    """The text of the value that stands at `path` (``a[3].b``), or nothing where the path is not exact."""
    raw: Any = msgspec.Raw(data)
    for key, index in re.findall(r"([^.\[\]]+)|\[(\d+|\.\.\.)\]", path):
        if index == "...":
            return ""
        raw = msgspec.json.decode(raw, type=dict[str, msgspec.Raw])[key] if key and not index else raw
        raw = msgspec.json.decode(raw, type=list[msgspec.Raw])[int(index)] if index else raw
    text = " ".join(bytes(raw).decode("utf-8", "replace").split())
    return text if len(text) <= 60 else f"{text[:57]}..."
