"""Children that end, hang, are stopped or cannot be started: looked after, and left without a trace."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import psutil
import pytest

from oxbow.bus import Session
from oxbow.bus.router import free_endpoint
from oxbow.contracts import introspection_key
from oxbow_cli.health import Health, stopped_processes
from oxbow_cli.supervisor import Supervisor

pytestmark = pytest.mark.processes

STRANGE = introspection_key("s", "stranger", "ping")
SLEEPER = ("-c", "import time; time.sleep(600)")
PARENT = ("-c", "import subprocess, sys; subprocess.run(['sleep', '600'])")
DEAF = """
    import os, signal, sys, threading
    import msgspec
    from oxbow.bus import Session
    from oxbow.contracts import introspection_key
    from oxbow.wire.introspection import Ping

    deaf, busy = threading.Event(), threading.Event()
    signal.signal(signal.SIGUSR1, lambda *_: deaf.set())
    signal.signal(signal.SIGUSR2, lambda *_: busy.set())

    def answer(key, parameters, payload):
        if deaf.is_set():
            threading.Event().wait()
        while busy.is_set():
            pass
        ping = Ping(stage="s", instance=sys.argv[2], pid=os.getpid(), uptime_s=1.0)
        yield own_key, msgspec.json.encode(ping)

    own_key = introspection_key("s", sys.argv[2], "ping")
    session = Session.join(sys.argv[1], lambda: False)
    session.answer(own_key, answer)
    while True:
        signal.pause()
"""


def until(condition, timeout_s=30.0):
    give_up = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < give_up
        time.sleep(0.02)


def gone(pid):
    return not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


@pytest.fixture
def supervisor():
    with Supervisor(output=2) as supervisor:
        yield supervisor


def test_an_ended_child_is_started_again_and_what_it_left_is_killed(supervisor):
    child = supervisor.start("parent", PARENT, rank=0)
    supervisor.keep_alive()
    until(lambda: psutil.Process(child.pid).children())
    first, (left,) = child.pid, psutil.Process(child.pid).children()
    left.suspend()
    child.process.kill()
    until(lambda: child.pid != first and gone(left.pid))


def test_a_child_that_ends_at_once_is_not_started_without_pause(supervisor):
    child = supervisor.start("broken", ("-c", "raise SystemExit(3)"), rank=0)
    supervisor.keep_alive()
    until(lambda: child.starts >= 3)
    time.sleep(1.0)
    assert child.starts <= 4, "each pause is twice the one before"


def test_it_survives_that_no_process_can_be_started():
    """With no file handle left, a child that ends cannot be replaced; it is, once there are some."""
    script = """
        import logging, os, resource, time
        from oxbow_cli.supervisor import Supervisor

        logging.basicConfig(format="%(message)s")
        with Supervisor(output=2) as supervisor:
            child = supervisor.start("sleeper", ("-c", "import time; time.sleep(600)"), rank=0)
            supervisor.keep_alive()
            first = child.pid
            limits = resource.getrlimit(resource.RLIMIT_NOFILE)
            resource.setrlimit(resource.RLIMIT_NOFILE, (3, limits[1]))
            child.process.kill()
            time.sleep(1.2)
            resource.setrlimit(resource.RLIMIT_NOFILE, limits)
            give_up = time.monotonic() + 20
            while not (child.pid != first and child.runs()) and time.monotonic() < give_up:
                time.sleep(0.02)
            print("replaced" if child.pid != first and child.runs() else "missing")
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout == "replaced\n", done.stderr
    assert "cannot be started" in done.stderr


def test_no_error_ends_what_is_repeated(supervisor):
    calls = []

    def step():
        calls.append(len(calls))
        raise OSError("no handles")

    supervisor.repeat(step, 0.01, "step")
    until(lambda: len(calls) > 3)


def test_stopped_processes_end_with_it():
    with Supervisor(output=2) as supervisor:
        child = supervisor.start("parent", PARENT, rank=0)
        until(lambda: psutil.Process(child.pid).children())
        (grandchild,) = psutil.Process(child.pid).children()
        grandchild.suspend()
        psutil.Process(child.pid).suspend()
    until(lambda: gone(child.pid) and gone(grandchild.pid), 5.0)


def test_stopped_processes_are_replaced(supervisor):
    child = supervisor.start("parent", PARENT, rank=0)
    supervisor.keep_alive()
    supervisor.repeat(Health("tcp/127.0.0.1:1", child, []).look, 0.05, "look")
    until(lambda: psutil.Process(child.pid).children())
    first, (grandchild,) = child.pid, psutil.Process(child.pid).children()
    grandchild.suspend()
    until(lambda: gone(grandchild.pid))
    until(lambda: child.pid != first and child.runs())
    second = child.pid
    psutil.Process(second).suspend()
    until(lambda: child.pid != second and child.runs())


def test_a_process_of_somebody_else_is_left_stopped(supervisor):
    child = supervisor.start("sleeper", SLEEPER, rank=0)
    other = subprocess.Popen(["sleep", "600"])
    try:
        os.kill(other.pid, signal.SIGSTOP)
        until(lambda: other.pid in {each.pid for each in stopped_processes()})
        Health("tcp/127.0.0.1:1", child, []).look()
        assert other.poll() is None
    finally:
        other.kill()
        other.wait()


def test_what_answers_no_ping_is_replaced_and_what_answers_or_computes_is_not(supervisor):
    endpoint = free_endpoint()
    router = supervisor.start("router", ("-m", "oxbow.bus.router", "--listen", endpoint), rank=0)
    script = textwrap.dedent(DEAF)
    children = [
        supervisor.start(name, ("-c", script, endpoint, name), rank=1) for name in ("deaf", "busy", "well")
    ]
    deaf, busy, well = children
    supervisor.keep_alive()
    health = Health(endpoint, router, children)
    answered = set()

    def ask():
        health.ask()
        answered.update(health.answering)

    supervisor.repeat(ask, 0.1, "pings", at_end=health.close)
    until(lambda: {child.pid for child in children} <= answered)
    first = deaf.pid
    with Session.connect(endpoint) as stranger:
        stranger.answer(STRANGE, lambda *_: [(STRANGE, b"no ping")])
        os.kill(first, signal.SIGUSR1)
        os.kill(busy.pid, signal.SIGUSR2)
        until(lambda: deaf.pid != first and deaf.pid in answered)
    assert busy.pid not in health.answering
    assert busy.starts == well.starts == router.starts == 1


def test_a_router_that_is_deaf_is_replaced_and_no_other(supervisor):
    """One that is stopped takes connections, since the kernel does, but lets nobody join."""
    endpoint = free_endpoint()
    router = supervisor.start("router", ("-m", "oxbow.bus.router", "--listen", endpoint), rank=0)
    well = supervisor.start("well", ("-c", textwrap.dedent(DEAF), endpoint, "well"), rank=1)
    supervisor.keep_alive()
    health = Health(endpoint, router, [well])
    supervisor.repeat(health.ask, 0.1, "pings", at_end=health.close)
    until(lambda: well.pid in health.answering)
    first = router.pid
    psutil.Process(first).suspend()
    until(lambda: router.pid != first and well.pid in health.answering)
    assert well.starts == 1
