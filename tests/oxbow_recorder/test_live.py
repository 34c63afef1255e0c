"""The server for viewers: a process that is started again, on a port that is free."""

import socket
import time

import pytest

from oxbow_recorder import live as live_module
from oxbow_recorder.live import LiveServer

pytestmark = pytest.mark.processes


def is_served(address):
    host, port = address.removeprefix("rerun+http://").removesuffix("/proxy").split(":")
    with socket.socket() as probe:
        return probe.connect_ex((host, int(port))) == 0


def until(condition, timeout_s=30.0):
    give_up = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < give_up
        time.sleep(0.02)


def test_it_serves_on_another_port_where_one_is_taken_and_is_started_again(monkeypatch):
    monkeypatch.setattr(live_module, "PAUSE_S", 0.0)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with LiveServer(taken.getsockname()[1]) as live:
            assert str(taken.getsockname()[1]) not in live.address
            until(lambda: is_served(live.address))
            live.process.kill()
            until(lambda: not is_served(live.address))
            live.process.wait(10)
            live.revive()
            until(lambda: is_served(live.address))
    assert live.process.poll() is not None
