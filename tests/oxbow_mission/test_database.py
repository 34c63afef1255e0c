"""The file of the missions: what is no store is refused unchanged, and what becomes of one in use is noticed."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

from oxbow.errors import Internal, Unavailable
from oxbow_mission.database import Database
from oxbow_mission.revision import Request
from oxbow_mission.schema import SCHEMA
from oxbow_mission.store import Store

REQUEST = Request(document=b"a", parameters=b"{}", fingerprint="print of a")


def file_of(home: Path) -> Path:
    return home / "missions.sqlite3"


def test_one_process_at_a_time(tmp_path: Path) -> None:
    with Database(tmp_path, SCHEMA), pytest.raises(Unavailable, match=f"process id {os.getpid()}"):
        Database(tmp_path, SCHEMA)
    Database(tmp_path, SCHEMA).close()


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(Unavailable, match="cannot keep missions"):
        Database(tmp_path / "file" / "home", SCHEMA)


def of_a_newer_version(path: Path) -> None:
    with sqlite3.connect(path) as db:
        db.execute("CREATE TABLE revision (mission_id TEXT)")
        db.execute("PRAGMA user_version = 99")
    db.close()


def of_somebody_else(path: Path) -> None:
    with sqlite3.connect(path) as db:
        db.execute("CREATE TABLE bookmarks (url TEXT)")
    db.close()


def of_text(path: Path) -> None:
    path.write_bytes(b"no database" * 1000)


def damaged(path: Path) -> None:
    with Database(path.parent, SCHEMA) as database:
        for number in range(200):
            Store(database).accept(f"lake-{number}", REQUEST)
    content = bytearray(path.read_bytes())
    content[4096:12288] = b"\xff" * 8192
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (of_a_newer_version, "schema 99"),
        (of_somebody_else, "expected a store of missions"),
        (of_text, "not a database"),
        (damaged, "is damaged|malformed"),
    ],
)
def test_what_is_no_store_is_refused_and_left_as_it_was(
    tmp_path: Path, make: Callable[[Path], None], message: str
) -> None:
    make(file_of(tmp_path))
    before = file_of(tmp_path).read_bytes()
    with pytest.raises(Unavailable, match=message):
        Database(tmp_path, SCHEMA)
    assert file_of(tmp_path).read_bytes() == before


@pytest.mark.parametrize("harm", [Path.unlink, lambda path: os.truncate(path, 0)])
def test_a_store_that_is_gone_is_not_begun_anew(tmp_path: Path, harm: Callable[[Path], None]) -> None:
    with Database(tmp_path, SCHEMA) as database:
        Store(database).accept("lake", REQUEST)
    harm(file_of(tmp_path))
    with pytest.raises(Unavailable, match="is gone or empty, although missions had been kept here"):
        Database(tmp_path, SCHEMA)
    (tmp_path / "missions.lock").unlink()
    Database(tmp_path, SCHEMA).close()


def replaced(path: Path) -> None:
    shutil.copy(path, path.with_suffix(".copy"))
    path.with_suffix(".copy").replace(path)


def overwritten(path: Path) -> None:
    with path.open("r+b") as file:
        file.write(b"\0" * 4096)


@pytest.mark.parametrize(
    ("harm", "message"),
    [
        (Path.unlink, "missions.sqlite3 was removed"),
        (lambda path: os.truncate(path, 0), "missions.sqlite3 was cut"),
        (lambda path: os.truncate(f"{path}-wal", 0), "missions.sqlite3-wal was cut"),
        (lambda path: Path(f"{path}-wal").unlink(), "missions.sqlite3-wal was removed"),
        (replaced, "missions.sqlite3 was replaced"),
        (overwritten, "missions.sqlite3 was overwritten"),
    ],
)
def test_what_becomes_of_the_file_in_use_is_noticed_before_anything_is_acknowledged(
    tmp_path: Path, harm: Callable[[Path], None], message: str
) -> None:
    lost: list[bool] = []
    with Database(tmp_path, SCHEMA, on_lost=lambda: lost.append(True)) as database:
        store = Store(database)
        store.accept("lake", REQUEST)
        harm(file_of(tmp_path))
        for _ in range(2):
            with pytest.raises(Internal, match=message):
                store.accept("sea", REQUEST)
            with pytest.raises(Internal, match=message):
                store.statuses()
    assert lost == [True]
