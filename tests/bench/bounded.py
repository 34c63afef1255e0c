"""Work with a time limit: in a process of its own, which is stopped when it is late."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from types import TracebackType
from typing import ParamSpec, Self, TypeVar

__all__ = ["Bounded"]

P = ParamSpec("P")
R = TypeVar("R")


class Bounded:
    """Runs functions one after another in a spawned process; a context manager."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._pool = self._context.Pool(1)

    def run(self, seconds: float, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """What the function returns; `TimeoutError` after so many seconds."""
        try:
            return self._pool.apply_async(function, args, kwargs).get(seconds)
        except multiprocessing.TimeoutError:
            self._pool.terminate()
            self._pool = self._context.Pool(1)
            raise TimeoutError(f"not done after {seconds:g} s") from None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pool.terminate()
        self._pool.join()
