"""Which replicas of each stage are alive, and which of them to ask next."""

from __future__ import annotations

import itertools
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Collection

__all__ = ["Replicas"]


class Replicas:
    """Shares one caller's requests among the live replicas of each stage.

    The replica with the fewest of this caller's requests outstanding is next, and the one longest not asked
    among equals. `most_outstanding` keeps a caller from filling the queue of a slow replica while another is free.
    """

    def __init__(self, most_outstanding: int) -> None:
        self.most_outstanding = most_outstanding
        self._changed = threading.Condition()
        self._alive: defaultdict[str, set[str]] = defaultdict(set)
        self._outstanding: Counter[tuple[str, str]] = Counter()
        self._asked: dict[tuple[str, str], int] = {}
        self._turns = itertools.count()
        self._started = time.monotonic()
        self._missing_since: dict[str, float] = {}

    def update(self, stage: str, instance: str, alive: bool) -> None:
        """Note that a replica has come or gone.

        Parameters
        ----------
        stage
            The replica's stage.
        instance
            Its name.
        alive
            Whether its liveliness token is there.
        """
        with self._changed:
            if alive:
                self._alive[stage].add(instance)
            else:
                self._alive[stage].discard(instance)
                if not self._alive[stage]:
                    self._missing_since[stage] = time.monotonic()
            self._changed.notify_all()

    def alive(self, stage: str) -> tuple[str, ...]:
        with self._changed:
            return tuple(sorted(self._alive[stage]))

    def missing_s(self, stage: str) -> float:
        """How long a stage has been without a live replica."""
        with self._changed:
            if self._alive[stage]:
                return 0.0
            # Since this object was made, for a stage that was never seen: it may only be starting.
            return time.monotonic() - self._missing_since.get(stage, self._started)

    def wait_alive(self, stages: Collection[str], timeout_s: float) -> tuple[str, ...]:
        """Wait until stages have live replicas.

        Parameters
        ----------
        stages
            Their names.
        timeout_s
            Seconds to wait at most.

        Returns
        -------
        tuple of str
            The stages that still have none; empty where each has one.
        """
        with self._changed:
            self._changed.wait_for(lambda: all(self._alive[stage] for stage in stages), timeout_s)
            return tuple(stage for stage in stages if not self._alive[stage])

    def acquire(self, stage: str, avoid: Collection[str], timeout_s: float) -> str | None:
        """Choose a live replica, and count a request on it until `release`.

        Parameters
        ----------
        stage
            The replica's stage.
        avoid
            Replicas to choose only where no other is alive.
        timeout_s
            Seconds to wait for one with room.

        Returns
        -------
        str or None
            The replica's name; None where none had room in time.
        """
        # A wait may be ended by changes at other stages; what remains of it is computed anew each time.
        give_up = time.monotonic() + timeout_s
        with self._changed:
            while (instance := self._best(stage, avoid)) is None:
                if not self._changed.wait(give_up - time.monotonic()):
                    return None
            self._outstanding[stage, instance] += 1
            self._asked[stage, instance] = next(self._turns)
            return instance

    def release(self, stage: str, instance: str) -> None:
        """Count a request off, answered or not.

        Parameters
        ----------
        stage, instance
            The replica that `acquire` chose.
        """
        with self._changed:
            self._outstanding[stage, instance] -= 1
            self._changed.notify_all()

    def _best(self, stage: str, avoid: Collection[str]) -> str | None:
        alive = self._alive[stage]
        # Where all live ones are to be avoided, one of them is better than none.
        candidates = [
            # Never asked (-1) before longest ago; the name last, so that the choice does not depend on the order
            # of a set.
            (self._outstanding[stage, instance], self._asked.get((stage, instance), -1), instance)
            for instance in (alive - set(avoid)) or alive
            if self._outstanding[stage, instance] < self.most_outstanding
        ]
        return min(candidates)[2] if candidates else None
