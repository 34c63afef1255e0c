"""Shares among clients: whoever had least recently is next, however much the others ask for."""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from oxbow.errors import Busy

__all__ = ["FairQueue", "Order", "Turns"]

T = TypeVar("T")

HALF_LIFE_S = 60.0
"""The time after which what a client had counts half."""
MOST_KNOWN = 10_000
LOOK_S = 0.5
"""How often those who wait for a turn check whether there is more room."""


@dataclass
class _Use:
    """When a client was served last, in turns, and how many seconds it had by a moment (`time.monotonic`)."""

    turn: int = 0
    seconds: float = 0.0
    at_s: float = 0.0

    def recent_s(self, now_s: float) -> float:
        """The seconds that it had; those of long ago hardly count."""
        return self.seconds * math.exp2((self.at_s - now_s) / HALF_LIFE_S)


class Order:
    """Who is to be served next; not safe between threads without a lock of its owner's."""

    def __init__(self) -> None:
        self._turns = itertools.count(1)
        self._uses: dict[str, _Use] = {}

    def next(self, clients: Iterable[str]) -> str:
        """Which of `clients` had the fewest seconds recently; among equals, the one served longest ago."""
        now_s = time.monotonic()

        def had(client: str) -> tuple[float, int]:
            use = self._uses.get(client, _Use())
            # Rounded, so that clients that had about the same take turns.
            return round(use.recent_s(now_s), 1), use.turn

        return min(clients, key=had)

    def note(self, client: str, seconds: float = 0.0) -> None:
        """Note that a client is served now, or that it has been served.

        Parameters
        ----------
        client
            Its name.
        seconds
            How long it was served; 0 at the beginning.
        """
        # A client's seconds fade as time goes by: they are kept as of the moment when they were last counted.
        use, now_s = self._uses.pop(client, _Use()), time.monotonic()
        # Popped and put back at the end: the first in the dictionary is then the one noted longest ago.
        self._uses[client] = _Use(next(self._turns), use.recent_s(now_s) + seconds, now_s)
        if len(self._uses) > MOST_KNOWN:  # who is forgotten is served as someone new
            self._uses.pop(next(iter(self._uses)))


@dataclass
class _Row(Generic[T]):
    """What one client has waiting."""

    items: deque[tuple[T, int]] = field(default_factory=deque)
    size: int = 0


class FairQueue(Generic[T]):
    """Items of clients, to be taken in turn.

    Parameters
    ----------
    most_items
        What one client may have waiting.
    most_bytes
        What all of them may have waiting, and one of them half of. An item that is larger waits alone.
    """

    def __init__(self, *, most_items: int, most_bytes: int) -> None:
        self.most_items = most_items
        self.most_bytes = most_bytes
        self._changed = threading.Condition()
        self._rows: dict[str, _Row[T]] = {}
        self._order = Order()
        self._closed = False

    def put(self, client: str, item: T, size: int) -> None:
        """Add an item.

        Parameters
        ----------
        client
            Whose it is.
        item
            What to add.
        size
            Its size in bytes.

        Raises
        ------
        Busy
            There is no room for it.
        """
        with self._changed:
            row = self._rows.get(client, _Row())
            self._require_room(row, size)
            row.items.append((item, size))
            row.size += size
            self._rows[client] = row
            self._changed.notify()

    def _require_room(self, row: _Row[T], size: int) -> None:
        every = sum(each.size for each in self._rows.values())
        # An item larger than all the room there is would never be taken: it is, once nothing else waits.
        is_room = not every or every + size <= self.most_bytes
        is_own_room = not row.size or row.size + size <= self.most_bytes // 2
        if len(row.items) >= self.most_items or not (is_room and is_own_room):
            raise Busy(
                f"{len(row.items)} requests and {row.size} bytes of this client, {every} bytes in all wait to be"
                f" read; expected at most {self.most_items}, {self.most_bytes // 2} and {self.most_bytes}",
                where="mission",
            )

    def get(self) -> T | None:
        """Wait for the next item; None once the queue is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._rows)
            if self._closed:
                return None
            client = self._order.next(self._rows)
            self._order.note(client)
            row = self._rows[client]
            item, size = row.items.popleft()
            row.size -= size
            if not row.items:
                del self._rows[client]
            return item

    def drop(self, client: str) -> list[T]:
        """Take out all items of a client."""
        with self._changed:
            return [item for item, _ in self._rows.pop(client, _Row()).items]

    def close(self) -> None:
        """Give out nothing more: every `get` returns None from now on."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()


class Turns:
    """Lets a limited number use something at a time, the clients in turn.

    Parameters
    ----------
    room
        How many may use the thing of this name; the number may change.
    """

    def __init__(self, room: Callable[[str], int]) -> None:
        self._room = room
        self._changed = threading.Condition()
        self._busy: defaultdict[str, int] = defaultdict(int)
        self._waiting: defaultdict[str, list[str]] = defaultdict(list)
        self._orders: defaultdict[str, Order] = defaultdict(Order)

    @contextmanager
    def turn(self, what: str, client: str, is_over: Callable[[], bool]) -> Iterator[bool]:
        """Wait for a turn, and have it while the context lasts.

        Parameters
        ----------
        what
            The name of what is used.
        client
            Who uses it.
        is_over
            Whether to wait no longer, asked at least every half second.

        Yields
        ------
        bool
            Whether there was a turn; False where `is_over` came first.
        """
        granted = self._acquire(what, client, is_over)
        started = time.monotonic()
        try:
            yield granted
        finally:
            if granted:
                with self._changed:
                    self._busy[what] -= 1
                    self._orders[what].note(client, time.monotonic() - started)
                    self._changed.notify_all()

    def _acquire(self, what: str, client: str, is_over: Callable[[], bool]) -> bool:
        with self._changed:
            waiting, order = self._waiting[what], self._orders[what]
            waiting.append(client)
            try:
                while not is_over():
                    if self._busy[what] < max(1, self._room(what)) and order.next(waiting) == client:
                        self._busy[what] += 1
                        order.note(client)  # at once, so that its next request comes after the others'
                        return True
                    # Not notified when `is_over` changes or when replicas come and go: hence a look now and then.
                    self._changed.wait(LOOK_S)
            finally:
                waiting.remove(client)
                self._changed.notify_all()
        return False
