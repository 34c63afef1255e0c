"""Processes for the tests of the bus: started with their parent's id, ended by their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import psutil

from tests.support.project import ROOT

__all__ = ["Replica", "end", "launch", "run_python", "wait_gone", "wait_until"]

Replica = subprocess.Popen[bytes]


def launch(endpoint: str, instance: str, *options: str, stderr: int | None = None) -> Replica:
    """Start a replica of the echo stage."""
    options = ("--parent", str(os.getpid()), *options)
    return subprocess.Popen(
        [
            sys.executable,
            "-m",
            "tests.support.echo_stage",
            "--connect",
            endpoint,
            "--instance",
            instance,
            *options,
        ],
        stderr=stderr,
        env=_environment(),
    )


def run_python(code: str, *arguments: str) -> Replica:
    """Start a small program; its output can be read."""
    return subprocess.Popen([sys.executable, "-c", code, *arguments], stdout=subprocess.PIPE, env=_environment())


def end(process: Replica) -> None:
    """End a process whatever state a test left it in."""
    if process.poll() is None:
        process.terminate()
        process.send_signal(signal.SIGCONT)
        try:
            process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def wait_gone(pid: int) -> None:
    wait_until(lambda: not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)


def wait_until(condition: Callable[[], object], timeout_s: float = 20.0) -> None:
    give_up = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < give_up, "waited in vain"
        time.sleep(0.01)


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT)}
