"""The mission service, as a helper process sees it."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing.connection import Connection

import msgspec

from oxbow_mission.wire import Answer, Ask, FromHelper, Said, ToHelper, Told

__all__ = ["Handler", "HungUp", "Peer"]


class HungUp(BaseException):
    """The mission service is gone, or has closed the pipe. No Exception: no handler may catch it by chance."""


class Peer:
    """The mission service at the other end of a pipe; every method raises `HungUp` where there is none."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._order = 0

    def send(self, message: FromHelper) -> None:
        """Say something."""
        try:
            self._pipe.send_bytes(msgspec.msgpack.encode(Said(order=self._order, what=message)))
        except OSError as error:
            raise HungUp from error

    def receive(self) -> ToHelper:
        """Wait for an order, or for the answer to what was asked."""
        try:
            data = self._pipe.recv_bytes()
        except (EOFError, OSError) as error:
            raise HungUp from error
        told = msgspec.msgpack.decode(data, type=Told)
        self._order = told.order
        return told.what

    def ask(self, ask: Ask) -> Answer:
        """Ask a stage, by way of the mission service, which has the bus."""
        self.send(ask)
        answer = self.receive()
        assert isinstance(answer, Answer)
        return answer


Handler = Callable[[ToHelper, Peer], FromHelper]
"""Carries out an order."""
