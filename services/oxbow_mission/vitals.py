"""What the mission service reports about itself, as a stage does: ``@ping``, ``@info`` and ``@stats``."""

from __future__ import annotations

import importlib.metadata
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from statistics import fmean, quantiles

import msgspec

from oxbow.bus import Session
from oxbow.contracts import introspection_key
from oxbow.wire.introspection import Info, Ping, Stats, rss_bytes

__all__ = ["Vitals"]

SERVICE = "mission"


class Vitals:
    """Counts runs of the pipeline, and answers for the process.

    Parameters
    ----------
    bus
        Where to answer.
    instance
        The name to answer under.
    waiting
        Gives the number of missions that wait for a planner.
    """

    def __init__(self, bus: Session, instance: str, waiting: Callable[[], int]) -> None:
        self.instance = instance
        self.started_s = time.time()
        self._waiting = waiting
        self._lock = threading.Lock()
        self._served = self._failed = 0
        self._seconds: deque[float] = deque(maxlen=1000)
        answers = {"ping": self._ping, "info": self._info, "stats": self._stats}
        self._answers = {introspection_key(SERVICE, instance, what): answer for what, answer in answers.items()}
        bus.answer(self._answers, self._answer)

    def count(self, seconds: float, *, failed: bool) -> None:
        """Note that a run is over.

        Parameters
        ----------
        seconds
            How long it took.
        failed
            Whether it ended without a plan.
        """
        with self._lock:
            self._served += 1
            self._failed += failed
            self._seconds.append(seconds)

    def _answer(self, key: str, _parameters: dict[str, str], _payload: bytes) -> Iterator[tuple[str, bytes]]:
        what = key.rpartition("@")[2]
        for own_key, answer in self._answers.items():
            if own_key.endswith(f"@{what}"):
                yield own_key, msgspec.json.encode(answer())

    def _ping(self) -> Ping:
        uptime_s = time.time() - self.started_s
        return Ping(stage=SERVICE, instance=self.instance, pid=os.getpid(), uptime_s=uptime_s)

    def _info(self) -> Info:
        return Info(
            stage=SERVICE,
            instance=self.instance,
            version=importlib.metadata.version("oxbow"),
            handler="oxbow_mission",
            started_s=self.started_s,
            worker_pid=os.getpid(),
        )

    def _stats(self) -> Stats:
        with self._lock:
            seconds, served, failed = list(self._seconds), self._served, self._failed
        return Stats(
            stage=SERVICE,
            instance=self.instance,
            served=served,
            failed=failed,
            busy=0,
            queued=self._waiting(),
            mean_s=fmean(seconds) if seconds else 0.0,
            p95_s=quantiles(seconds, n=20, method="inclusive")[-1] if len(seconds) > 1 else sum(seconds),
            worker_restarts=0,
            session_rss_bytes=rss_bytes(os.getpid()),
            worker_rss_bytes=0,
        )
