"""Requests being read and checked in helper processes, so that no request keeps the others from being answered."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable

from oxbow.errors import Busy, DeadlineExceeded, Internal, InvalidMission, OxbowError, error_text
from oxbow.runtime.closing import Closing
from oxbow_mission.fair import FairQueue
from oxbow_mission.helper import Helper, HelperDied, Helpers
from oxbow_mission.wire import Answer, Ask, Check, Checked, HelperFailed, Show

__all__ = ["Checks", "Incoming"]

QUICK_BYTES = 2**20
QUICK_S = 1.0
SLOW_S = 20.0
PROCESSES = 2
"""Helper processes of each lane."""

MOST_ITEMS = 64
"""Requests of one client that may wait in one lane."""
MOST_BYTES = 2**29
MOST_LOSSES = 3
"""Helper processes, killed from outside, that one request may cost."""

_log = logging.getLogger(__name__)


class Incoming(ABC):
    """A request that came in, and what becomes of it: `accept` or `fail`; where `accept` raises, `fail` too."""

    client: str
    size: int

    @abstractmethod
    def check(self) -> Check:
        """What to check."""

    @abstractmethod
    def accept(self, checked: Checked) -> None:
        """Keep it."""

    @abstractmethod
    def fail(self, error: OxbowError) -> None:
        """Refuse it."""


class Checks(Closing):
    """Two lanes: most requests take milliseconds, and are not to wait for one that takes long.

    A request that is small begins in the quick lane, and goes to the slow one where it takes longer than
    `QUICK_S`. There it may take `SLOW_S`.

    Parameters
    ----------
    memory_mb
        What a helper process may take.
    handler
        What the helper processes do, as ``package.module:attribute``.
    """

    def __init__(self, memory_mb: int, handler: str = "oxbow_mission.check:check") -> None:
        self._slow = _Lane(Helpers(handler, memory_mb), SLOW_S, _refuse_late)
        # Most requests are small and take milliseconds: none of them waits behind one that takes long.
        self._quick = _Lane(Helpers(handler, memory_mb), QUICK_S, self._slow.put)
        self._quick.prepare()

    def put(self, incoming: Incoming) -> None:
        """Have a request checked; if there is no room, it is answered `busy`."""
        lane = self._quick if incoming.size <= QUICK_BYTES else self._slow
        lane.put(incoming)

    def drop(self, client: str) -> None:
        """Drop what a client that is gone has waiting."""
        for lane in (self._quick, self._slow):
            lane.drop(client)

    def close(self) -> None:
        """Stop checking, and end the helper processes."""
        self._quick.close()
        self._slow.close()


class _Lane:
    """Threads with a helper process each, and what to do with a request that takes longer than `limit_s`."""

    def __init__(self, helpers: Helpers, limit_s: float, on_late: Callable[[Incoming], None]) -> None:
        self.limit_s = limit_s
        self._on_late = on_late
        self._queue = FairQueue[Incoming](most_items=MOST_ITEMS, most_bytes=MOST_BYTES)
        self._helpers = helpers
        # Daemons: what is being checked must not keep this process from ending.
        self._threads = [
            threading.Thread(target=self._work, name=f"check-{i}", daemon=True) for i in range(PROCESSES)
        ]
        for thread in self._threads:
            thread.start()

    def put(self, incoming: Incoming) -> None:
        try:
            self._queue.put(incoming.client, incoming, incoming.size)
        except Busy as error:
            incoming.fail(error)

    def drop(self, client: str) -> None:
        for incoming in self._queue.drop(client):
            incoming.fail(Busy("its sender is gone", where="mission"))

    def close(self) -> None:
        self._queue.close()
        self._helpers.close()

    def prepare(self) -> None:
        """Have a process ready for the first request."""
        with self._helpers.one() as helper:
            helper.start()

    def _work(self) -> None:
        while (incoming := self._queue.get()) is not None:
            try:
                with self._helpers.one() as helper:
                    self._deal(incoming, helper)
            except BaseException:  # noqa: BLE001 - zenoh's panics are no Exception; the thread lives on
                _log.exception("a request was lost")

    def _deal(self, incoming: Incoming, helper: Helper) -> None:
        try:
            checked = self._checked(incoming.check(), helper)
            if checked is None:
                helper.start()  # the late one was killed: the next request is not to wait for a new one
                self._on_late(incoming)
            else:
                incoming.accept(checked)
        except OxbowError as error:
            incoming.fail(error)
        except BaseException as error:
            incoming.fail(Internal(error_text(error), where="mission"))
            raise

    def _checked(self, check: Check, helper: Helper) -> Checked | None:
        """What is to be kept of a request; None where the check is not done in time."""
        for losses in range(1, MOST_LOSSES + 1):
            try:
                outcome = helper.carry_out(check, self.limit_s, _no_answer)
            except DeadlineExceeded:
                return None
            except HelperDied as error:
                # A request that kills its helper would kill the next one too.
                if error.is_own_fault or losses == MOST_LOSSES:
                    raise
                continue
            if isinstance(outcome, Checked):
                return outcome
            # A refusal: the check did its work, and found something wrong.
            if isinstance(outcome, HelperFailed):
                raise outcome.error.error()
            break
        raise Internal("a helper process did not answer what it was asked", where="mission")


def _no_answer(said: Ask | Show) -> Answer | None:
    raise Internal(f"a helper process said {type(said).__name__} during a check", where="mission")


def _refuse_late(incoming: Incoming) -> None:
    incoming.fail(
        InvalidMission(
            f"takes more than {SLOW_S:g} s to check, at {incoming.size} bytes; expected contours with fewer"
            " points, or that cross themselves in fewer places",
            where="Mission File",
        )
    )
