"""Queries that wait for a plan: they hold no thread, and are let go when nobody waits for the answer any more."""

from __future__ import annotations

import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Collection
from dataclasses import dataclass

from oxbow.bus.query import Query
from oxbow.contracts import PLAN_KEY, MissionStatus
from oxbow.errors import Busy, DeadlineExceeded, ErrorReply, OxbowError
from oxbow_mission.store import Revision, Store

__all__ = ["Waiter", "Waiters"]

MOST_PER_CLIENT = 256
MOST = 4096


@dataclass(frozen=True)
class Waiter:
    """A query, whose it is, and until when (`time.monotonic`) its asker may still be there."""

    query: Query
    client: str
    until: float

    def answer(self, store: Store, status: MissionStatus) -> None:
        """Answer by the plan of a revision that is final, or by why there is none."""
        if status.error is not None:
            self.fail(status.error.error())
            return
        with self.query:
            self.query.reply(PLAN_KEY, store.plan(Revision.of(status)))

    def fail(self, error: OxbowError) -> None:
        """Answer that there will be no plan."""
        with self.query:
            self.query.fail(ErrorReply.of(error))


class Waiters:
    """Who waits for which revision; safe between threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: defaultdict[Revision, list[Waiter]] = defaultdict(list)
        self._counts: Counter[str] = Counter()

    def add(self, revision: Revision, waiter: Waiter) -> None:
        """Have a query wait; `Busy` where too many do."""
        with self._lock:
            own, every = self._counts[waiter.client], self._counts.total()
            if own >= MOST_PER_CLIENT or every >= MOST:
                raise Busy(
                    f"{own} queries of this client and {every} in all wait for plans; expected fewer than"
                    f" {MOST_PER_CLIENT} and {MOST}: the mission is kept, ask again later",
                    where="mission",
                )
            self._waiting[revision].append(waiter)
            self._counts[waiter.client] += 1

    def take(self, revision: Revision) -> list[Waiter]:
        """Those who wait for a revision; they do so no longer."""
        with self._lock:
            taken = self._waiting.pop(revision, [])
            self._counts.subtract(waiter.client for waiter in taken)
            return taken

    def let_go(self, gone: Collection[str]) -> int:
        """Let go whose client is gone or whose time is up; return how many these were."""
        now = time.monotonic()
        left = self._take_if(lambda waiter: waiter.client in gone)
        late = self._take_if(lambda waiter: waiter.until < now)
        for waiter in left:
            with waiter.query:
                pass
        for waiter in late:
            waiter.fail(DeadlineExceeded("no plan yet; the mission is kept, ask again", where="mission"))
        return len(left) + len(late)

    def _take_if(self, is_meant: Callable[[Waiter], bool]) -> list[Waiter]:
        with self._lock:
            taken: list[Waiter] = []
            for revision, waiters in list(self._waiting.items()):
                meant = [waiter for waiter in waiters if is_meant(waiter)]
                taken += meant
                self._waiting[revision] = [waiter for waiter in waiters if waiter not in meant]
                if not self._waiting[revision]:
                    del self._waiting[revision]
            self._counts.subtract(waiter.client for waiter in taken)
            self._counts = +self._counts
            return taken
