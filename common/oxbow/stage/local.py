"""Stages called in one process: for tests, notebooks, `--local`, and to measure what the bus costs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from oxbow.contracts import Endpoint, Message
from oxbow.errors import Internal
from oxbow.wire.recording import Show, discard

__all__ = ["Handler", "LocalCall"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

Handler = Callable[[Any, Show], Any]
"""A stage's `handle(request, show) -> reply`."""


class LocalCall:
    """Calls a stage's handler directly; the same shape as a call over the bus.

    Parameters
    ----------
    handlers
        One handler for each stage name.
    show
        Receives every layer that the stages show.
    """

    def __init__(self, handlers: Mapping[str, Handler], show: Show = discard) -> None:
        self.handlers = dict(handlers)
        self.show = show

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R:  # noqa: ARG002
        reply = self.handlers[endpoint.stage](request, self.show)
        if not isinstance(reply, endpoint.reply):
            expected = endpoint.reply.__name__
            raise Internal(f"replied a {type(reply).__name__}, not a {expected}", where=endpoint.stage)
        return reply
