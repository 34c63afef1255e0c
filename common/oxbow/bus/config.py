"""Zenoh settings of a client and of the router, each with the reason for it."""

from __future__ import annotations

import json
import re
from typing import Any

import zenoh

from oxbow.errors import InvalidOption

__all__ = ["DEFAULT_ENDPOINT", "client_config", "require_endpoint", "router_config"]

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
_ENDPOINT = re.compile(r"[a-z][a-z0-9_-]*/\S+")

_COMMON: dict[str, Any] = {
    # Processes meet at the router they are given, and nowhere else.
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    # Shared memory loses queries of 3 KB and more in zenoh 1.10.
    "transport/shared_memory/enabled": False,
    # A frozen process is noticed after two seconds instead of ten.
    "transport/link/tx/lease": 2000,
}


def client_config(endpoint: str, timeout_s: float) -> zenoh.Config:
    """Settings of a process that joins a router, and joins again when the router comes back.

    Parameters
    ----------
    endpoint
        Where the router listens.
    timeout_s
        Seconds to try for the first connection.

    Returns
    -------
    zenoh.Config
        For `zenoh.open`, which may change it: one for each session.

    Raises
    ------
    InvalidOption
        The endpoint is not of the form PROTOCOL/ADDRESS.
    """
    require_endpoint(endpoint)
    return _config(
        {
            "mode": "client",
            "connect/endpoints": [endpoint],
            "connect/timeout_ms": round(1000 * timeout_s),
            "connect/retry": {"period_init_ms": 50, "period_max_ms": 200, "period_increase_factor": 2},
        }
    )


def router_config(endpoint: str) -> zenoh.Config:
    """Settings of the router that listens at `endpoint`."""
    require_endpoint(endpoint)
    return _config({"mode": "router", "listen/endpoints": [endpoint], "scouting/delay": 0})


def require_endpoint(endpoint: str, where: str = "endpoint") -> None:
    """Check that an endpoint has a protocol and an address.

    Parameters
    ----------
    endpoint
        What to check.
    where
        What an error calls it.

    Raises
    ------
    InvalidOption
        It has not.
    """
    if not _ENDPOINT.fullmatch(endpoint):
        raise InvalidOption(f"is {endpoint!r}; expected PROTOCOL/ADDRESS, such as {DEFAULT_ENDPOINT}", where=where)


def _config(settings: dict[str, Any]) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in {**_COMMON, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return config
