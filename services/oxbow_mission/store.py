"""Everything the mission service must not forget: requests, revisions, plans and reports, in one SQLite file.

A change that a method makes is on the disk when the method returns (WAL, synchronous=FULL), so a process
killed at any moment loses nothing that it had told anyone.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import sqlite3
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from oxbow.closing import Closing
from oxbow.contracts import MissionState, MissionStatus
from oxbow.errors import ErrorCode, ErrorReply, Internal, OxbowError, Unavailable

__all__ = ["Job", "Request", "Revision", "Store"]

SCHEMA_VERSION = 1
MAX_ATTEMPTS = 10
"""A revision that was being planned at so many deaths of the service is taken for their cause, and fails."""

_SCHEMA = f"""
BEGIN;
CREATE TABLE revision (
    mission_id TEXT NOT NULL,
    revision INTEGER NOT NULL,
    state TEXT NOT NULL,
    attempts INTEGER NOT NULL DEFAULT 0,
    announced INTEGER NOT NULL DEFAULT FALSE,
    error TEXT,
    changed_s REAL NOT NULL,
    accepted_s REAL NOT NULL,
    fingerprint TEXT NOT NULL,
    parameters BLOB NOT NULL,
    document BLOB NOT NULL,
    plan BLOB,
    PRIMARY KEY (mission_id, revision)
) STRICT;
CREATE INDEX unannounced ON revision (state) WHERE NOT announced;
CREATE TABLE report (
    mission_id TEXT NOT NULL,
    received_s REAL NOT NULL,
    payload BLOB NOT NULL
) STRICT;
CREATE INDEX report_of_mission ON report (mission_id);
PRAGMA user_version = {SCHEMA_VERSION};
COMMIT;
"""

_STATUS = "mission_id, revision, state, error, changed_s"
_LATEST = "revision = (SELECT max(revision) FROM revision AS other WHERE other.mission_id = revision.mission_id)"

# A mission's revisions are planned one after another, each once the outcome of the one before is announced:
# otherwise an old plan could be published after a newer one.
_NEXT = """
SELECT rowid FROM revision AS next WHERE state = 'accepted' AND NOT announced AND NOT EXISTS (
    SELECT 1 FROM revision AS earlier
    WHERE earlier.mission_id = next.mission_id AND earlier.revision < next.revision AND NOT earlier.announced
) ORDER BY rowid LIMIT 1
"""


@dataclass(frozen=True)
class Request:
    """What is asked for one mission, in JSON; requests with the same `fingerprint` ask for the same plan."""

    document: bytes
    parameters: bytes
    fingerprint: str


@dataclass(frozen=True)
class Revision:
    """Which revision of which mission; `number` counts from 1."""

    mission_id: str
    number: int

    @classmethod
    def of(cls, status: MissionStatus) -> Revision:
        return cls(status.mission_id, status.revision)


@dataclass(frozen=True)
class Job:
    """A revision claimed for planning."""

    revision: Revision
    request: Request


class Store(Closing):
    """Missions and their revisions; safe to share between threads, not between processes.

    Parameters
    ----------
    home
        The folder of the store, made where it is missing. One process at a time holds it, until it closes the
        store or dies: what was being planned by a process that died is `accepted` again.

    Raises
    ------
    Unavailable
        Another process holds the folder, it was written by another version, or it cannot be written.
    """

    def __init__(self, home: Path) -> None:
        self.path = home / "missions.sqlite3"
        self._mutex = threading.RLock()
        with contextlib.ExitStack() as stack:
            try:
                home.mkdir(parents=True, exist_ok=True)
                self._lock = stack.enter_context((home / "missions.lock").open("a+"))
                self._hold(home)
                self._db = stack.enter_context(
                    contextlib.closing(sqlite3.connect(self.path, check_same_thread=False))
                )
                self._set_up()
                self._resume()
            except (OSError, sqlite3.Error) as error:
                raise Unavailable(f"cannot keep missions: {error}", where=str(home)) from error
            self._stack = stack.pop_all()

    def _hold(self, home: Path) -> None:
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            self._lock.seek(0)
            holder = self._lock.read().strip() or "unknown"
            raise Unavailable(
                f"is in use by the mission service with process id {holder}; stop it, or choose another folder",
                where=str(home),
            ) from error
        self._lock.truncate(0)
        self._lock.write(f"{os.getpid()}\n")
        self._lock.flush()

    def _set_up(self) -> None:
        self._db.row_factory = sqlite3.Row
        self._db.execute("PRAGMA journal_mode = WAL")
        self._db.execute("PRAGMA synchronous = FULL")
        version = self._db.execute("PRAGMA user_version").fetchone()[0]
        if version == 0:
            self._db.executescript(_SCHEMA)
        elif version != SCHEMA_VERSION:
            raise Unavailable(f"has schema {version}; this version reads {SCHEMA_VERSION}", where=str(self.path))

    def close(self) -> None:
        """Let another process have the folder."""
        with self._mutex:
            self._stack.close()

    # ----------------------------------------------------------------- requests

    def accept(self, mission_id: str, request: Request) -> MissionStatus:
        """Keep a request, as a new revision unless the mission's latest one is the same and can still be of use.

        A revision that failed for want of a stage, time or luck may well succeed now, so it is asked for anew; one
        that is invalid or infeasible would fail again.
        """
        return self._add(mission_id, request, MissionState.ACCEPTED, None)

    def refuse(self, mission_id: str, fingerprint: str, error: OxbowError) -> MissionStatus:
        """Keep, as a failed revision, that a request was invalid."""
        request = Request(b"", b"", fingerprint)
        return self._add(mission_id, request, MissionState.FAILED, error)

    def _add(
        self, mission_id: str, request: Request, state: MissionState, error: OxbowError | None
    ) -> MissionStatus:
        with self._transaction() as db:
            latest = db.execute(
                f"SELECT {_STATUS}, fingerprint FROM revision WHERE mission_id = ? AND {_LATEST}",
                (mission_id,),
            ).fetchone()
            if latest is not None and latest["fingerprint"] == request.fingerprint and _is_settled(latest):
                return _status(latest)
            now_s = time.time()
            row = db.execute(
                "INSERT INTO revision (mission_id, revision, state, error, changed_s, accepted_s,"
                f" fingerprint, parameters, document) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?) RETURNING {_STATUS}",
                (
                    mission_id,
                    latest["revision"] + 1 if latest else 1,
                    state,
                    _error_json(error),
                    now_s,
                    now_s,
                    request.fingerprint,
                    request.parameters,
                    request.document,
                ),
            ).fetchone()
            return _status(row)

    # ----------------------------------------------------------------- planning

    def claim(self) -> Job | None:
        """Take the oldest accepted revision for planning, or None where nothing waits."""
        with self._transaction() as db:
            row = db.execute(
                f"UPDATE revision SET state = 'planning', attempts = attempts + 1, changed_s = ?"
                f" WHERE rowid = ({_NEXT}) RETURNING mission_id, revision, document, parameters, fingerprint",
                (time.time(),),
            ).fetchone()
        if row is None:
            return None
        request = Request(row["document"], row["parameters"], row["fingerprint"])
        return Job(Revision(row["mission_id"], row["revision"]), request)

    def finish(self, revision: Revision, plan: bytes) -> MissionStatus:
        """Keep the plan of a claimed revision."""
        return self._settle(revision, MissionState.DONE, plan=plan)

    def fail(self, revision: Revision, error: OxbowError) -> MissionStatus:
        """Keep why a claimed revision has no plan."""
        return self._settle(revision, MissionState.FAILED, error=error)

    def release(self, revision: Revision) -> MissionStatus:
        """Give a claimed revision back unplanned, for another time."""
        return self._settle(revision, MissionState.ACCEPTED)

    def _settle(
        self,
        revision: Revision,
        state: MissionState,
        *,
        plan: bytes | None = None,
        error: OxbowError | None = None,
    ) -> MissionStatus:
        with self._transaction() as db:
            row = db.execute(
                "UPDATE revision SET state = ?, plan = ?, error = ?, changed_s = ?,"
                " attempts = attempts - (? = 'accepted')"
                f" WHERE mission_id = ? AND revision = ? AND state = 'planning' RETURNING {_STATUS}",
                (state, plan, _error_json(error), time.time(), state, revision.mission_id, revision.number),
            ).fetchone()
        if row is None:
            raise Internal(
                "is not being planned", where=f"mission {revision.mission_id}, revision {revision.number}"
            )
        return _status(row)

    def _resume(self) -> None:
        cause = Internal(f"the mission service died {MAX_ATTEMPTS} times while it planned this")
        with self._transaction() as db:
            db.execute(
                "UPDATE revision SET state = 'failed', error = ?, changed_s = ? WHERE state = 'planning'"
                " AND attempts >= ?",
                (_error_json(cause), time.time(), MAX_ATTEMPTS),
            )
            db.execute("UPDATE revision SET state = 'accepted' WHERE state = 'planning'")

    # ----------------------------------------------------------------- announcing

    def unannounced(self) -> list[MissionStatus]:
        """The outcomes that the world may not have heard of, oldest first."""
        with self._mutex:
            rows = self._db.execute(
                f"SELECT {_STATUS} FROM revision WHERE NOT announced AND state IN ('done', 'failed')"
                " ORDER BY rowid"
            ).fetchall()
        return [_status(row) for row in rows]

    def mark_announced(self, revision: Revision) -> None:
        """Note that an outcome was published."""
        with self._transaction() as db:
            db.execute(
                "UPDATE revision SET announced = TRUE WHERE mission_id = ? AND revision = ?",
                (revision.mission_id, revision.number),
            )

    # ----------------------------------------------------------------- asking

    def statuses(self, mission_id: str | None = None) -> list[MissionStatus]:
        """The status of the latest revision of one mission, or of all; empty where there is none."""
        with self._mutex:
            rows = self._db.execute(
                f"SELECT {_STATUS} FROM revision WHERE {_LATEST} AND mission_id = coalesce(?, mission_id)"
                " ORDER BY rowid",
                (mission_id,),
            ).fetchall()
        return [_status(row) for row in rows]

    def status(self, revision: Revision) -> MissionStatus:
        """The status of one revision that exists."""
        with self._mutex:
            row = self._db.execute(
                f"SELECT {_STATUS} FROM revision WHERE mission_id = ? AND revision = ?",
                (revision.mission_id, revision.number),
            ).fetchone()
        return _status(row)

    def waiting(self) -> int:
        """How many revisions wait to be planned."""
        with self._mutex:
            row = self._db.execute("SELECT count(*) FROM revision WHERE state = 'accepted' AND NOT announced")
            return int(row.fetchone()[0])

    def planned(self, mission_id: str | None = None) -> list[Revision]:
        """The revisions that have a plan, by mission and number; those of one mission where given."""
        with self._mutex:
            rows = self._db.execute(
                "SELECT mission_id, revision FROM revision WHERE state = 'done'"
                " AND mission_id = coalesce(?, mission_id) ORDER BY mission_id, revision",
                (mission_id,),
            ).fetchall()
        return [Revision(*row) for row in rows]

    def plan(self, revision: Revision) -> bytes:
        """The completed Mission File (JSON) of a revision that is done."""
        with self._mutex:
            row: dict[str, bytes] = self._db.execute(
                "SELECT plan FROM revision WHERE mission_id = ? AND revision = ?",
                (revision.mission_id, revision.number),
            ).fetchone()
        return row["plan"]

    # ----------------------------------------------------------------- reports

    def add_report(self, mission_id: str, payload: bytes) -> None:
        """Keep what guidance reports of a mission, as it came."""
        with self._transaction() as db:
            db.execute("INSERT INTO report VALUES (?, ?, ?)", (mission_id, time.time(), payload))

    def reports(self, mission_id: str) -> list[bytes]:
        """The reports of a mission, oldest first."""
        with self._mutex:
            rows = self._db.execute(
                "SELECT payload FROM report WHERE mission_id = ? ORDER BY rowid", (mission_id,)
            ).fetchall()
        return [row["payload"] for row in rows]

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._mutex, self._db:
            yield self._db


def _is_settled(row: sqlite3.Row) -> bool:
    """Whether asking again for the same would change nothing."""
    if row["state"] != MissionState.FAILED:
        return True
    return msgspec.json.decode(row["error"], type=ErrorReply).code in (
        ErrorCode.INVALID_MISSION,
        ErrorCode.INFEASIBLE,
    )


def _status(row: sqlite3.Row) -> MissionStatus:
    state = MissionState(row["state"])
    return MissionStatus(
        mission_id=row["mission_id"],
        revision=row["revision"],
        state=state,
        fraction=1.0 if state is MissionState.DONE else 0.0,
        error=None if row["error"] is None else msgspec.json.decode(row["error"], type=ErrorReply),
        time_s=row["changed_s"],
    )


def _error_json(error: OxbowError | None) -> str | None:
    return None if error is None else msgspec.json.encode(ErrorReply.of(error)).decode()
