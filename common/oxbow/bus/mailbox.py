"""A bounded queue between zenoh's network thread and threads that may take their time."""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

__all__ = ["Mailbox"]

T = TypeVar("T")
_log = logging.getLogger(__name__)


class Mailbox(Generic[T]):
    """Delivers items to `deliver` on its own threads, in order where there is one thread.

    Parameters
    ----------
    name
        For the threads' names and the log.
    deliver
        Called with each item; an exception that it lets out is logged and costs that item only.
    size
        Items that may wait.
    workers
        Threads.
    """

    def __init__(self, name: str, deliver: Callable[[T], None], *, size: int, workers: int = 1) -> None:
        self.name = name
        self._deliver = deliver
        self._items: queue.Queue[T | None] = queue.Queue(size)
        self._closed = threading.Event()
        self._door = threading.Lock()
        # Daemons: a program that forgets to close its bus must still be able to end.
        self._threads = [
            threading.Thread(target=self._run, name=f"{name}-{i}", daemon=True) for i in range(workers)
        ]
        for thread in self._threads:
            thread.start()

    def offer(self, item: T) -> bool:
        """Queue an item without waiting; False where there is no room or the mailbox is closed."""
        # An item that came between the last look and the marks of the end would lie behind these for ever.
        with self._door:
            if self._closed.is_set():
                return False
            try:
                self._items.put_nowait(item)
            except queue.Full:
                return False
            return True

    def __len__(self) -> int:
        return self._items.qsize()

    def close(self) -> None:
        """Accept nothing more, deliver what waits, and end the threads."""
        with self._door:
            if self._closed.is_set():
                return
            self._closed.set()
        # Behind all that waits: a thread that takes the mark ends when that has been delivered.
        for _ in self._threads:
            # May block while the queue is full, until its threads have made room; outside the lock, so that
            # `offer` can refuse.
            self._items.put(None)
        for thread in self._threads:
            if thread is not threading.current_thread():  # an item may close its own mailbox
                thread.join()

    def _run(self) -> None:
        while (item := self._items.get()) is not None:
            try:
                self._deliver(item)
            except BaseException:  # noqa: BLE001 - the adapter at which an item's failure ends
                _log.exception("%s: an item was lost", self.name)
