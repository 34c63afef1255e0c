"""The SQLite file of the missions: held by one process, checked as it is opened, and watched while it is open."""

from __future__ import annotations

import contextlib
import fcntl
import os
import sqlite3
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from oxbow.errors import Internal, Unavailable
from oxbow.runtime.closing import Closing

__all__ = ["Database", "Schema"]

_MAGIC = b"SQLite format 3\0"
_DAMAGED = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


@dataclass(frozen=True)
class Schema:
    """The tables of a new file, and how an older one is brought up to date.

    Parameters
    ----------
    version
        The file's ``user_version``.
    script
        Makes the tables.
    upgrades
        The script that leads from each older version to the next one.
    """

    version: int
    script: str
    upgrades: dict[int, str]


class Database(Closing):
    """One connection, shared by all threads of this process.

    What was acknowledged is in this file, so it must not be lost in silence: a file that was removed, replaced,
    cut or overwritten under this process is noticed before the next access, and one that is gone or empty,
    although missions had been kept in this folder, is not replaced by a new one.

    Parameters
    ----------
    home
        The folder, made where it is missing.
    schema
        What the file has to hold.
    on_lost
        Called when the file is found to be no longer what it was; from then on every access fails.

    Raises
    ------
    Unavailable
        Another process holds the folder, the file is gone, damaged, foreign or of another version, or the folder
        cannot be written. Nothing is changed then.
    """

    def __init__(self, home: Path, schema: Schema, on_lost: Callable[[], None] = lambda: None) -> None:
        self.path = home / "missions.sqlite3"
        self.lost = ""
        self._on_lost = on_lost
        self._mutex = threading.RLock()
        self._seen: dict[Path, os.stat_result] = {}
        with contextlib.ExitStack() as stack:
            try:
                home.mkdir(parents=True, exist_ok=True)
                # Appended to, not truncated: until it is held, the process id in it is another's.
                self._lock = stack.enter_context((home / "missions.lock").open("a+"))
                self._hold()
                self._require_there()
                self._db = stack.enter_context(
                    contextlib.closing(sqlite3.connect(self.path, check_same_thread=False))
                )
                self._set_up(schema)
                # Not before: a process id in the lock file means that there is a store, which must not vanish.
                self._mark_held()
                # Remember the files as they are now: later looks compare with this.
                self._changed_by_others()
            except (OSError, sqlite3.Error) as error:
                raise Unavailable(f"cannot keep missions: {error}", where=str(home)) from error
            self._stack = stack.pop_all()

    def close(self) -> None:
        """Let another process have the folder."""
        with self._mutex:
            self._stack.close()

    @contextlib.contextmanager
    def reading(self) -> Iterator[sqlite3.Connection]:
        """The connection, for one thread at a time."""
        with self._mutex:
            self.require_intact()
            try:
                yield self._db
            except sqlite3.DatabaseError as error:
                # Extended codes have the primary one in their lowest byte.
                if error.sqlite_errorcode & 0xFF in _DAMAGED:
                    self._lose(f"{self.path.name} was damaged ({error})")
                raise

    @contextlib.contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """The connection, for changes that are on the disk when the context is left, or not made at all."""
        with self.reading():
            with self._db:  # commits, or rolls back on whatever is raised
                yield self._db
            # What was committed to a file that is gone must not be acknowledged.
            self.require_intact()

    def require_intact(self) -> None:
        """Check that the files are the ones that were opened.

        Raises
        ------
        Internal
            They are not; nothing can be kept any more.
        """
        with self._mutex:
            if not self.lost and (change := self._changed_by_others()):
                self._lose(change)
        if self.lost:
            raise Internal(
                f"{self.lost} while it was in use; the mission service ends, restore the file", str(self.path)
            )

    def _lose(self, change: str) -> None:
        self.lost = change
        self._on_lost()

    # ----------------------------------------------------------------- opening

    def _hold(self) -> None:
        try:
            # The kernel lets go of the lock when its holder dies, however it dies: a file that only names one
            # would go stale.
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            holder = self._noted() or "unknown"
            raise Unavailable(
                f"is in use by the mission service with process id {holder}; stop it, or choose another folder",
                where=str(self.path.parent),
            ) from error

    def _noted(self) -> str:
        """The process id in the lock file: whoever wrote it had set up the database before."""
        self._lock.seek(0)
        return self._lock.read().strip()

    def _mark_held(self) -> None:
        self._lock.truncate(0)
        self._lock.write(f"{os.getpid()}\n")
        self._lock.flush()

    def _require_there(self) -> None:
        if self._noted() and (not self.path.exists() or self.path.stat().st_size == 0):
            raise Unavailable(
                "is gone or empty, although missions had been kept here; restore it, or remove missions.lock to"
                " begin anew",
                where=str(self.path),
            )

    def _set_up(self, schema: Schema) -> None:
        db = self._db
        db.row_factory = sqlite3.Row
        # A file of 0 bytes has version 0 and no tables; any other that has no version of ours is not to be
        # touched.
        version = int(db.execute("PRAGMA user_version").fetchone()[0])
        known = {0, schema.version, *schema.upgrades}
        tables = [name for (name,) in db.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")]
        if version not in known or (version == 0 and tables):
            raise Unavailable(
                f"has schema {version} and {len(tables)} tables; expected a store of missions with schema"
                f" {', '.join(map(str, sorted(known - {0})))}",
                where=str(self.path),
            )
        # A quick check reads every page; it leaves out only the comparison of indexes with their tables.
        damage = str(db.execute("PRAGMA quick_check(1)").fetchone()[0])
        if damage != "ok":
            raise Unavailable(f"is damaged ({damage}); restore it from a copy", where=str(self.path))
        # FULL: what was acknowledged survives a power cut, not just the death of this process.
        db.execute("PRAGMA journal_mode = WAL")
        db.execute("PRAGMA synchronous = FULL")
        while version != schema.version:
            script = schema.upgrades[version] if version else schema.script
            version = version + 1 if version else schema.version
            # In one transaction with its version: a file is never between two schemas.
            db.executescript(f"BEGIN; {script} PRAGMA user_version = {version}; COMMIT;")

    # ----------------------------------------------------------------- watching

    def _changed_by_others(self) -> str:
        """What is wrong with the files; empty where nothing is.

        Neither the database nor its log shrinks or is replaced while a connection is open.
        """
        for path in (self.path, self.path.with_name(f"{self.path.name}-wal")):
            seen = self._seen.get(path)
            try:
                now = path.stat()
            except FileNotFoundError:
                if seen is None and path != self.path:
                    continue  # the log appears with the first change
                return f"{path.name} was removed"
            if seen is not None and (now.st_dev, now.st_ino) != (seen.st_dev, seen.st_ino):
                return f"{path.name} was replaced"
            if seen is not None and now.st_size < seen.st_size:
                return f"{path.name} was cut from {seen.st_size} to {now.st_size} bytes"
            self._seen[path] = now
        return "" if self._begins_well() else f"{self.path.name} was overwritten"

    def _begins_well(self) -> bool:
        with self.path.open("rb") as file:
            return file.read(len(_MAGIC)) == _MAGIC
