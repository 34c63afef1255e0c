"""What the recorder says to a process that writes recordings, over a pipe (MessagePack)."""

from __future__ import annotations

import msgspec

from oxbow_recorder.address import RecordedRun

__all__ = ["DrawLayer", "Finish", "ToWriter"]


class DrawLayer(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A layer to draw, an encoded `oxbow.wire.recording.Stamped`; the first of a run begins its recording."""

    run: RecordedRun
    payload: bytes


class Finish(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Put the recording of a run in its place."""

    run: RecordedRun


ToWriter = DrawLayer | Finish
