"""JSON from outside, decoded into typed structures, with errors that name the field and its value."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from typing import Any, TypeVar

import msgspec
from msgspec import inspect

from oxbow.errors import InvalidRequest

__all__ = ["decode_json", "described", "document_of", "json_names", "part_with_extra", "utf8", "with_extra"]

T = TypeVar("T")

EXTRA = "extra"

_MISTYPED = re.compile(r"(?P<problem>.*?)(?: - at `\$\.?(?P<path>.*)`)?", re.DOTALL)
_MISSING = re.compile(r"Object missing required field `(.*)`")
_UNKNOWN = re.compile(r"Object contains unknown field `(.*)`")
_BYTE = re.compile(r" \(byte (\d+)\)")
_STEP = re.compile(r"(?P<key>[^.\[\]]+)|\[(?P<index>\d+)\]|(?P<any>\[\.\.\.\])")


_BYTE_ORDER_MARKS = {
    codecs.BOM_UTF8: "utf-8",
    codecs.BOM_UTF32_LE: "utf-32-le",  # before UTF-16, whose mark it begins with
    codecs.BOM_UTF32_BE: "utf-32-be",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
}


def utf8(data: bytes, name: str) -> bytes:
    """A text file's content as UTF-8 without a byte order mark; a mark says in which encoding it came.

    Parameters
    ----------
    data
        The content of the file. Without a byte order mark it is returned as it is, and taken to be UTF-8.
    name
        What the file is called in errors.

    Returns
    -------
    bytes
        `data` itself where it has no mark.

    Raises
    ------
    InvalidRequest
        It is not text in the encoding that its mark says.
    """
    for mark, encoding in _BYTE_ORDER_MARKS.items():
        if not data.startswith(mark):
            continue
        text = data[len(mark) :]
        if encoding == "utf-8":
            return text
        try:
            return text.decode(encoding).encode()
        except UnicodeError as error:
            raise InvalidRequest(f"is not {encoding.upper()}, as its byte order mark says", where=name) from error
    return data


def decode_json(data: bytes, kind: type[T], name: str, *, at: str = "") -> T:
    """Decode `data` as `kind`, a type that msgspec can decode, without any conversion between types.

    Parameters
    ----------
    data
        JSON in UTF-8.
    kind
        The type to expect.
    name
        What the document is called in errors.
    at
        Its position in a larger document, which the names of fields in errors begin with.

    Returns
    -------
    `kind`
        The value, with every field of the type that `kind` declares for it.

    Raises
    ------
    InvalidRequest
        `data` is not JSON (the message gives the line and its text) or not of this kind (the error names the field
        with its index, its value and what would be accepted).
    """
    try:
        return _decoded(data, kind, name, at)
    except msgspec.DecodeError as error:
        # msgspec calls an empty document truncated input, which helps nobody who sent an empty file.
        if not data.strip():
            raise InvalidRequest("is empty; expected JSON", where=name) from error
        raise InvalidRequest(f"is not JSON: {_located(str(error), data)}", where=name) from error
    except UnicodeDecodeError as error:
        raise InvalidRequest("is not JSON: a string is not UTF-8", where=name) from error
    except RecursionError as error:
        raise InvalidRequest("is nested too deeply to be read", where=name) from error


def _decoded(data: bytes, kind: type[T], name: str, at: str) -> T:
    try:
        return msgspec.json.decode(data, type=kind)
    except msgspec.ValidationError as error:
        # A syntax error further on takes precedence: of a document that is not JSON, no field can be quoted.
        msgspec.json.decode(data, type=msgspec.Raw)
        raise _mistyped(str(error), data, kind, name, at) from error


def with_extra(document: dict[str, msgspec.Raw], known: frozenset[str]) -> dict[str, msgspec.Raw]:
    """The known fields of a JSON object, without those that are null, and all others together under `extra`.

    Parameters
    ----------
    document
        Names and undecoded values of the object's fields.
    known
        The names that have a field of their own.

    Returns
    -------
    dict of str to msgspec.Raw
        The known fields by their names in JSON, and `extra`, an object, which may be empty.
    """
    fields = {name: raw for name, raw in document.items() if name in known and bytes(raw) != b"null"}
    extra = {name: raw for name, raw in document.items() if name not in known}
    return fields | {EXTRA: msgspec.Raw(msgspec.json.encode(extra))}


def part_with_extra(data: bytes, kind: type[msgspec.Struct], name: str, *, is_list: bool = False) -> msgspec.Raw:
    """The JSON of an object, or of a list of objects, for a struct that keeps unknown fields in its `extra`.

    Anything else is returned as it is, and refused when it is decoded.

    Parameters
    ----------
    data
        JSON.
    kind
        The struct that it is about to be decoded as.
    name
        What the document is called in errors.
    is_list
        Whether a list of objects is expected, rather than one object.

    Returns
    -------
    msgspec.Raw
        JSON in which each object has its unknown fields under `extra`; `data` where it is no such object or list.

    Raises
    ------
    InvalidRequest
        `data` begins like such an object or list, and is not JSON; or an element of the list is no object.
    """
    if not data.startswith(b"[" if is_list else b"{"):
        return msgspec.Raw(data)
    known = frozenset(json_names(kind).values())
    if is_list:
        objects = decode_json(data, list[dict[str, msgspec.Raw]], name, at=name)
        return msgspec.Raw(msgspec.json.encode([with_extra(each, known) for each in objects]))
    return msgspec.Raw(msgspec.json.encode(with_extra(decode_json(data, dict[str, msgspec.Raw], name), known)))


def document_of(value: msgspec.Struct) -> dict[str, Any]:
    """The JSON object of a struct that keeps unknown fields in its `extra`; fields that are None are left out."""
    fields = {name: getattr(value, field) for field, name in json_names(type(value)).items()}
    extra: dict[str, Any] = getattr(value, EXTRA)
    return {name: field for name, field in fields.items() if field is not None} | extra


def json_names(kind: type[msgspec.Struct]) -> dict[str, str]:
    """The name of each field in JSON, except `extra`."""
    return {field.name: field.encode_name for field in msgspec.structs.fields(kind) if field.name != EXTRA}


def described(kind: Any) -> str:
    """What is accepted for a type that msgspec can decode, in words, for errors: ``true or false``."""
    return _described(inspect.type_info(kind))


def _located(problem: str, data: bytes) -> str:
    """The problem with its line and the text around it, in place of a byte offset."""
    match = _BYTE.search(problem)
    if match is None:
        return problem
    byte = int(match[1])
    line = data.count(b"\n", 0, byte) + 1
    seen = data[max(byte - 30, 0) : byte + 12].decode("utf-8", "replace")
    hint = "; NaN and Infinity are not JSON" if re.search(r"NaN|Infinity", seen) else ""
    return f"{problem[: match.start()]} on line {line}, in {' '.join(seen.split())!r}{hint}"


def _mistyped(text: str, data: bytes, kind: Any, name: str, at: str) -> InvalidRequest:
    match = _MISTYPED.fullmatch(text)
    problem, path = (match["problem"], match["path"] or "") if match else (text, "")
    missing, unknown = _MISSING.fullmatch(problem), _UNKNOWN.fullmatch(problem)
    inner = f"{path}.{missing[1]}".lstrip(".") if missing else path
    where = (f"{at}{inner}" if inner.startswith("[") else f"{at}.{inner}").strip(".") or name
    if missing:
        return InvalidRequest("is missing; it is required", where=where)
    accepted = _described(_type_at(kind, path))
    if unknown:
        return InvalidRequest(f"has a field {unknown[1]!r}; expected {accepted} and nothing else", where=where)
    return InvalidRequest(f"is {_text_at(path, data)}; expected {accepted}", where=where)


def _steps(path: str) -> Iterator[re.Match[str]]:
    """The steps of a path such as ``a[3].b``; ``[...]`` stands for some key of a mapping."""
    return _STEP.finditer(path)


def _text_at(path: str, data: bytes) -> str:
    """The JSON text of the value at `path`, shortened."""
    raw = msgspec.Raw(data)
    try:
        for step in _steps(path):
            if step["any"]:
                break
            if step["key"]:
                raw = msgspec.json.decode(raw, type=dict[str, msgspec.Raw])[step["key"]]
            else:
                raw = msgspec.json.decode(raw, type=list[msgspec.Raw])[int(step["index"])]
    except (KeyError, IndexError, msgspec.ValidationError):
        # A name that occurs twice: the decoder met the first, and the dictionary holds the last.
        return "given twice"
    text = " ".join(bytes(raw).decode("utf-8", "replace").split())
    return text if len(text) <= 60 else f"{text[:57]}..."


def _type_at(kind: Any, path: str) -> inspect.Type:
    """The type that is expected at `path`."""
    found: Any = inspect.type_info(kind)
    for step in _steps(path):
        if isinstance(found, inspect.UnionType):
            found = next(option for option in found.types if not isinstance(option, inspect.NoneType))
        if isinstance(found, inspect.StructType):
            found = next(field.type for field in found.fields if field.encode_name == step["key"])
        elif isinstance(found, inspect.TupleType):
            found = found.item_types[int(step["index"])]
        elif isinstance(found, inspect.DictType):
            found = found.value_type
        elif isinstance(found, inspect.VarTupleType | inspect.ListType):
            found = found.item_type
    return found  # type: ignore[no-any-return]


def _described(kind: inspect.Type) -> str:  # noqa: PLR0911 - one line a type
    match kind:
        case inspect.FloatType():
            return "a finite number"
        case inspect.IntType():
            return "a whole number"
        case inspect.StrType():
            return "a string"
        case inspect.BoolType():
            return "true or false"
        case inspect.EnumType(cls=choices):
            return f"one of {', '.join(choices)}"
        case inspect.StructType(fields=fields):
            return f"an object with {', '.join(field.encode_name for field in fields if field.required)}"
        case inspect.DictType():
            return "an object"
        case inspect.TupleType(item_types=items):
            return f"a list of {len(items)} values"
        case inspect.VarTupleType(min_length=least) | inspect.ListType(min_length=least):
            return f"a list of {least} values or more" if least else "a list"
        case inspect.UnionType(types=options):
            return " or ".join(
                _described(option) for option in options if not isinstance(option, inspect.NoneType)
            )
        case _:
            return "another value"
