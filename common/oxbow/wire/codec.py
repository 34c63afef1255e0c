"""How messages become bytes: MessagePack, with geometry as WKB and arrays as raw little-endian floats."""

from __future__ import annotations

import hashlib
import math
import re
from typing import Any, TypeVar

import msgspec
import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from oxbow.errors import InvalidRequest
from oxbow.wire.wkb import from_wkb

__all__ = ["decode", "digest", "encode"]

T = TypeVar("T")

_FLOAT = "<f8"
_MOST_DIMENSIONS = 3
_AT = re.compile(r"(?P<problem>.*) - at `\$\.?(?P<path>.*)`", re.DOTALL)


def _to_wire(value: Any) -> Any:
    if isinstance(value, BaseGeometry):
        return shapely.to_wkb(value)
    if isinstance(value, np.ndarray):
        return [_FLOAT, list(value.shape), np.ascontiguousarray(value, dtype=_FLOAT).tobytes()]
    # Array arithmetic leaves such scalars in messages; msgspec takes none but float64, which is a float.
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be sent")


def _from_wire(kind: type, value: Any) -> Any:
    """A value of a type that msgspec does not know; a ValueError is raised again by msgspec with the field."""
    origin = getattr(kind, "__origin__", kind)
    if isinstance(origin, type) and issubclass(origin, BaseGeometry):
        if not isinstance(value, bytes):
            raise ValueError(f"is a {type(value).__name__}; expected WKB")
        return from_wkb(value, origin)
    if origin is np.ndarray:
        return _array(value)
    raise TypeError(f"{kind!r} cannot be received")


def _array(value: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    match value:
        case [str(dtype), [*shape], bytes(data)] if dtype == _FLOAT and _is_shape(shape, len(data)):
            # A view of the message's bytes, and read-only for that, as everything in a message is.
            array = np.frombuffer(data, dtype=_FLOAT).reshape(shape)
        case _:
            raise ValueError(
                f"is not an array; expected ['{_FLOAT}', shape, bytes] with as many bytes as the shape has"
            )
    if not np.isfinite(array).all():
        raise ValueError("has elements that are not finite")
    return array


def _is_shape(shape: list[Any], size: int) -> bool:
    # Beside a length of 0 the others would go unchecked: hence a bound of each. A bool is an int to `isinstance`.
    if len(shape) > _MOST_DIMENSIONS or not all(type(length) is int and 0 <= length <= size for length in shape):
        return False
    return bool(8 * math.prod(shape) == size)


_ENCODER = msgspec.msgpack.Encoder(enc_hook=_to_wire)


def encode(message: msgspec.Struct) -> bytes:
    """MessagePack bytes of a message."""
    return _ENCODER.encode(message)


def digest(message: msgspec.Struct) -> str:
    """A digest of a message: equal for equal bytes."""
    return hashlib.sha256(encode(message)).hexdigest()


def decode(data: bytes, kind: type[T]) -> T:
    """Decode `data` as a message of type `kind`.

    Parameters
    ----------
    data
        MessagePack, as `encode` makes it.
    kind
        The type of message to expect.

    Returns
    -------
    message of type `kind`
        It keeps its invariants: they are checked as it is built. Its arrays are read-only views of `data`.

    Raises
    ------
    InvalidRequest
        The bytes are not such a message, or break one of its invariants; names the field.
    """
    try:
        return msgspec.msgpack.decode(data, type=kind, dec_hook=_from_wire)
    except msgspec.ValidationError as error:
        # msgspec reports the path only in the text of its error.
        match = _AT.fullmatch(str(error))
        problem, path = (match["problem"], f".{match['path']}") if match else (str(error), "")
        raise InvalidRequest(f"{problem[:1].lower()}{problem[1:]}", where=f"{kind.__name__}{path}") from error
    # What else malformed bytes raise: text that is not UTF-8, nesting too deep, lengths beyond 64 bits.
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, OverflowError) as error:
        raise InvalidRequest(f"is not a valid MessagePack message: {error}", where=kind.__name__) from error
