"""The stages in this process: what `--local` plans with."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from oxbow.contracts import STAGES
from oxbow.stage.local import Handler, LocalCall
from oxbow.wire.recording import Show, discard

__all__ = ["local_call"]


def local_call(show: Show = discard) -> LocalCall:
    """A call that runs each stage's handler in this process; its first request imports a stage's algorithms.

    The handler of stage ``x`` is that of ``oxbow_x.service``, the same as in a process of its own.
    """
    return LocalCall({endpoint.stage: _handler(endpoint.stage) for endpoint in STAGES}, show)


def _handler(stage: str) -> Handler:
    """A stage's handler, imported when it is called: most missions have nothing to assign."""

    def handle(request: Any, show: Show) -> Any:
        return import_module(f"oxbow_{stage}.service").handle(request, show)

    return handle
