"""Commands forked from a process that has imported what they need: each a process of its own, soon begun.

Run as a script, this is that process. It reads one command a line, as JSON, and writes its exit status.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import pkgutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType

__all__ = ["WarmCommands"]


class WarmCommands:
    """Runs commands one after the other."""

    def __init__(self) -> None:
        self._nursery = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __enter__(self) -> WarmCommands:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._nursery.communicate(timeout=30)

    def run(
        self, arguments: list[str], *, cwd: Path, env: Mapping[str, str], output: Path
    ) -> subprocess.CompletedProcess[str]:
        """Run a command to its end; what it writes goes to files in the folder `output`."""
        asked = {"arguments": arguments, "cwd": str(cwd), "env": dict(env), "output": str(output)}
        assert self._nursery.stdin is not None
        assert self._nursery.stdout is not None
        self._nursery.stdin.write(json.dumps(asked) + "\n")
        self._nursery.stdin.flush()
        status = int(self._nursery.stdout.readline())
        told = [(output / name).read_text() for name in ("stdout", "stderr")]
        return subprocess.CompletedProcess(arguments, status, *told)


def _imported() -> None:
    """All that commands import; what they do is left to them."""
    import oxbow_cli

    for module in pkgutil.iter_modules(oxbow_cli.__path__):
        if module.name != "__main__":
            importlib.import_module(f"oxbow_cli.{module.name}")
    # What is here is no garbage of a command: none need look through it, and copy it.
    gc.freeze()


def _become(arguments: list[str], cwd: str, env: dict[str, str], output: str) -> None:
    """Turn this process into that of a command."""
    from oxbow_cli.__main__ import main

    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        path, flags = (os.devnull, os.O_RDONLY) if number == 0 else (f"{output}/{name}", os.O_WRONLY | os.O_CREAT)
        opened = os.open(path, flags | os.O_TRUNC if number else flags, 0o600)
        os.dup2(opened, number)
        os.close(opened)
    sys.argv = ["oxbow", *arguments]
    main()


def _nursery() -> None:
    """Fork a command for each line, and tell how it ended."""
    _imported()
    lines = sys.stdin.buffer
    while line := lines.readline():
        asked = json.loads(line)
        if (pid := os.fork()) == 0:
            _become(**asked)
            return
        ended = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        print(ended, flush=True)


if __name__ == "__main__":
    _nursery()
