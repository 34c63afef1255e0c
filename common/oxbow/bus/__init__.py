"""The bus between Oxbow's processes, and the only code that knows Zenoh.

`Bus` is what callers and services use; `oxbow.stage` serves a stage. See `docs/bus.md` for the keys.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from oxbow.bus.config import DEFAULT_ENDPOINT
from oxbow.bus.session import Session
from oxbow.bus.subscription import Subscription
from oxbow.wire.envelope import Envelope

if TYPE_CHECKING:
    from oxbow.bus.client import Bus, BusCall

__all__ = ["DEFAULT_ENDPOINT", "Bus", "BusCall", "Envelope", "Session", "Subscription"]


def __getattr__(name: str) -> Any:
    # Calls need the contracts, which bring numpy and shapely: a process that only forwards bytes goes without.
    if name in ("Bus", "BusCall"):
        from oxbow.bus import client  # noqa: PLC0415

        return getattr(client, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
