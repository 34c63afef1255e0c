"""Processes for the tests of the mission service."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

__all__ = ["STAGES", "START_S", "Process", "end", "launch"]

Process = subprocess.Popen[bytes]
START_S = 30.0
STAGES = str(Path(__file__).with_name("trivial_stages.py"))
"""The script of the trivial stages."""


def launch(*arguments: str) -> Process:
    return subprocess.Popen([sys.executable, *arguments, "--parent", str(os.getpid())])


def end(process: Process) -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    process.wait(10.0)
