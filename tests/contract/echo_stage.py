"""A stage for the tests of the bus: what it does with a request is written in the request."""

from __future__ import annotations

import enum
import os
import signal
import sys
import time

import shapely
from shapely import Polygon

from oxbow.contracts import Endpoint, Message
from oxbow.errors import Infeasible, InvalidMission
from oxbow.recording import Layer, Show
from oxbow.stage import serve_stage


class Deed(enum.StrEnum):
    ECHO = "echo"
    DIE = "die"
    DIE_ONCE = "die_once"
    REFUSE = "refuse"
    GIVE_UP = "give_up"
    BREAK = "break"
    LIE = "lie"
    SHOW = "show"
    BLOAT = "bloat"


SQUARE = shapely.box(0.0, 0.0, 1.0, 1.0)


class EchoRequest(Message, frozen=True, kw_only=True):
    text: str = ""
    deed: Deed = Deed.ECHO
    seconds: float = 0.0
    shape: Polygon
    path: str = ""
    """A file: the marker of `DIE_ONCE`; else every request handled appends its text to it."""


class Echo(Message, frozen=True, kw_only=True):
    text: str
    shape: Polygon
    pid: int


ECHO: Endpoint[EchoRequest, Echo] = Endpoint("echo", EchoRequest, Echo)


def handle(request: EchoRequest, show: Show) -> Echo:
    time.sleep(request.seconds)
    match request.deed:
        case Deed.DIE:
            os.kill(os.getpid(), signal.SIGKILL)
        case Deed.DIE_ONCE if not os.path.exists(request.path):  # noqa: PTH110
            open(request.path, "w").close()  # noqa: PTH123
            os.kill(os.getpid(), signal.SIGKILL)
        case Deed.REFUSE:
            raise InvalidMission("is wrong; expected something right", where="text")
        case Deed.GIVE_UP:
            raise Infeasible("no water is left", where="echo")
        case Deed.BREAK:
            raise ZeroDivisionError("a fault of the handler")
        case Deed.LIE:
            return "not an Echo"  # type: ignore[return-value]
        case Deed.BLOAT:
            return Echo(text="x" * (129 * 2**20), shape=request.shape, pid=os.getpid())
        case Deed.SHOW:
            for step in range(3):
                show(Layer(stage="echo", name="shape", step=step, geometries=(request.shape,)))
        case _:
            pass
    if request.path and request.deed is Deed.ECHO:
        with open(request.path, "a") as log:  # noqa: PTH123
            log.write(request.text + "\n")
    return Echo(text=request.text, shape=request.shape, pid=os.getpid())


if __name__ == "__main__":
    serve_stage("echo_stage:ECHO", "echo_stage:handle", sys.argv[1:])
