"""What the recorder says to a process that writes recordings, over a pipe (MessagePack)."""

from __future__ import annotations

import msgspec

from oxbow_recorder.address import Run

__all__ = ["Draw", "Finish", "ToWriter"]


class Draw(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A layer to draw, an encoded `oxbow.wire.recording.Stamped`; the first of a run begins its recording."""

    run: Run
    payload: bytes


class Finish(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Put the recording of a run in its place."""

    run: Run


ToWriter = Draw | Finish
