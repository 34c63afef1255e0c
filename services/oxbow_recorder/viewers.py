"""A server for viewers that watch while missions are planned: a process of its own, since it imports rerun.

``python -m oxbow_recorder.viewers PORT PARENT``
"""

from __future__ import annotations

import sys

import rerun as rr

from oxbow.runtime.lifetime import Lifetime

__all__ = ["main"]

MEMORY_LIMIT = "256MiB"


def main(argv: list[str]) -> None:
    """Serve viewers on a port until asked to end."""
    port, parent = map(int, argv)
    lifetime = Lifetime(parent)
    stream = rr.RecordingStream("oxbow")
    stream.serve_grpc(grpc_port=port, server_memory_limit=MEMORY_LIMIT)
    lifetime.wait()
    stream.disconnect()


if __name__ == "__main__":
    main(sys.argv[1:])
