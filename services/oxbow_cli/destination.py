"""Where a command writes: checked before the work begins, and replaced safely when it is done."""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from oxbow.errors import InvalidOption
from oxbow.mission.files import write_atomically
from oxbow_cli.interrupts import ending

__all__ = ["Destination", "writing"]


@dataclass(frozen=True)
class Destination:
    """A file to write, and a digest of its former content; None if there was no such file."""

    path: Path
    digest: bytes | None

    @classmethod
    def of(cls, path: Path, *, inputs: Iterable[Path | None] = ()) -> Destination:
        """A file that can be written, as far as this can be known in advance.

        Parameters
        ----------
        path
            The file.
        inputs
            Other files that the command reads or writes, and that must not be overwritten; None is skipped.

        Returns
        -------
        Destination
            With the digest of the file as it is now, by which `keep` knows whether another program has changed it.

        Raises
        ------
        InvalidOption
            It is a folder or not a regular file, is write-protected or one of the `inputs`, or its folder is
            missing or not writable.
        """
        with writing(path):
            for other in inputs:
                if other is not None and _same(path, other):
                    raise InvalidOption(
                        f"is also {str(other)!r}, which this command reads or writes; expected another file",
                        where=str(path),
                    )
            _require_place(path)
            return cls(path, _digest(path))

    def write(self, data: bytes) -> None:
        """Replace the file as a whole, or leave it as it was.

        Raises
        ------
        InvalidOption
            It cannot be written.
        """
        with writing(self.path), ending.holding_signals():
            write_atomically(self.path, data)

    def keep(self, data: bytes) -> None:
        """Write what must not be lost; if that fails or would undo another's change, write it beside the file.

        Raises
        ------
        InvalidOption
            The data is kept elsewhere; the error says why, and where.
        """
        with ending.holding_signals():
            self._keep(data)

    def _keep(self, data: bytes) -> None:
        try:
            if _digest(self.path) == self.digest:
                write_atomically(self.path, data)
                return
            problem = "was changed in the meantime, and is left as it is"
        except OSError as error:
            problem = f"cannot be written: {error.strerror or error}"
        kept = _kept_elsewhere(self.path, data)
        where = "could not be kept anywhere" if kept is None else f"is kept in {str(kept)!r}"
        raise InvalidOption(f"{problem}; the plan {where}", where=str(self.path))


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Report a file that cannot be written as invalid input."""
    try:
        yield
    except OSError as error:
        raise InvalidOption(f"cannot be written: {error.strerror or error}", where=str(path)) from error
    except RuntimeError as error:  # raised by `Path.resolve` for a loop of links
        raise InvalidOption("cannot be written: its symbolic links form a loop", str(path)) from error


def _same(path: Path, other: Path) -> bool:
    # By inode where both exist: hard links, and file systems that ignore case, have several names for one file.
    if path.exists() and other.exists():
        return path.samefile(other)
    return os.path.realpath(path) == os.path.realpath(other)


def _require_place(path: Path) -> None:
    target = path.resolve()
    if target.is_dir():
        raise InvalidOption("cannot be written: is a folder; expected the name of a file", where=str(path))
    if not target.parent.is_dir():
        raise InvalidOption(f"cannot be written: the folder {str(path.parent)!r} does not exist", where=str(path))
    if target.exists():
        mode = target.stat().st_mode
        if not stat.S_ISREG(mode):
            raise InvalidOption("cannot be written: is not a regular file", where=str(path))
        if not (mode & 0o222 and os.access(target, os.W_OK)):
            raise InvalidOption("cannot be written: is write-protected", where=str(path))
    # Permission bits are not enough: a file system may be read-only. An atomic write makes a new file in the same
    # folder, so that is what is tried.
    try:
        with tempfile.TemporaryFile(dir=target.parent):
            pass
    except OSError as error:
        raise InvalidOption(
            f"cannot be written: the folder {str(path.parent)!r} cannot be written to ({error.strerror})",
            where=str(path),
        ) from error


def _digest(path: Path) -> bytes | None:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").digest()
    except FileNotFoundError:
        return None


def _kept_elsewhere(path: Path, data: bytes) -> Path | None:
    """Write data to a new file beside another, or else to the temporary folder; None if neither is possible."""
    for folder in (path.parent, Path(tempfile.gettempdir())):
        with suppress(OSError):
            return _written_anew(folder, path, data)
    return None


def _written_anew(folder: Path, path: Path, data: bytes) -> Path:
    """A new file with the data, named after another; nothing is left of it if it cannot be written."""
    for number in count(1):
        kept = folder / f"{path.stem}.planned{'' if number == 1 else f'-{number}'}{path.suffix}"
        # Tried rather than looked up: another command may take the name between the look and the creation.
        with suppress(FileExistsError):
            with kept.open("xb"):  # reserves the name, even against another command
                pass
            break
    try:
        write_atomically(kept, data)
    except OSError:
        kept.unlink(missing_ok=True)
        raise
    return kept
