"""Finds processes that exist but do nothing: stopped ones, and ones that answer no ping.

A process that hangs may keep its token on the bus, so that callers go on sending requests to it: it must be
killed.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec

from oxbow.bus import Session
from oxbow.contracts import any_introspection_key, introspection_key
from oxbow.errors import OxbowError, Unavailable
from oxbow.runtime.closing import Closing
from oxbow.wire.introspection import Ping, Supervised, Supervision
from oxbow_cli.supervisor import Child

__all__ = ["Health", "StoppedProcess", "stopped_processes"]

PERIOD_S = 0.5
"""The pause between rounds of pings."""

ANSWER_S = 1.5
"""How long a round waits for answers."""

SILENT_S = 3.5
"""How long a process may be silent: the one that answers pings does little else, and so is never busy."""

BUSY_S = 20.0
"""The same for a process that uses the processor: its results should not be lost."""

START_S = 30.0
"""How long a process may take to answer its first ping."""

HANDLES_TO_JOIN = 16
"""File handles that it takes to join a router, with some to spare."""

_BUSY_SHARE = 0.1
"""A process that uses less than this fraction of a processor does nothing."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Silence:
    """How long a process has been silent, and the processor time that it had used before."""

    lasted_s: float
    used_before_s: float


class Health(Closing):
    """Watches over the processes of a stack, and reports their state on the bus (``@processes``).

    Parameters
    ----------
    endpoint
        The bus that the processes are on.
    router
        The router: it answers no pings, but without it nothing else is heard.
    services
        The processes that answer pings.

    Attributes
    ----------
    answering
        IDs of the processes that answered the last pings.
    """

    def __init__(self, endpoint: str, router: Child, services: Sequence[Child]) -> None:
        self._endpoint = endpoint
        self._session: Session | None = None
        self._router = router
        self._services = services
        self._own_key = introspection_key("supervisor", str(os.getpid()), "processes")
        self.answering: frozenset[int] = frozenset()
        self._known: set[int] = set()
        self._silences: dict[int, _Silence] = {}
        self._asked_at = time.monotonic()

    def close(self) -> None:
        """Leave the bus, until `ask` joins it again."""
        if self._session is not None:
            self._session.close()
            self._session = None

    def ask(self) -> None:
        """Ping all processes, and replace those that have been silent for too long."""
        asked = {child.pid: child for child in self._services if child.runs()}
        answered = self._answered()
        self.answering = frozenset(answered or ())
        if answered is None:
            silent = {self._router.pid: self._router}
        else:
            # A process that has not answered yet may still be starting: it counts as silent only after `START_S`.
            self._known = (self._known | answered) & asked.keys()
            silent = {
                pid: child
                for pid, child in asked.items()
                if pid not in answered and (pid in self._known or child.age_s() > START_S)
            }
        # All silences first, then the killing: to end a process takes time that must not count as another's
        # silence.
        self._note(silent)
        for pid, child in silent.items():
            # The other thread may have replaced the process meanwhile: the new one is not to blame.
            if self._is_hung(pid) and child.pid == pid:
                child.replace(f"has not answered for {self._silences[pid].lasted_s:.1f} s")

    def _answered(self) -> set[int] | None:
        """IDs of the processes that answer; None if the router cannot be joined."""
        if self._session is not None and (answered := _pings(self._session)):
            return answered
        # A session may not have noticed yet that its router is gone, or may be what is at fault.
        self.close()
        try:
            self._session = Session.connect(self._endpoint, timeout_s=ANSWER_S)
        except Unavailable:
            _require_handles()
            return None
        self._session.answer(self._own_key, self._report)
        return _pings(self._session)

    def _report(self, _key: str, _parameters: dict[str, str], _payload: bytes) -> Iterator[tuple[str, bytes]]:
        processes = tuple(
            Supervised(name=child.name, pid=child.pid, starts=child.starts, trouble=self._trouble(child))
            for child in (self._router, *self._services)
        )
        report = Supervision(instance=str(os.getpid()), processes=processes)
        yield self._own_key, msgspec.json.encode(report)

    def _trouble(self, child: Child) -> str:
        silence = self._silences.get(child.pid)
        return child.trouble or (f"has not answered for {silence.lasted_s:.1f} s" if silence else "")

    def _note(self, silent: dict[int, Child]) -> None:
        """Add this round to the silences; time in which nothing was pinged does not count."""
        now = time.monotonic()
        # This process may have been held up itself: a round counts for no longer than it can last.
        round_s = min(now - self._asked_at, PERIOD_S + ANSWER_S)
        self._asked_at = now
        begun = {pid: _Silence(0.0, _used_s(pid)) for pid in silent} | self._silences
        self._silences = {pid: _Silence(begun[pid].lasted_s + round_s, begun[pid].used_before_s) for pid in silent}

    def _is_hung(self, pid: int) -> bool:
        silence = self._silences[pid]
        # Since the silence began: a process that computes may answer late, one that hangs uses nothing.
        used_s = _used_s(pid) - silence.used_before_s
        is_busy = used_s > _BUSY_SHARE * silence.lasted_s
        return silence.lasted_s >= (BUSY_S if is_busy else SILENT_S)

    def look(self) -> None:
        """Kill what is stopped, as by SIGSTOP: a child, or a process that a child has started.

        No terminal stops them, since their sessions have none; a process that a debugger holds does not count.
        """
        leaders = {child.pid: child for child in (self._router, *self._services)}
        for each in stopped_processes():
            if each.session in leaders:
                _kill(each, leaders[each.session])


def _pings(session: Session) -> set[int]:
    """IDs of the processes that answer; empty if the query fails."""
    key = any_introspection_key("ping")
    try:
        replies = session.query(key, timeout_s=ANSWER_S, all_targets=True, may_be_empty=True)
    except OxbowError:
        return set()
    pids = set()
    for _key, payload in replies:
        with suppress(msgspec.DecodeError):  # any program on the bus may answer, in any form
            pids.add(msgspec.json.decode(payload, type=Ping).pid)
    return pids


def _require_handles() -> None:
    """Raise `OSError` if this process has too few handles left to join: then the router is not to blame."""
    with ExitStack() as held:
        for _ in range(HANDLES_TO_JOIN):
            held.enter_context(socket.socket())


def _kill(stopped: StoppedProcess, leader: Child) -> None:
    if stopped.pid == leader.pid:
        leader.replace("is stopped")
        return
    _log.warning("%s: its process %d is stopped; killing it", leader.name, stopped.pid)
    with suppress(ProcessLookupError):
        os.kill(stopped.pid, signal.SIGKILL)


@dataclass(frozen=True)
class StoppedProcess:
    """A process that is stopped, and the session that it belongs to."""

    pid: int
    session: int


def stopped_processes() -> Iterator[StoppedProcess]:
    """All stopped processes of this machine; none where there is no ``/proc``."""
    for file in Path("/proc").glob("[0-9]*/stat"):
        fields = _fields(file)
        if fields and fields[0] == "T":
            yield StoppedProcess(pid=int(file.parent.name), session=int(fields[3]))


def _used_s(pid: int) -> float:
    """Processor time that a process has used, in seconds; 0 if it is unknown."""
    fields = _fields(Path(f"/proc/{pid}/stat"))
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def _fields(stat: Path) -> list[str]:
    """The fields after the name in ``/proc/PID/stat``: state, parent, group, session, ...; none if it is gone."""
    try:
        # The last bracket closes the name, which may contain brackets and blanks itself.
        return stat.read_text().rpartition(")")[2].split()
    except OSError:
        return []
