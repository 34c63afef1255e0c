"""Shares among clients: whoever was served longest ago is next, however much the others ask for."""

from __future__ import annotations

import itertools
import threading
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Generic, TypeVar

from oxbow.errors import Busy

__all__ = ["FairQueue", "Order", "Turns"]

T = TypeVar("T")

LOOK_S = 0.5
"""How often those who wait for a turn look whether there is more room."""


class Order:
    """Who was served when; not safe between threads by itself."""

    def __init__(self) -> None:
        self._turns = itertools.count(1)
        self._served: dict[str, int] = {}

    def next(self, clients: Iterable[str]) -> str:
        """Which of `clients` was served longest ago; the first of those who never were."""
        return min(clients, key=lambda client: self._served.get(client, 0))

    def note(self, client: str) -> None:
        """Note that a client is served."""
        self._served.pop(client, None)
        self._served[client] = next(self._turns)
        if len(self._served) > 10_000:  # forgotten clients are served as new ones
            self._served.pop(next(iter(self._served)))


class FairQueue(Generic[T]):
    """Items of clients, to be taken in turn.

    Parameters
    ----------
    most_items, most_bytes
        What one client may have waiting, and what all of them may.
    """

    def __init__(self, *, most_items: int, most_bytes: int) -> None:
        self.most_items = most_items
        self.most_bytes = most_bytes
        self._changed = threading.Condition()
        self._items: defaultdict[str, deque[tuple[T, int]]] = defaultdict(deque)
        self._bytes = 0
        self._order = Order()
        self._closed = False

    def put(self, client: str, item: T, size: int) -> None:
        """Add an item of so many bytes; `Busy` where there is no room for it."""
        with self._changed:
            waiting = len(self._items[client]) if client in self._items else 0
            if waiting >= self.most_items or (self._bytes and self._bytes + size > self.most_bytes):
                raise Busy(
                    f"{waiting} requests of this client and {self._bytes} bytes wait to be read; expected at most"
                    f" {self.most_items} and {self.most_bytes}: try again later",
                    where="mission",
                )
            self._items[client].append((item, size))
            self._bytes += size
            self._changed.notify()

    def get(self) -> T | None:
        """Wait for the next item; None once the queue is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._items)
            if self._closed:
                return None
            client = self._order.next(self._items)
            self._order.note(client)
            item, size = self._items[client].popleft()
            if not self._items[client]:
                del self._items[client]
            self._bytes -= size
            return item

    def drop(self, client: str) -> list[T]:
        """Take out all items of a client."""
        with self._changed:
            dropped = self._items.pop(client, deque())
            self._bytes -= sum(size for _, size in dropped)
            return [item for item, _ in dropped]

    def close(self) -> None:
        """Give out no more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()


class Turns:
    """Lets so many at a time use something, the clients in turn.

    Parameters
    ----------
    room
        How many may use what is named, which may change.
    """

    def __init__(self, room: Callable[[str], int]) -> None:
        self._room = room
        self._changed = threading.Condition()
        self._busy: defaultdict[str, int] = defaultdict(int)
        self._waiting: defaultdict[str, list[str]] = defaultdict(list)
        self._orders: defaultdict[str, Order] = defaultdict(Order)

    @contextmanager
    def turn(self, what: str, client: str, is_over: Callable[[], bool]) -> Iterator[bool]:
        """Wait for a turn, and have it while the context lasts; False where `is_over` before there was one."""
        granted = self._acquire(what, client, is_over)
        try:
            yield granted
        finally:
            if granted:
                with self._changed:
                    self._busy[what] -= 1
                    self._changed.notify_all()

    def _acquire(self, what: str, client: str, is_over: Callable[[], bool]) -> bool:
        with self._changed:
            waiting, order = self._waiting[what], self._orders[what]
            waiting.append(client)
            try:
                while not is_over():
                    if self._busy[what] < max(1, self._room(what)) and order.next(waiting) == client:
                        self._busy[what] += 1
                        order.note(client)
                        return True
                    self._changed.wait(LOOK_S)
            finally:
                waiting.remove(client)
                self._changed.notify_all()
        return False
