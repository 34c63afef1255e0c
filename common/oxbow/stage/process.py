"""The worker process of a stage: it guards itself first, and only then loads what the handler needs.

``python -m oxbow.stage.process FD ENDPOINT HANDLER INSTANCE MEMORY_MB``, started by `oxbow.stage.worker`.
"""

from __future__ import annotations

import ctypes
import logging
import os
import resource
import select
import signal
import sys
import threading
from multiprocessing.connection import Connection

__all__ = ["guard", "main"]

_PR_SET_PDEATHSIG = 1


def main(argv: list[str]) -> None:
    """Serve jobs until the session process closes the pipe or dies."""
    fd, endpoint, handler, instance, memory_mb = argv
    guard(int(fd), int(memory_mb))

    from oxbow.stage.jobs import serve  # noqa: PLC0415 - brings numpy, shapely and the handler, under the limit

    serve(Connection(int(fd)), endpoint, handler, instance, int(memory_mb))


def guard(fd: int, memory_mb: int) -> None:
    """Prepare a process that works for the one at the other end of a pipe.

    Parameters
    ----------
    fd
        The pipe: when it is hung up, this process ends.
    memory_mb
        What this process may take.
    """
    # Signals to the process group are the other process's business: it drains, then closes the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    _end_with_parent(fd)
    _limit_memory(memory_mb)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s %(name)s: %(message)s")


def _end_with_parent(fd: int) -> None:
    """End this process, whatever it is working on, when the session process is gone.

    A process that is stopped runs no thread; on Linux the kernel kills it. That happens at the end of the thread
    which started this process too: by then the session process takes no more requests.
    """
    # First the thread: a parent that dies before the call below sends no signal any more, but does hang up.
    threading.Thread(target=_exit_at_hang_up, args=(fd,), name="hang-up", daemon=True).start()
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _exit_at_hang_up(fd: int) -> None:
    poll = select.poll()
    poll.register(fd, 0)  # a hang-up is reported unasked; data is not waited for, which others read
    poll.poll()
    os._exit(0)


def _limit_memory(memory_mb: int) -> None:
    """Limit the memory of this process's own: code, mapped files and reserved addresses do not count."""
    # Not RLIMIT_AS: thread stacks and libraries reserve gigabytes of addresses which they never touch.
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = memory_mb * 2**20
    resource.setrlimit(
        resource.RLIMIT_DATA, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard)
    )


if __name__ == "__main__":
    main(sys.argv[1:])
