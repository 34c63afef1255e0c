"""What a worker process does: bytes in, layers and a reply or an error out."""

from __future__ import annotations

import importlib
import logging
import time
from dataclasses import dataclass
from importlib.metadata import version
from multiprocessing.connection import Connection
from typing import Any

import msgspec
import numpy as np
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import INTROSPECTION, MAX_REQUEST_BYTES, Endpoint, any_layer_key, layer_key
from oxbow.errors import ErrorReply, Infeasible, Internal, InvalidInput, OxbowError, error_text
from oxbow.stage.local import Handler
from oxbow.stage.wire import Described, Done, Failed, FromWorker, Job, Shown
from oxbow.stage.worker import needs_memory
from oxbow.wire import codec
from oxbow.wire.envelope import Envelope
from oxbow.wire.recording import Layer, Show, Stamped, discard

__all__ = ["is_memory_error", "serve"]

_log = logging.getLogger(__name__)


def serve(pipe: Connection, endpoint: str, handler: str, instance: str, memory_mb: int) -> None:
    """Describe the stage, then answer job after job, until the pipe is closed.

    Parameters
    ----------
    pipe
        To the session process.
    endpoint, handler
        As ``package.module:attribute``.
    instance
        The replica's name.
    memory_mb
        What this process may take.
    """
    adapter = _Adapter(pipe, _named(endpoint), _named(handler), memory_mb)
    try:
        _send(pipe, _description(adapter.endpoint, instance))
        while True:
            job = msgspec.msgpack.decode(pipe.recv_bytes(), type=Job)
            _send(pipe, adapter.outcome(job))
    # The session process has closed the pipe, or died: either way there is nobody left to work for.
    except (EOFError, OSError):
        return


def _named(name: str) -> Any:
    """The object that ``package.module:attribute`` names."""
    module, _, attribute = name.partition(":")
    return getattr(importlib.import_module(module), attribute)


def _send(pipe: Connection, message: FromWorker) -> None:
    pipe.send_bytes(msgspec.msgpack.encode(message))


@dataclass(frozen=True)
class _Adapter:
    """Between jobs and the handler: whatever the handler does, a job has an answer."""

    pipe: Connection
    endpoint: Endpoint[Any, Any]
    handler: Handler
    memory_mb: int

    def outcome(self, job: Job) -> Done | Failed:
        """Run one job."""
        request_id = job.envelope.request_id
        try:
            reply = self.handler(codec.decode(job.payload, self.endpoint.request), self._show(job))
            return Done(request_id=request_id, payload=self._encoded(reply))
        except BaseException as error:  # noqa: BLE001 - the adapter at which whatever is raised becomes a reply
            return Failed(request_id=request_id, error=ErrorReply.of(self._error(error, request_id)))

    def _error(self, error: BaseException, request_id: str) -> OxbowError:
        """What to answer: the other kinds of `OxbowError` are about the bus, and no handler's to raise."""
        if isinstance(error, InvalidInput | Infeasible | Internal):
            return error
        if is_memory_error(error):
            _log.error("%s: request %s needs more than %d MB", self.endpoint.stage, request_id, self.memory_mb)
            return needs_memory(self.memory_mb, self.endpoint.stage)
        _log.error("%s: request %s failed", self.endpoint.stage, request_id, exc_info=error)
        return Internal(f"{error_text(error)} (request {request_id})", where=self.endpoint.stage)

    def _encoded(self, reply: Any) -> bytes:
        endpoint = self.endpoint
        if not isinstance(reply, endpoint.reply):
            kinds = f"a {type(reply).__name__}, not a {endpoint.reply.__name__}"
            raise Internal(f"replied {kinds}", where=endpoint.stage)
        payload = codec.encode(reply)
        if len(payload) > MAX_REQUEST_BYTES:
            message = f"the reply is {len(payload)} bytes; at most {MAX_REQUEST_BYTES}"
            raise Internal(message, where=endpoint.stage)
        return payload

    def _show(self, job: Job) -> Show:
        envelope = job.envelope
        if not job.show:
            return discard

        def show(layer: Layer) -> None:
            key = layer_key(envelope.mission_id, layer.stage, layer.name)
            payload = codec.encode(_stamped(layer, envelope))
            _send(self.pipe, Shown(request_id=envelope.request_id, key=key, payload=payload))

        return show


def is_memory_error(error: BaseException) -> bool:
    """Whether an exception means that there was no memory left."""
    # GEOS reports a failed allocation as text only.
    return isinstance(error, MemoryError) or (isinstance(error, ShapelyError) and "bad_alloc" in str(error))


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
    """How `oxbow.wire.codec` sends what msgspec does not know."""
    origin = getattr(kind, "__origin__", kind)
    if isinstance(origin, type) and issubclass(origin, BaseGeometry):
        return {"type": "string", "format": "binary", "description": f"{origin.__name__} as WKB, planar metres"}
    if origin is np.ndarray:
        return {"type": "array", "description": "array: dtype, shape, and the elements as little-endian bytes"}
    raise TypeError(f"{kind!r} is in a message, and no schema says how it is sent")
