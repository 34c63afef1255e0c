"""Everything the mission service must not forget of its missions: requests, revisions and plans.

A change that a method makes is on the disk when the method returns (WAL, synchronous=FULL), so a process
killed at any moment loses nothing that it had announced.
"""

from __future__ import annotations

import logging
import sqlite3
import time
from collections.abc import Iterable, Iterator

import msgspec

from oxbow.contracts import MissionState, MissionStatus, checked_id
from oxbow.errors import ErrorCode, ErrorReply, Internal, InvalidRequest, OxbowError
from oxbow_mission.database import Database
from oxbow_mission.revision import QueuedMission, Request, Revision

__all__ = ["Store"]

_log = logging.getLogger(__name__)

_STATUS = "mission_id, revision, state, error, changed_s"
_LATEST = "revision = (SELECT max(revision) FROM revision AS other WHERE other.mission_id = revision.mission_id)"

# A mission's revisions are planned one after another, each once the outcome of the one before is announced:
# otherwise an old plan could be published after a newer one.
_WAITING = """
state = 'accepted' AND NOT announced AND NOT EXISTS (
    SELECT 1 FROM revision AS earlier
    WHERE earlier.mission_id = revision.mission_id AND earlier.revision < revision.revision
    AND NOT earlier.announced
)
"""


class Store:
    """Missions and their revisions; safe to share between threads, not between processes.

    Parameters
    ----------
    database
        Where they are kept. What was being planned by a process that died is `accepted` again, and what can be
        neither planned nor named on the bus is set aside.
    """

    def __init__(self, database: Database) -> None:
        self.database = database
        with self.database.transaction() as db:
            _set_aside_unfit(db)
            db.execute("UPDATE revision SET state = 'accepted' WHERE state = 'planning'")

    # ----------------------------------------------------------------- requests

    def accept(self, mission_id: str, request: Request, client: str = "") -> MissionStatus:
        """Keep a request, as a new revision unless the mission's latest one is the same and can still be of use.

        A revision that failed for want of a stage, time or luck may well succeed now, so it is asked for anew; one
        that is invalid or infeasible would fail again.

        Parameters
        ----------
        mission_id
            The mission's id.
        request
            What to plan, and how.
        client
            Who handed it in; empty where nobody is named.

        Returns
        -------
        MissionStatus
            That of the new revision, or of the one that is the same.
        """
        checked_id(mission_id)
        with self.database.transaction() as db:
            # What is asked now is compared with the latest revision only: an older one that was replaced is
            # wanted anew.
            latest = db.execute(
                f"SELECT {_STATUS}, fingerprint FROM revision WHERE mission_id = ? AND {_LATEST}",
                (mission_id,),
            ).fetchone()
            # The same again, as after a lost reply: whoever sends twice gets one plan.
            if latest is not None and latest["fingerprint"] == request.fingerprint:
                known = next(_statuses([latest]), None)
                if known is not None and _is_settled(known):
                    return known
            # A new revision, numbered on from the latest; one transaction, so that two senders never get one
            # number.
            now_s = time.time()
            row = db.execute(
                "INSERT INTO revision (mission_id, revision, client, state, changed_s, accepted_s,"
                f" fingerprint, parameters, document) VALUES (?, ?, ?, 'accepted', ?, ?, ?, ?, ?)"
                f" RETURNING {_STATUS}",
                (
                    mission_id,
                    latest["revision"] + 1 if latest else 1,
                    client,
                    now_s,
                    now_s,
                    request.fingerprint,
                    request.parameters,
                    request.document,
                ),
            ).fetchone()
        return _status(row)

    def knows(self, mission_id: str) -> bool:
        """Whether a mission of this id was accepted."""
        with self.database.reading() as db:
            found = db.execute("SELECT 1 FROM revision WHERE mission_id = ? LIMIT 1", (mission_id,)).fetchone()
        return found is not None

    # ----------------------------------------------------------------- planning

    def waiting_clients(self) -> list[str]:
        """Whose revisions could be planned now, who has waited longest first."""
        with self.database.reading() as db:
            rows = db.execute(
                f"SELECT client FROM revision WHERE {_WAITING} GROUP BY client ORDER BY min(rowid)"
            ).fetchall()
        return [row["client"] for row in rows]

    def claim(self, client: str | None = None) -> QueuedMission | None:
        """Take the oldest accepted revision, of one client or of all, for planning; None where nothing waits."""
        with self.database.transaction() as db:
            row = db.execute(
                "UPDATE revision SET state = 'planning', changed_s = ? WHERE rowid = ("
                f"SELECT rowid FROM revision WHERE client = coalesce(?, client) AND {_WAITING}"
                " ORDER BY rowid LIMIT 1)"
                " RETURNING mission_id, revision, client, document, parameters, fingerprint",
                (time.time(), client),
            ).fetchone()
        if row is None:
            return None
        request = Request(row["document"], row["parameters"], row["fingerprint"])
        return QueuedMission(Revision(row["mission_id"], row["revision"]), request, row["client"])

    def finish(self, revision: Revision, plan: bytes) -> MissionStatus:
        """Keep the plan of a claimed revision, and return its status.

        Parameters
        ----------
        revision
            The revision.
        plan
            The completed Mission File.

        Returns
        -------
        MissionStatus
            That of the revision, done and not announced yet.

        Raises
        ------
        Internal
            It is not being planned.
        """
        return self._settle(revision, MissionState.DONE, plan=plan)

    def fail(self, revision: Revision, error: OxbowError) -> MissionStatus:
        """Keep why a revision has no plan, and return its status.

        Parameters
        ----------
        revision
            The revision, which waits or is being planned.
        error
            The reason.

        Returns
        -------
        MissionStatus
            That of the revision, failed and not announced yet.

        Raises
        ------
        Internal
            It neither waits nor is being planned.
        """
        return self._settle(revision, MissionState.FAILED, error=error)

    def release(self, revision: Revision) -> MissionStatus:
        """Give a claimed revision back unplanned, for another time."""
        return self._settle(revision, MissionState.ACCEPTED)

    def note_death(self, revision: Revision) -> int:
        """Note that the process that planned a revision died of it; how many have by now."""
        with self.database.transaction() as db:
            row = db.execute(
                "UPDATE revision SET attempts = attempts + 1 WHERE mission_id = ? AND revision = ?"
                " RETURNING attempts",
                (revision.mission_id, revision.number),
            ).fetchone()
        return 0 if row is None else int(row["attempts"])

    def _settle(
        self,
        revision: Revision,
        state: MissionState,
        *,
        plan: bytes | None = None,
        error: OxbowError | None = None,
    ) -> MissionStatus:
        # A revision may be cancelled while it waits; only one that is being planned can be done or released.
        origins = ("planning", "accepted" if state is MissionState.FAILED else "planning")
        with self.database.transaction() as db:
            row = db.execute(
                "UPDATE revision SET state = ?, plan = ?, error = ?, changed_s = ?"
                f" WHERE mission_id = ? AND revision = ? AND state IN (?, ?) RETURNING {_STATUS}",
                (state, plan, _error_json(error), time.time(), revision.mission_id, revision.number, *origins),
            ).fetchone()
        if row is None:
            raise Internal("is not being planned", where=str(revision))
        return _status(row)

    # ----------------------------------------------------------------- announcing

    def unannounced(self) -> list[MissionStatus]:
        """The outcomes that may not have been published, oldest first."""
        with self.database.reading() as db:
            rows = db.execute(
                f"SELECT {_STATUS} FROM revision WHERE NOT announced AND state IN ('done', 'failed')"
                " ORDER BY rowid"
            ).fetchall()
        return list(_statuses(rows))

    def mark_announced(self, revision: Revision) -> None:
        """Note that an outcome was published."""
        with self.database.transaction() as db:
            db.execute(
                "UPDATE revision SET announced = TRUE WHERE mission_id = ? AND revision = ?",
                (revision.mission_id, revision.number),
            )

    # ----------------------------------------------------------------- asking

    def statuses(self, mission_id: str | None = None) -> list[MissionStatus]:
        """The status of the latest revision of one mission, or of all; empty where there is none."""
        with self.database.reading() as db:
            rows = db.execute(
                f"SELECT {_STATUS} FROM revision WHERE {_LATEST} AND mission_id = coalesce(?, mission_id)"
                " ORDER BY rowid",
                (mission_id,),
            ).fetchall()
        return list(_statuses(rows))

    def status(self, revision: Revision) -> MissionStatus:
        """The status of one revision that exists."""
        with self.database.reading() as db:
            row = db.execute(
                f"SELECT {_STATUS} FROM revision WHERE mission_id = ? AND revision = ?",
                (revision.mission_id, revision.number),
            ).fetchone()
        return _status(row)

    def waiting(self) -> int:
        """How many revisions wait to be planned."""
        with self.database.reading() as db:
            row = db.execute("SELECT count(*) FROM revision WHERE state = 'accepted' AND NOT announced")
            return int(row.fetchone()[0])

    def open_revisions(self, mission_id: str) -> list[Revision]:
        """The revisions of a mission that wait or are being planned, in order."""
        with self.database.reading() as db:
            rows = db.execute(
                "SELECT mission_id, revision FROM revision WHERE mission_id = ?"
                " AND state IN ('accepted', 'planning') ORDER BY revision",
                (mission_id,),
            ).fetchall()
        return [Revision(*row) for row in rows]

    def planned(self, mission_id: str | None = None) -> list[Revision]:
        """The revisions that have a plan, by mission and number; those of one mission where given."""
        with self.database.reading() as db:
            rows = db.execute(
                "SELECT mission_id, revision FROM revision WHERE state = 'done'"
                " AND mission_id = coalesce(?, mission_id) ORDER BY mission_id, revision",
                (mission_id,),
            ).fetchall()
        return [Revision(*row) for row in rows if _fits(row["mission_id"])]

    def plan(self, revision: Revision) -> bytes:
        """The completed Mission File (JSON) of a revision that is done."""
        with self.database.reading() as db:
            row: dict[str, bytes] = db.execute(
                "SELECT plan FROM revision WHERE mission_id = ? AND revision = ?",
                (revision.mission_id, revision.number),
            ).fetchone()
        return row["plan"]


def _set_aside_unfit(db: sqlite3.Connection) -> None:
    """Fail missions whose id cannot stand in a key: their outcome could not be published."""
    cause = InvalidRequest("cannot be a key on the bus", where="id")
    for (mission_id,) in db.execute("SELECT DISTINCT mission_id FROM revision WHERE NOT announced").fetchall():
        if not _fits(mission_id):
            _log.error("mission %.200r is set aside: its id cannot be a key on the bus", mission_id)
            db.execute(
                "UPDATE revision SET state = 'failed', error = ?, announced = TRUE"
                " WHERE mission_id = ? AND NOT announced",
                (_error_json(cause), mission_id),
            )


def _fits(mission_id: str) -> bool:
    """Whether a mission's id can stand in a key."""
    try:
        checked_id(mission_id)
    except InvalidRequest:
        return False
    return True


def _is_settled(status: MissionStatus) -> bool:
    """Whether asking again for the same would change nothing."""
    return status.error is None or status.error.code in (
        ErrorCode.INVALID_MISSION,
        ErrorCode.INVALID_REQUEST,
        ErrorCode.INFEASIBLE,
    )


def _statuses(rows: Iterable[sqlite3.Row]) -> Iterator[MissionStatus]:
    """The statuses of rows; one that cannot be read is logged, and hides no other."""
    for row in rows:
        try:
            yield _status(row)
        except (ValueError, OxbowError) as error:
            _log.error(
                "mission %.200r, revision %s: passed over: %.300s", row["mission_id"], row["revision"], error
            )


def _status(row: sqlite3.Row) -> MissionStatus:
    state = MissionState(row["state"])
    return MissionStatus(
        mission_id=checked_id(row["mission_id"]),
        revision=row["revision"],
        state=state,
        fraction=1.0 if state is MissionState.DONE else 0.0,
        error=None if row["error"] is None else msgspec.json.decode(row["error"], type=ErrorReply),
        time_s=row["changed_s"],
    )


def _error_json(error: OxbowError | None) -> str | None:
    return None if error is None else msgspec.json.encode(ErrorReply.of(error)).decode()
