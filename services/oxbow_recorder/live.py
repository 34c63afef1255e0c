"""A server for viewers that watch while missions are planned."""

from __future__ import annotations

import logging
import socket

import rerun as rr

__all__ = ["serve"]

_log = logging.getLogger("oxbow_recorder")

MEMORY_LIMIT = "256MiB"


def serve(port: int) -> str:
    """Serve live viewers on loopback; on another port where this one is taken.

    Returns
    -------
    str
        The address to give to a viewer: ``rerun ADDRESS``.
    """
    if not _is_free(port):
        _log.warning("port %d is taken; viewers are served on another", port)
        port = _free_port()
    address = rr.RecordingStream("oxbow").serve_grpc(grpc_port=port, server_memory_limit=MEMORY_LIMIT)
    _log.info("watch live with: rerun %s", address)
    return address


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
