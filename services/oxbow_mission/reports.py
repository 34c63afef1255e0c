"""What guidance reports of missions under way, kept within bounds."""

from __future__ import annotations

import time
from collections import Counter

from oxbow.errors import InvalidRequest
from oxbow_mission.database import Database
from oxbow_mission.store import Store

__all__ = ["Reports"]

MOST_REPORT_BYTES = 4 * 2**20
MOST_MISSION_BYTES = 64 * 2**20
MOST_BYTES = 2**30


class Reports:
    """The reports of missions that are known, as they came."""

    def __init__(self, database: Database, store: Store) -> None:
        self.database = database
        self.store = store
        with database.reading() as db:
            rows = db.execute("SELECT mission_id, sum(length(payload)) FROM report GROUP BY mission_id")
            self._bytes = Counter[str](dict(row for row in rows))

    def add(self, mission_id: str, payload: bytes) -> None:
        """Keep a report.

        Parameters
        ----------
        mission_id
            The mission that it is about.
        payload
            The report as guidance sent it.

        Raises
        ------
        InvalidRequest
            There is no such mission, or the report is larger than what there is room for; nothing is kept.
        """
        if not self.store.knows(mission_id):
            raise InvalidRequest("is not kept here; expected a mission submitted before", where=mission_id)
        # Counted in memory: to add up the table for every report would take ever longer.
        self._require_room(mission_id, len(payload))
        with self.database.transaction() as db:
            db.execute("INSERT INTO report VALUES (?, ?, ?)", (mission_id, time.time(), payload))
            self._bytes[mission_id] += len(payload)

    def of(self, mission_id: str) -> list[bytes]:
        """The reports of a mission, oldest first."""
        with self.database.reading() as db:
            rows = db.execute(
                "SELECT payload FROM report WHERE mission_id = ? ORDER BY rowid", (mission_id,)
            ).fetchall()
        return [row["payload"] for row in rows]

    def _require_room(self, mission_id: str, size: int) -> None:
        bounds = (
            ("a report", 0, MOST_REPORT_BYTES),
            ("all reports of a mission", self._bytes[mission_id], MOST_MISSION_BYTES),
            ("all reports", self._bytes.total(), MOST_BYTES),
        )
        for what, kept, most in bounds:
            if kept + size > most:
                raise InvalidRequest(
                    f"is {size} bytes, {kept} are kept; expected {what} to have at most {most}", where="report"
                )
