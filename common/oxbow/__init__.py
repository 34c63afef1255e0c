"""Oxbow plans coverage missions for survey boats.

`Client` is what a decision-support system or a vehicle's guidance talks to Oxbow with.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from oxbow.client import Client

__all__ = ["Client"]


def __getattr__(name: str) -> Any:
    # The client needs the contracts, which bring numpy and shapely: a process that imports one light module of
    # this package does not pay for them.
    if name == "Client":
        from oxbow.client import Client  # noqa: PLC0415

        return Client
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
