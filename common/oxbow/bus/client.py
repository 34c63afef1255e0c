"""Calling stages over the bus: the replica with the fewest requests, retries on loss, until the deadline."""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterable
from typing import TypeVar

import msgspec
import zenoh

from oxbow import codec
from oxbow.bus.replicas import Replicas
from oxbow.bus.session import Session, error_of
from oxbow.contracts import ANY_LIVE, MAX_REQUEST_BYTES, Endpoint, Message, live_service
from oxbow.envelope import Envelope
from oxbow.errors import Busy, DeadlineExceeded, Internal, InvalidMission, Unavailable

__all__ = ["Bus", "BusCall"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

MOST_OUTSTANDING = 4
"""Requests of one caller that one replica may hold: enough to keep it at work, few enough to share well."""

MOST_WORKER_LOSSES = 3
"""Worker processes that one request may cost before it is taken to be what kills them."""

LOOK_ROUND_S = 0.5
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.02, 0.5
REPLY_GRACE_S = 0.5
"""How much longer than the deadline to listen, so that the stage's own words about it arrive."""


class Bus(Session):
    """A session that also calls stages.

    Attributes
    ----------
    patience_s
        A stage without a live replica for this long is reported missing, however far the deadline.
    """

    patience_s = 15.0

    def __init__(self, session: zenoh.Session, endpoint: str) -> None:
        super().__init__(session, endpoint)
        self.replicas = Replicas(MOST_OUTSTANDING)
        self._watch_liveness(ANY_LIVE, self._on_liveness)

    def _on_liveness(self, key: str, alive: bool) -> None:
        self.replicas.update(*live_service(key), alive)

    def instances(self, stage: str) -> tuple[str, ...]:
        """The live replicas of a stage."""
        return self.replicas.alive(stage)

    def wait_ready(self, stages: Iterable[str], timeout_s: float) -> None:
        """Return once each of `stages` has a live replica.

        Raises
        ------
        Unavailable
            Some have none after `timeout_s`; the message names them.
        """
        missing = self.replicas.wait_alive(tuple(stages), timeout_s)
        if missing:
            raise Unavailable(f"no live {', '.join(missing)} after {timeout_s:g} s", where=self.endpoint)

    def call(self, endpoint: Endpoint[Q, R], request: Q, envelope: Envelope) -> R:
        """Ask a stage.

        A replica that is busy, or lost while it works, is replaced by another, or by itself a little later.

        Raises
        ------
        InvalidMission
            The request is larger than `MAX_REQUEST_BYTES`.
        Unavailable
            The stage had no live replica for `patience_s`.
        DeadlineExceeded
            No answer before the envelope's deadline.
        Internal
            The request has cost the stage `MOST_WORKER_LOSSES` worker processes.
        OxbowError
            Whatever the stage itself raised.
        """
        payload = codec.encode(request)
        if len(payload) > MAX_REQUEST_BYTES:
            raise InvalidMission(f"is {len(payload)} bytes; at most {MAX_REQUEST_BYTES}", where=endpoint.stage)
        reply = _Attempts(self, endpoint, payload, envelope).run()
        return codec.decode(reply, endpoint.reply)


class BusCall:
    """`oxbow.pipeline.Call` over the bus: the calls of one run of one mission.

    Parameters
    ----------
    deadline_s
        Unix time by which the whole run is of use.
    origin
        Latitude and longitude of the planar frame's origin, for the layers.
    """

    def __init__(
        self, bus: Bus, *, mission_id: str = "", origin: tuple[float, float] | None = None, deadline_s: float
    ) -> None:
        self.bus = bus
        self.mission_id = mission_id
        self.origin = origin
        self.deadline_s = deadline_s
        self.run_id = uuid.uuid4().hex

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /, *, part: str = "") -> R:
        envelope = Envelope(
            request_id=uuid.uuid4().hex,
            deadline_s=self.deadline_s,
            mission_id=self.mission_id,
            run_id=self.run_id,
            origin=self.origin,
            part=part,
        )
        return self.bus.call(endpoint, request, envelope)


class _Lost(Unavailable):
    """Nothing came back: the replica went away with the request, or before it."""


class _WorkerLost(Unavailable):
    """The replica is there, but its worker process died with the request."""


class _Attempts:
    """The attempts at one request, and what became of them."""

    def __init__(self, bus: Bus, endpoint: Endpoint[Q, R], payload: bytes, envelope: Envelope) -> None:
        self.bus = bus
        self.endpoint = endpoint
        self.payload = payload
        self.envelope = envelope
        self.attachment = msgspec.json.encode(envelope)
        self.started = time.monotonic()
        self.tried: dict[str, str] = {}
        self.to_avoid: set[str] = set()
        self.worker_losses = 0
        self.pause_s = FIRST_PAUSE_S

    def run(self) -> bytes:
        replicas, stage = self.bus.replicas, self.endpoint.stage
        while True:
            instance = self._next_instance()
            try:
                return self._ask(instance)
            except _Lost:
                self._note(instance, "lost")
            except Busy:
                self._note(instance, "busy")
            except _WorkerLost as error:
                self._note_worker_loss(instance, error)
            finally:
                replicas.release(stage, instance)
            self._pause()

    def _next_instance(self) -> str:
        replicas, stage = self.bus.replicas, self.endpoint.stage
        while (remaining_s := self.envelope.remaining_s()) > 0:
            instance = replicas.acquire(stage, self.to_avoid, min(remaining_s, LOOK_ROUND_S))
            if instance is not None:
                return instance
            if replicas.missing_s(stage) > self.bus.patience_s:
                raise Unavailable(f"has no live replica at {self.bus.endpoint}, {self._history()}", where=stage)
        raise DeadlineExceeded(f"no answer {self._history()}", where=stage)

    def _ask(self, instance: str) -> bytes:
        key = self.endpoint.instance_key(instance)
        timeout_s = max(0.0, self.envelope.remaining_s()) + REPLY_GRACE_S
        for reply in self.bus._get(key, self.payload, attachment=self.attachment, timeout_s=timeout_s):
            if reply.ok is not None:
                return reply.ok.payload.to_bytes()
            if reply.err is not None:
                error = error_of(reply.err, key, timeout_s)
                raise _WorkerLost(error.message) if isinstance(error, Unavailable) else error
        raise _Lost("nothing came back")

    def _note(self, instance: str, outcome: str) -> None:
        self.tried[instance] = outcome
        self.to_avoid.add(instance)

    def _note_worker_loss(self, instance: str, error: _WorkerLost) -> None:
        self._note(instance, "worker lost")
        self.worker_losses += 1
        if self.worker_losses >= MOST_WORKER_LOSSES:
            raise Internal(f"{error.message}; given up {self._history()}", where=self.endpoint.stage) from error

    def _pause(self) -> None:
        """Try another replica at once, where there is one; else wait a little and try all of them again."""
        if set(self.bus.instances(self.endpoint.stage)) - self.to_avoid:
            return
        self.to_avoid.clear()
        time.sleep(min(self.pause_s, max(0.0, self.envelope.remaining_s())))
        self.pause_s = min(2 * self.pause_s, LONGEST_PAUSE_S)

    def _history(self) -> str:
        tried = ", ".join(f"{instance}: {outcome}" for instance, outcome in self.tried.items())
        return f"after {time.monotonic() - self.started:.1f} s (tried {tried or 'no replica'})"
