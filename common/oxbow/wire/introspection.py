"""What a replica of a stage reports about itself, under its instance key (JSON)."""

from __future__ import annotations

import os
from pathlib import Path

import msgspec

__all__ = ["Info", "Ping", "Stats", "Supervised", "Supervision", "rss_bytes"]


class Ping(msgspec.Struct, frozen=True, kw_only=True):
    """Answer to ``@ping``: the session process is awake."""

    stage: str
    instance: str
    pid: int
    uptime_s: float


class Info(msgspec.Struct, frozen=True, kw_only=True):
    """Answer to ``@info``: what this process runs."""

    stage: str
    instance: str
    version: str
    handler: str
    started_s: float
    worker_pid: int


class Stats(msgspec.Struct, frozen=True, kw_only=True):
    """Answer to ``@stats``: counts since the start, and times over the last thousand requests.

    `served` counts all answers except `busy`, `failed` those among them that were errors; `mean_s` and `p95_s` are
    seconds of work in the worker process, without the time in the queue.
    """

    stage: str
    instance: str
    served: int
    failed: int
    busy: int
    queued: int
    mean_s: float
    p95_s: float
    worker_restarts: int
    session_rss_bytes: int
    worker_rss_bytes: int


class Supervised(msgspec.Struct, frozen=True, kw_only=True):
    """A process that is kept running: how often it was started, and what is wrong with it now, if anything."""

    name: str
    pid: int
    starts: int
    trouble: str = ""


class Supervision(msgspec.Struct, frozen=True, kw_only=True):
    """Answer to ``@processes``, from the supervisor that keeps the processes of a stack running."""

    stage: str = "supervisor"
    instance: str
    processes: tuple[Supervised, ...]


def rss_bytes(pid: int) -> int:
    """Resident memory of a process in bytes; 0 where the system does not report it."""
    try:
        # The second field is the resident set; only Linux has the file, and only while the process lives.
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except OSError:
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")
