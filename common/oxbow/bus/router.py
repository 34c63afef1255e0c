"""The tiny router process of the embedded stack; a deployment runs `zenohd` in its place.

``python -m oxbow.bus.router --listen tcp/127.0.0.1:7447``
"""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import select
import socket
import subprocess
import sys
from dataclasses import dataclass

import zenoh

from oxbow.bus.config import DEFAULT_ENDPOINT, router_config
from oxbow.errors import OxbowError, Unavailable
from oxbow.runtime.lifetime import Lifetime

__all__ = ["RouterProcess", "free_endpoint", "run_router", "start_router"]

_FREE_PORT = ":0"
_FREE_PORT_TRIES = 5
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RouterProcess:
    """A router that runs, and where."""

    endpoint: str
    process: subprocess.Popen[bytes]


def start_router(listen: str = "tcp/127.0.0.1:0", *, timeout_s: float = 5.0) -> RouterProcess:
    """Start a router process that ends with this one, and return once it listens.

    Parameters
    ----------
    listen
        Port 0 stands for any free port.
    timeout_s
        Seconds until it must listen.

    Returns
    -------
    RouterProcess
        The process, and the endpoint with its actual port.

    Raises
    ------
    Unavailable
        It could not listen there; it says why on stderr.
    """
    # A pipe rather than a look at the port: with port 0 only the router knows which one it has got.
    read_fd, write_fd = os.pipe()
    command = [sys.executable, "-m", __name__, "--listen", listen, "--ready-fd", str(write_fd)]
    process = subprocess.Popen([*command, "--parent", str(os.getpid())], pass_fds=[write_fd], stdout=2)
    os.close(write_fd)  # else the end of the router would not be seen as the end of the pipe
    with os.fdopen(read_fd, "rb") as ready:
        # Readable also where the router has ended: `readline` then returns nothing, at once.
        arrived, _, _ = select.select([ready], [], [], timeout_s)
        endpoint = ready.readline().decode().strip() if arrived else ""
    if not endpoint:
        process.kill()
        process.wait()
        raise Unavailable(f"the router did not come up within {timeout_s:g} s", where=listen)
    return RouterProcess(endpoint, process)


def run_router(listen: str, lifetime: Lifetime, ready_fd: int | None = None) -> None:
    """Route until a lifetime is over.

    Parameters
    ----------
    listen
        Where to listen; port 0 stands for any free port.
    lifetime
        When to end.
    ready_fd
        A file descriptor to write the endpoint to once the router listens, and to close.

    Raises
    ------
    Unavailable
        It cannot listen there.
    """
    session, endpoint = _open(listen)
    with session:
        _log.info("router listens on %s", endpoint)
        if ready_fd is not None:
            # A starter that no longer waits is no reason not to route.
            with os.fdopen(ready_fd, "w") as ready, contextlib.suppress(BrokenPipeError):
                ready.write(endpoint + "\n")
        lifetime.wait()


def _open(listen: str) -> tuple[zenoh.Session, str]:
    tries = _FREE_PORT_TRIES if listen.endswith(_FREE_PORT) else 1
    while True:
        tries -= 1
        endpoint = free_endpoint(listen) if listen.endswith(_FREE_PORT) else listen
        try:
            return zenoh.open(router_config(endpoint)), endpoint
        except zenoh.ZError as error:
            # Another process may have taken the free port in between.
            if tries == 0:
                raise Unavailable(f"the router cannot listen: {error}", where=endpoint) from error


def free_endpoint(listen: str = "tcp/127.0.0.1:0") -> str:
    """`listen` with a port of its host that was free a moment ago in place of 0."""
    address = listen.removesuffix(_FREE_PORT)
    with socket.socket() as probe:
        probe.bind((address.partition("/")[2], 0))
        return f"{address}:{probe.getsockname()[1]}"


def main(argv: list[str] | None = None) -> int:
    """Run the router; the exit status of the process."""
    parser = argparse.ArgumentParser(prog="oxbow.bus.router", description="Route between Oxbow's processes.")
    parser.add_argument("--listen", default=DEFAULT_ENDPOINT, help="port 0: any free port (default: %(default)s)")
    parser.add_argument("--ready-fd", type=int, help="write the endpoint to this file descriptor when it listens")
    parser.add_argument("--parent", type=int, help="end when this parent process has ended")
    options = parser.parse_args(argv)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s %(name)s: %(message)s")
    try:
        run_router(options.listen, Lifetime(options.parent), options.ready_fd)
    except OxbowError as error:
        _log.error("%s", error)
        return 4
    return 0


if __name__ == "__main__":
    sys.exit(main())
