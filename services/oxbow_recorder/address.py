"""Whose a layer is: read from its bytes without decoding its geometry, and checked before all else."""

from __future__ import annotations

import msgspec

from oxbow.contracts import checked_id, layer_key
from oxbow.errors import InvalidRequest

__all__ = ["MOST_LAYER_BYTES", "Address", "RecordedRun", "address_of"]

MOST_LAYER_BYTES = 32 * 2**20
"""Larger layers are dropped: a lake's triangles take a few megabytes."""

_END = frozenset({("mission", "done"), ("mission", "failed")})
"""Stage and name of a mission's last layer."""


class RecordedRun(msgspec.Struct, frozen=True, kw_only=True):
    """One run of a mission; its ids may stand in a key and in a file's name."""

    mission_id: str
    run_id: str

    def __post_init__(self) -> None:
        checked_id(self.mission_id, where="mission_id")
        checked_id(self.run_id, where="request_id")


class Address(msgspec.Struct, frozen=True, kw_only=True):
    """The run that a layer belongs to, and whether it is that run's last."""

    run: RecordedRun
    is_last: bool


class _Name(msgspec.Struct):
    stage: str
    name: str


class _Stamp(msgspec.Struct):
    """The part of an `oxbow.wire.recording.Stamped` that names it."""

    mission_id: str
    layer: _Name
    request_id: str = ""


def address_of(key: str, payload: bytes) -> Address:
    """The address of an encoded `oxbow.wire.recording.Stamped` that was put on `key`.

    Parameters
    ----------
    key
        Where the layer was put.
    payload
        The encoded layer.

    Returns
    -------
    Address
        Its ids are fit for keys and file names.

    Raises
    ------
    InvalidRequest
        It is no such message or too large, one of its ids is not valid, or the key does not match the message.
    """
    # Before it is decoded, on the thread that all layers pass through.
    if len(payload) > MOST_LAYER_BYTES:
        raise InvalidRequest(f"is {len(payload)} bytes; expected at most {MOST_LAYER_BYTES}", where="layer")
    try:
        stamp = msgspec.msgpack.decode(payload, type=_Stamp)
    except (ValueError, RecursionError) as error:  # UnicodeDecodeError is a ValueError, but no DecodeError
        raise InvalidRequest(f"is not a layer: {error}", where="layer") from error
    run = RecordedRun(mission_id=stamp.mission_id, run_id=stamp.request_id or "run")
    own_key = layer_key(stamp.mission_id, stamp.layer.stage, stamp.layer.name)
    # Whoever may publish on one key only must not be able to write into the recording of another mission.
    if key != own_key:
        raise InvalidRequest(f"was put on a key other than its own, {own_key}", where="layer")
    return Address(run=run, is_last=(stamp.layer.stage, stamp.layer.name) in _END)
