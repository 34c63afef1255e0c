"""Reports of guidance: only of missions that are known, and within bounds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from oxbow.errors import InvalidRequest
from oxbow_mission import reports as bounds
from oxbow_mission.database import Database
from oxbow_mission.reports import Reports
from oxbow_mission.revision import Request
from oxbow_mission.schema import SCHEMA
from oxbow_mission.store import Store

REQUEST = Request(document=b"a", parameters=b"{}", fingerprint="print of a")


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with Database(tmp_path, SCHEMA) as opened:
        for mission_id in ("lake", "sea"):
            Store(opened).accept(mission_id, REQUEST)
        yield opened


def test_reports_are_kept_in_order(database: Database) -> None:
    reports = Reports(database, Store(database))
    for mission_id, payload in (("lake", b"1"), ("sea", b"3"), ("lake", b"2")):
        reports.add(mission_id, payload)
    assert reports.of("lake") == [b"1", b"2"]


def test_nothing_is_kept_of_a_mission_that_is_not_known(database: Database) -> None:
    reports = Reports(database, Store(database))
    with pytest.raises(InvalidRequest, match="pond: is not kept here"):
        reports.add("pond", b"1")
    assert reports.of("pond") == []


def test_what_is_beyond_a_bound_is_refused_and_the_bound_is_named(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, most in (("MOST_REPORT_BYTES", 4), ("MOST_MISSION_BYTES", 6), ("MOST_BYTES", 9)):
        monkeypatch.setattr(bounds, name, most)
    Reports(database, Store(database)).add("lake", b"1234")
    reports = Reports(database, Store(database))  # what is kept already counts
    with pytest.raises(InvalidRequest, match="a report to have at most 4"):
        reports.add("sea", b"12345")
    with pytest.raises(InvalidRequest, match="all reports of a mission to have at most 6"):
        reports.add("lake", b"123")
    reports.add("sea", b"1234")
    with pytest.raises(InvalidRequest, match="is 2 bytes, 8 are kept; expected all reports to have at most 9"):
        reports.add("sea", b"12")
    assert reports.of("lake") + reports.of("sea") == [b"1234", b"1234"]
