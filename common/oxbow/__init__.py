"""Oxbow plans coverage missions for survey boats.

`Client` is what a decision-support system or a vehicle's guidance talks to Oxbow with.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from oxbow.client import Client

__all__ = ["Client"]


def __getattr__(name: str) -> Any:
    # Importing any module of this package runs this one first, also in the router and in the session processes of
    # the stages, which only forward bytes. The client brings numpy and shapely, and would cost each of them
    # another 0.1 s of processor time at its start, and 18 MB.
    if name == "Client":
        from oxbow.client import Client  # noqa: PLC0415

        return Client
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
