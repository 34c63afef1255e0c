"""Processes for the tests of the mission service."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

from tests.support.project import ROOT

__all__ = ["STAGES", "START_S", "Process", "end", "launch"]

Process = subprocess.Popen[bytes]
START_S = 30.0
STAGES = ("-m", "tests.support.trivial_stages")


def launch(*arguments: str) -> Process:
    """Start a module or a script, which ends when this process does."""
    command = [sys.executable, *arguments, "--parent", str(os.getpid())]
    return subprocess.Popen(command, env={**os.environ, "PYTHONPATH": str(ROOT)})


def end(process: Process) -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    process.wait(10.0)
