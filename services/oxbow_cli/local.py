"""The stages in this process: what `--local` plans with."""

from __future__ import annotations

from importlib import import_module

from oxbow.contracts import STAGES
from oxbow.stage.local import Handler, LocalCall
from oxbow.wire.recording import Show, discard

__all__ = ["local_call"]


def local_call(show: Show = discard) -> LocalCall:
    """A call that runs each stage's handler in this process; calling this imports the algorithms.

    The handler of stage ``x`` is that of ``oxbow_x.service``, the same as in a process of its own.
    """
    handlers: dict[str, Handler] = {
        endpoint.stage: import_module(f"oxbow_{endpoint.stage}.service").handle for endpoint in STAGES
    }
    return LocalCall(handlers, show)
