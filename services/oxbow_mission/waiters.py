"""Queries that wait for a plan: they hold no thread, and are dropped when nobody waits for the answer any more."""

from __future__ import annotations

import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Collection
from dataclasses import dataclass

from oxbow.bus.query import Query
from oxbow.contracts import PLAN_KEY, MissionStatus
from oxbow.errors import Busy, DeadlineExceeded, ErrorReply, OxbowError
from oxbow_mission.revision import Revision
from oxbow_mission.store import Store
from oxbow_mission.wire import STAGE

__all__ = ["Waiter", "Waiters"]

MOST_PER_CLIENT = 256
MOST = 4096
MOST_BYTES_PER_CLIENT = 2**28
MOST_BYTES = 2**29
"""A query that waits holds its payload."""


@dataclass(frozen=True)
class Waiter:
    """A query, whose it is, until when (`time.monotonic`) its asker may be there, and the bytes of its payload."""

    query: Query
    client: str
    until: float
    size: int

    def answer(self, store: Store, status: MissionStatus) -> None:
        """Answer with the plan of a revision, or with the reason why there is none.

        Parameters
        ----------
        store
            Where the plan is kept.
        status
            That of the revision, which is final.
        """
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
        self._bytes: Counter[str] = Counter()

    def add(self, revision: Revision, waiter: Waiter) -> None:
        """Have a query wait.

        Parameters
        ----------
        revision
            What it waits for.
        waiter
            The query, and whose it is.

        Raises
        ------
        Busy
            Too many wait already, of this client or in all, or they hold too many bytes.
        """
        with self._lock:
            # Bounds for one client and for all: one that asks for thousands of plans must leave room for the
            # others.
            own, every = self._counts[waiter.client], self._counts.total()
            own_bytes, every_bytes = self._bytes[waiter.client], self._bytes.total()
            if own >= MOST_PER_CLIENT or every >= MOST:
                raise _busy(
                    f"{own} queries of this client and {every}", f"fewer than {MOST_PER_CLIENT} and {MOST}"
                )
            # The first query of a client may wait however large it is: other clients must not shut it out.
            if own and (own_bytes + waiter.size > MOST_BYTES_PER_CLIENT or every_bytes + waiter.size > MOST_BYTES):
                raise _busy(
                    f"queries of {own_bytes} bytes of this client and {every_bytes}",
                    f"at most {MOST_BYTES_PER_CLIENT} and {MOST_BYTES}",
                )
            self._waiting[revision].append(waiter)
            self._counts[waiter.client] += 1
            self._bytes[waiter.client] += waiter.size

    def take(self, revision: Revision) -> list[Waiter]:
        """Those who wait for a revision; they do so no longer."""
        with self._lock:
            return self._forget(self._waiting.pop(revision, []))

    def let_go(self, gone: Collection[str]) -> int:
        """Drop queries whose client is gone or whose time is up; return how many these were."""
        now = time.monotonic()
        # Taken out under the lock, answered after it: an answer goes over the network.
        left = self._take_if(lambda waiter: waiter.client in gone)
        late = self._take_if(lambda waiter: waiter.until < now)
        for waiter in left:
            # Closed without a reply: nobody is there to read one.
            with waiter.query:
                pass
        for waiter in late:
            waiter.fail(DeadlineExceeded("no plan yet; the mission is kept, ask again", where=STAGE))
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
            return self._forget(taken)

    def _forget(self, taken: list[Waiter]) -> list[Waiter]:
        for waiter in taken:
            self._counts[waiter.client] -= 1
            self._bytes[waiter.client] -= waiter.size
            if not self._counts[waiter.client]:
                del self._counts[waiter.client], self._bytes[waiter.client]
        return taken


def _busy(waiting: str, accepted: str) -> Busy:
    return Busy(
        f"{waiting} in all wait for plans; expected {accepted}: the mission is kept, ask again later", where=STAGE
    )
