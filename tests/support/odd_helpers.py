"""What helper processes may come across, each by the name in a request's document."""

from __future__ import annotations

import os
import signal
import time

import msgspec

from oxbow.contracts import CONTOUR
from oxbow.errors import InvalidMission
from oxbow_mission.peer import Peer
from oxbow_mission.wire import Ask, Check, Checked, FromHelper, Plan, Planned, Show, ToHelper

__all__ = ["check", "plan"]


def check(order: ToHelper, peer: Peer) -> FromHelper:
    assert isinstance(order, Check)
    what = order.document.decode()
    match what:
        case "hangs":
            # In C code that holds the interpreter's lock: no signal handler and no other thread would run.
            sum(range(10**12))
        case "takes a while":
            time.sleep(1.5)
        case "crashes":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "is killed":
            os.kill(os.getpid(), signal.SIGKILL)
        case "needs memory":
            bytearray(2**34)
        case "is refused":
            raise InvalidMission("is wrong", where="Mission File")
        case "raises":
            raise KeyboardInterrupt("out of the blue")
        case "answers for another":
            return Planned(document=b"a plan")
        case "answers twice":
            peer.send(_checked("twice"))
        case "asks":
            peer.ask(Ask(stage=CONTOUR.stage, payload=b"", part="", fraction=0.0, origin=(0.0, 0.0)))
        case "sends garbage":
            peer._pipe.send_bytes(b"garbage")
    return _checked(what)


def plan(order: ToHelper, peer: Peer) -> FromHelper:
    assert isinstance(order, Plan)
    what = order.document.decode()
    match what:
        case "hangs":
            sum(range(10**12))
        case "crashes":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "is killed now and then":
            if os.getpid() % 2:
                os.kill(os.getpid(), signal.SIGKILL)
        case "needs memory":
            bytearray(2**34)
        case "raises":
            raise KeyboardInterrupt("out of the blue")
        case "answers for another":
            return _checked("another")
        case "asks for no stage":
            _raise_error_of(peer, "none")
        case "asks nonsense":
            _raise_error_of(peer, CONTOUR.stage)
        case "shows what is no layer":
            peer.send(Show(name="*/**", payload=b"", droppable=True))
        case "answers twice":
            peer.send(Planned(document=b"twice"))
    return Planned(document=what.encode())


def _raise_error_of(peer: Peer, stage: str) -> None:
    answer = peer.ask(Ask(stage=stage, payload=b"?", part="", fraction=0.0, origin=(0.0, 0.0)))
    assert answer.error is not None
    raise answer.error.error()


def _checked(what: str) -> Checked:
    return Checked(
        mission_id=what.replace(" ", "-"),
        client="",
        document=b"{}",
        parameters=msgspec.json.encode({}),
        fingerprint=what,
        deadline_s=1.0,
    )
