"""What a session declares on the bus, until it is taken back."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol

import zenoh

from oxbow.bus.mailbox import Mailbox

__all__ = ["Audience", "Declared", "OnQuery", "OnSample", "Subscription"]

OnSample = Callable[[str, bytes], None]
"""Called with a sample's key and payload."""

OnQuery = Callable[[str, dict[str, str], bytes], Iterable[tuple[str, bytes]]]
"""Called with a query's key, parameters and payload; gives replies, each a key and a payload."""


class Declared(Protocol):
    """Something declared on the bus, which can be taken back."""

    def undeclare(self) -> Any: ...


class Subscription:
    """Something that receives until it is closed."""

    def __init__(self, declared: Iterable[Declared], mailbox: Mailbox[Any]) -> None:
        self._declared = tuple(declared)
        self._mailbox = mailbox

    @property
    def closed(self) -> bool:
        return not self._declared

    def close(self) -> None:
        """Receive nothing more, and return when all that had been received is dealt with."""
        # Swapped first: a second call finds nothing to undeclare, and zenoh raises where something is undeclared
        # twice.
        declared, self._declared = self._declared, ()
        for each in declared:
            each.undeclare()
        # Only now, so that no sample finds the mailbox closed.
        self._mailbox.close()


class Audience:
    """Whether anyone listens to keys that match an expression."""

    def __init__(self, publisher: zenoh.Publisher) -> None:
        self._publisher = publisher

    def __bool__(self) -> bool:
        return bool(self._publisher.matching_status.matching)  # type: ignore[attr-defined]
