"""A stage for the tests of the bus: what it does with a request is written in the request."""

from __future__ import annotations

import enum
import os
import signal
import struct
import sys
import threading
import time
from collections.abc import Callable

import msgspec
import numpy as np
import shapely
from shapely import Polygon

from oxbow.contracts import Endpoint, Message
from oxbow.errors import Busy, DeadlineExceeded, ErrorCode, ErrorReply, Infeasible, InvalidMission, Unavailable
from oxbow.stage import serve_stage
from oxbow.stage.wire import Described, Done, Failed, FromWorker
from oxbow.wire.recording import Layer, Show


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
    FREEZE = "freeze"
    FREEZE_ONCE = "freeze_once"
    # Raised by the handler.
    EXIT = "exit"
    INTERRUPT = "interrupt"
    PANIC = "panic"
    UNPRINTABLE = "unprintable"
    SURROGATE = "surrogate"
    RECURSE = "recurse"
    BE_BUSY = "be_busy"
    BE_UNAVAILABLE = "be_unavailable"
    BE_LATE = "be_late"
    HUNGER = "hunger"
    # Said by the worker process, and no answer to its job.
    ANSWER_TWICE = "answer_twice"
    ANSWER_LATER = "answer_later"
    ANSWER_FOR_ANOTHER = "answer_for_another"
    FAIL_FOR_ANOTHER = "fail_for_another"
    DESCRIBE = "describe"
    BABBLE = "babble"
    OVERFLOW = "overflow"
    STARVE = "starve"


NAMES = ("tests.support.echo_stage:ECHO", "tests.support.echo_stage:handle")
"""The stage's endpoint and its handler, as they are imported by name."""
SQUARE = shapely.box(0.0, 0.0, 1.0, 1.0)


class EchoRequest(Message, frozen=True, kw_only=True):
    text: str = ""
    deed: Deed = Deed.ECHO
    seconds: float = 0.0
    shape: Polygon
    path: str = ""
    """A file: the marker of `DIE_ONCE`; else every request handled appends its text to it."""
    begun: str = ""
    """A file that is made as the work begins."""


class Echo(Message, frozen=True, kw_only=True):
    text: str
    shape: Polygon
    pid: int


ECHO: Endpoint[EchoRequest, Echo] = Endpoint("echo", EchoRequest, Echo)


class Panic(BaseException):
    """As zenoh's `PanicException`, which is no `Exception` either."""


class Unprintable(Exception):
    def __str__(self) -> str:
        raise ValueError("no text")


RAISED: dict[Deed, BaseException] = {
    Deed.REFUSE: InvalidMission("is wrong; expected something right", where="text"),
    Deed.GIVE_UP: Infeasible("no water is left", where="echo"),
    Deed.BREAK: ZeroDivisionError("a fault of the handler"),
    Deed.EXIT: SystemExit(0),
    Deed.INTERRUPT: KeyboardInterrupt(),
    Deed.PANIC: Panic("a fault of a library"),
    Deed.UNPRINTABLE: Unprintable(),
    Deed.SURROGATE: InvalidMission("is '\ud800'", where="text"),
    Deed.BE_BUSY: Busy("me"),
    Deed.BE_UNAVAILABLE: Unavailable("me"),
    Deed.BE_LATE: DeadlineExceeded("me"),
}


def handle(request: EchoRequest, show: Show) -> Echo:
    if request.begun:
        open(request.begun, "w").close()  # noqa: PTH123
    time.sleep(request.seconds)
    if request.deed in RAISED:
        raise RAISED[request.deed]
    if request.deed in MISDEEDS:
        MISDEEDS[request.deed]()
    match request.deed:
        case Deed.DIE:
            os.kill(os.getpid(), signal.SIGKILL)
        case Deed.DIE_ONCE | Deed.FREEZE_ONCE if not os.path.exists(request.path):  # noqa: PTH110
            open(request.path, "w").close()  # noqa: PTH123
            os.kill(os.getpid(), signal.SIGKILL if request.deed is Deed.DIE_ONCE else signal.SIGSTOP)
        case Deed.FREEZE:
            os.kill(os.getpid(), signal.SIGSTOP)
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


def say(data: bytes) -> None:
    """Write into this process's pipe past what serves it."""
    os.write(int(sys.argv[1]), struct.pack("!i", len(data)) + data)


def say_message(message: FromWorker) -> None:
    say(msgspec.msgpack.encode(message))


def own_request_id() -> str:
    """The id of the job at hand, which is not the handler's to know."""
    frame = sys._getframe()
    while "job" not in frame.f_locals:
        assert frame.f_back is not None
        frame = frame.f_back
    request_id: str = frame.f_locals["job"].envelope.request_id
    return request_id


def false_answer(request_id: str) -> Done:
    false = Echo(text="false", shape=SQUARE, pid=0)
    return Done(request_id=request_id, payload=msgspec.msgpack.encode(false, enc_hook=shapely.to_wkb))


def answer_later() -> None:
    later = threading.Timer(0.1, say_message, [false_answer(own_request_id())])
    later.start()


def describe() -> None:
    names = dict.fromkeys(("stage", "version", "instance_key", "live_key", "layers_key"), "false")
    say_message(Described(**names, introspection_keys={}, most_request_bytes=1, schema=b""))


def starve() -> None:
    """Take memory to the limit, and die of the next piece, as libraries in C do."""
    held = []
    try:
        while True:
            held.append(np.ones(2**20))
    except MemoryError:
        time.sleep(1.0)
        os.abort()


def recurse() -> None:
    recurse()


MISDEEDS: dict[Deed, Callable[[], object]] = {
    Deed.RECURSE: recurse,
    Deed.HUNGER: lambda: np.ones(2**33),
    Deed.ANSWER_TWICE: lambda: say_message(false_answer(own_request_id())),
    Deed.ANSWER_LATER: answer_later,
    Deed.ANSWER_FOR_ANOTHER: lambda: say_message(false_answer("another")),
    Deed.FAIL_FOR_ANOTHER: lambda: say_message(
        Failed(request_id="another", error=ErrorReply(code=ErrorCode.INFEASIBLE, message="false"))
    ),
    Deed.DESCRIBE: describe,
    Deed.BABBLE: lambda: say(b"\xc1garbage"),
    Deed.OVERFLOW: lambda: os.write(int(sys.argv[1]), b"\x7f\xff\xff\xff garbage"),
    Deed.STARVE: starve,
}


if __name__ == "__main__":
    serve_stage(*NAMES, sys.argv[1:])
