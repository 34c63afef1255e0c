"""The worker process of a stage: bytes in, layers and a reply or an error out.

``python -m oxbow.stage.process FD ENDPOINT HANDLER INSTANCE``, started by `oxbow.stage.worker`.
"""

from __future__ import annotations

import importlib
import logging
import os
import select
import signal
import sys
import threading
import time
from importlib.metadata import version
from multiprocessing.connection import Connection
from typing import Any

import msgspec
import numpy as np
from shapely.geometry.base import BaseGeometry

from oxbow import codec
from oxbow.contracts import (
    INTROSPECTION,
    MAX_REQUEST_BYTES,
    Endpoint,
    any_layer_key,
    layer_key,
)
from oxbow.envelope import Envelope
from oxbow.errors import ErrorReply, Internal, OxbowError
from oxbow.local import Handler
from oxbow.recording import Layer, Show, Stamped, discard
from oxbow.stage.wire import Described, Done, Failed, FromWorker, Job, Shown

__all__ = ["main"]

_log = logging.getLogger(__name__)


def main(argv: list[str]) -> None:
    """Serve jobs until the session process closes the pipe or dies."""
    fd, endpoint_name, handler_name, instance = argv
    # Signals to the process group are the session process's business: it drains, then closes the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(asctime)s %(name)s: %(message)s")
    pipe = Connection(int(fd))
    threading.Thread(target=_end_with_peer, args=(int(fd),), daemon=True).start()
    endpoint, handler = named(endpoint_name), named(handler_name)
    try:
        _send(pipe, _description(endpoint, instance))
        while True:
            job = msgspec.msgpack.decode(pipe.recv_bytes(), type=Job)
            _send(pipe, _outcome(job, endpoint, handler, pipe))
    except (EOFError, OSError):
        return


def named(name: str) -> Any:
    """The object that ``package.module:attribute`` names."""
    module, _, attribute = name.partition(":")
    return getattr(importlib.import_module(module), attribute)


def _end_with_peer(fd: int) -> None:
    """End this process, whatever it is working on, when the session process is gone."""
    poll = select.poll()
    poll.register(fd, 0)
    poll.poll()
    os._exit(0)


def _send(pipe: Connection, message: FromWorker) -> None:
    pipe.send_bytes(msgspec.msgpack.encode(message))


def _outcome(job: Job, endpoint: Endpoint[Any, Any], handler: Handler, pipe: Connection) -> Done | Failed:
    """Run one job; this is the adapter at which an unknown exception becomes an `internal` error."""
    request_id = job.envelope.request_id
    try:
        reply = handler(codec.decode(job.payload, endpoint.request), _show(job, pipe))
        return Done(payload=_encoded(reply, endpoint))
    except OxbowError as error:
        return Failed(error=ErrorReply.of(error))
    except Exception as error:  # noqa: BLE001 - becomes an `internal` reply
        _log.exception("%s: request %s failed", endpoint.stage, request_id)
        message = f"{type(error).__name__}: {error} (request {request_id})"
        return Failed(error=ErrorReply.of(Internal(message, where=endpoint.stage)))


def _encoded(reply: Any, endpoint: Endpoint[Any, Any]) -> bytes:
    if not isinstance(reply, endpoint.reply):
        raise Internal(f"replied a {type(reply).__name__}, not a {endpoint.reply.__name__}", where=endpoint.stage)
    payload = codec.encode(reply)
    if len(payload) > MAX_REQUEST_BYTES:
        raise Internal(f"the reply is {len(payload)} bytes; at most {MAX_REQUEST_BYTES}", where=endpoint.stage)
    return payload


def _show(job: Job, pipe: Connection) -> Show:
    envelope = job.envelope
    if not job.show:
        return discard

    def show(layer: Layer) -> None:
        key = layer_key(envelope.mission_id, layer.stage, layer.name)
        _send(pipe, Shown(key=key, payload=codec.encode(_stamped(layer, envelope))))

    return show


def _stamped(layer: Layer, envelope: Envelope) -> Stamped:
    return Stamped(
        mission_id=envelope.mission_id,
        origin=envelope.origin,
        request_id=envelope.run_id or envelope.request_id,
        time_s=time.time(),
        part=envelope.part,
        layer=layer,
    )


def _description(endpoint: Endpoint[Any, Any], instance: str) -> Described:
    schemas, components = msgspec.json.schema_components(
        (endpoint.request, endpoint.reply), schema_hook=_schema_of_custom
    )
    schema = {"request": schemas[0], "reply": schemas[1], "$defs": components}
    return Described(
        stage=endpoint.stage,
        version=version("oxbow"),
        instance_key=endpoint.instance_key(instance),
        live_key=endpoint.live_key(instance),
        introspection_keys={what: endpoint.introspection_key(instance, what) for what in INTROSPECTION},
        layers_key=any_layer_key(endpoint.stage),
        most_request_bytes=MAX_REQUEST_BYTES,
        schema=msgspec.json.encode(schema),
    )


def _schema_of_custom(kind: Any) -> dict[str, Any]:
    """How `oxbow.codec` sends what msgspec does not know."""
    origin = getattr(kind, "__origin__", kind)
    if isinstance(origin, type) and issubclass(origin, BaseGeometry):
        return {"type": "string", "format": "binary", "description": f"{origin.__name__} as WKB, planar metres"}
    if origin is np.ndarray:
        return {"type": "array", "description": "array: dtype, shape, and the elements as little-endian bytes"}
    raise TypeError(f"{kind!r} is in a message, and no schema says how it is sent")


if __name__ == "__main__":
    main(sys.argv[1:])
