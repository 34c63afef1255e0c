"""What the recorder reports about itself, as a stage does: ``@ping``, ``@info`` and ``@stats``."""

from __future__ import annotations

import importlib.metadata
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import msgspec

from oxbow.bus import Session
from oxbow.contracts import introspection_key
from oxbow.wire.introspection import Info, Ping, Stats, rss_bytes

__all__ = ["SERVICE", "Counts", "answer_introspection"]

SERVICE = "recorder"


@dataclass(frozen=True)
class Counts:
    """Runs whose recordings were finished, runs that are being recorded, and the processes that write."""

    finished: int
    open: int
    writers: tuple[int, ...]


def answer_introspection(session: Session, instance: str, counts: Callable[[], Counts]) -> None:
    """Answer for this process on the bus.

    Parameters
    ----------
    session
        The bus.
    instance
        The name to answer under.
    counts
        Gives the present figures.
    """
    started_s = time.time()

    def ping() -> Ping:
        return Ping(stage=SERVICE, instance=instance, pid=os.getpid(), uptime_s=time.time() - started_s)

    def info() -> Info:
        return Info(
            stage=SERVICE,
            instance=instance,
            version=importlib.metadata.version("oxbow"),
            handler="oxbow_recorder",
            started_s=started_s,
            worker_pid=os.getpid(),
        )

    # Stages report calls here; of a recorder, recordings are counted, and durations would mean nothing.
    def stats() -> Stats:
        now = counts()
        return Stats(
            stage=SERVICE,
            instance=instance,
            served=now.finished,
            failed=0,
            busy=0,
            queued=now.open,
            mean_s=0.0,
            p95_s=0.0,
            worker_restarts=0,
            session_rss_bytes=rss_bytes(os.getpid()),
            worker_rss_bytes=sum(map(rss_bytes, now.writers)),
        )

    answers: dict[str, Callable[[], msgspec.Struct]] = {"ping": ping, "info": info, "stats": stats}
    # Sessions answer for several keys at once: the key that was asked says which figure is wanted.
    own_keys = {what: introspection_key(SERVICE, instance, what) for what in answers}

    def answer(key: str, _parameters: dict[str, str], _payload: bytes) -> Iterator[tuple[str, bytes]]:
        what = key.rpartition("@")[2]
        yield own_keys[what], msgspec.json.encode(answers[what]())

    session.answer(own_keys.values(), answer)
