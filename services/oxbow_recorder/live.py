"""The process that serves viewers, as the recorder sees it."""

from __future__ import annotations

import logging
import os
import socket
import subprocess
import sys
import time

from oxbow.runtime.closing import Closing

__all__ = ["LiveServer"]

END_S = 2.0
PAUSE_S = 5.0
"""The least time between two starts."""

_log = logging.getLogger("oxbow_recorder")


class LiveServer(Closing):
    """Serves viewers on loopback; on another port where the one given is taken.

    Attributes
    ----------
    address
        What to give to a viewer: ``rerun ADDRESS``.
    """

    def __init__(self, port: int) -> None:
        if not _is_free(port):
            _log.warning("port %d is taken; viewers are served on another", port)
            port = _free_port()
        self.address = f"rerun+http://127.0.0.1:{port}/proxy"
        self._command = [sys.executable, "-m", "oxbow_recorder.viewers", str(port), str(os.getpid())]
        self.process = self._launch()

    def revive(self) -> None:
        """Start it again where it has ended, some time after the last start."""
        if self.process.poll() is not None and time.monotonic() - self._started > PAUSE_S:
            _log.error("the server for viewers ended with status %d; restarting it", self.process.returncode)
            self.process = self._launch()

    def close(self) -> None:
        """End the server."""
        self.process.terminate()
        try:
            self.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def _launch(self) -> subprocess.Popen[bytes]:
        self._started = time.monotonic()
        _log.info("watch live with: rerun %s", self.address)
        return subprocess.Popen(self._command, stdin=subprocess.DEVNULL, stdout=2)


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        # As servers do: a port on which old connections are only timing out counts as free.
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
