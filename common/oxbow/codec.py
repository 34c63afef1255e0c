"""How messages become bytes: MessagePack, with geometry as WKB and arrays as raw little-endian floats."""

from __future__ import annotations

import hashlib
from typing import Any, TypeVar

import msgspec
import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from oxbow.errors import InvalidMission

__all__ = ["decode", "digest", "encode"]

T = TypeVar("T")


def _to_wire(value: Any) -> Any:
    if isinstance(value, BaseGeometry):
        return shapely.to_wkb(value)
    if isinstance(value, np.ndarray):
        return [value.dtype.newbyteorder("<").str, list(value.shape), np.ascontiguousarray(value).tobytes()]
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be sent")


def _from_wire(kind: type, value: Any) -> Any:
    origin = getattr(kind, "__origin__", kind)
    if isinstance(origin, type) and issubclass(origin, BaseGeometry):
        geometry = shapely.from_wkb(value)
        if not isinstance(geometry, origin):
            raise ValueError(f"expected a {origin.__name__}, got a {geometry.geom_type}")
        return geometry
    if origin is np.ndarray:
        dtype, shape, data = value
        return np.frombuffer(data, dtype=dtype).reshape(shape)
    raise TypeError(f"{kind!r} cannot be received")


_ENCODER = msgspec.msgpack.Encoder(enc_hook=_to_wire)


def encode(message: msgspec.Struct) -> bytes:
    """MessagePack bytes of a message."""
    return _ENCODER.encode(message)


def digest(message: msgspec.Struct) -> str:
    """A digest of a message: equal where its bytes are."""
    return hashlib.sha256(encode(message)).hexdigest()


def decode(data: bytes, kind: type[T]) -> T:
    """Decode `data` as a message of type `kind`.

    Raises
    ------
    InvalidMission
        The bytes are not such a message, or break one of its invariants.
    """
    try:
        return msgspec.msgpack.decode(data, type=kind, dec_hook=_from_wire)
    except (msgspec.DecodeError, shapely.errors.ShapelyError) as error:
        raise InvalidMission(f"not a {kind.__name__}: {error}", where=kind.__name__) from error
