"""Calling stages over the bus: the replica with the fewest requests, retries on loss, until the deadline."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

import msgspec
import zenoh

from oxbow.bus.replicas import Replicas
from oxbow.bus.replies import error_of, error_of_reply, is_timeout
from oxbow.bus.session import Session
from oxbow.contracts import ANY_LIVE, MAX_REQUEST_BYTES, Endpoint, Message, live_service
from oxbow.errors import Busy, DeadlineExceeded, ErrorCode, Internal, InvalidRequest, OxbowError, Unavailable
from oxbow.ids import MOST_ID_CHARACTERS
from oxbow.wire import codec
from oxbow.wire.envelope import Envelope
from oxbow.wire.waits import checked_wait

__all__ = ["Bus", "BusCall"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)
A = TypeVar("A")

MOST_OUTSTANDING = 4
"""Requests of one caller that one replica may hold: enough to keep it at work, few enough to share well."""

MOST_FAILURES = 3
"""Worker processes that one request may cost, or wrong answers that it may get, before it is given up."""

WRONG = "wrong answer"
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
        # For all stages at once: which of them a caller will ask is not known yet, and tokens are few.
        self._watch_liveness(ANY_LIVE, self._on_liveness)

    def _on_liveness(self, key: str, alive: bool) -> None:
        self.replicas.update(*live_service(key), alive)

    def instances(self, stage: str) -> tuple[str, ...]:
        """The live replicas of a stage."""
        return self.replicas.alive(stage)

    def wait_ready(self, stages: Iterable[str], timeout_s: float) -> None:
        """Return once each of `stages` has a live replica.

        Parameters
        ----------
        stages
            Names of stages, or of services, such as ``mission``.
        timeout_s
            Seconds to wait at most.

        Raises
        ------
        InvalidOption
            `timeout_s` is no wait (`oxbow.wire.waits`).
        Unavailable
            Some have none after `timeout_s`; the message names them.
        """
        missing = self.replicas.wait_alive(tuple(stages), checked_wait(timeout_s, "timeout_s"))
        if missing:
            raise Unavailable(f"no live {', '.join(missing)} after {timeout_s:g} s", where=self.endpoint)

    def call(self, endpoint: Endpoint[Q, R], request: Q, envelope: Envelope) -> R:
        """Ask a stage.

        If a replica is busy, or is lost while it works, another one is asked, or the same one a little later.

        Parameters
        ----------
        endpoint
            The stage, and the types of its messages.
        request
            What to ask.
        envelope
            The request's id and deadline, and the mission and run that it belongs to.

        Returns
        -------
        Message
            The stage's reply, of the endpoint's type.

        Raises
        ------
        InvalidRequest
            The request is larger than `MAX_REQUEST_BYTES`.
        Unavailable
            The stage had no live replica for `patience_s`.
        DeadlineExceeded
            No answer before the envelope's deadline.
        Internal
            The request cost a worker process, or got a wrong answer, `MOST_FAILURES` times.
        OxbowError
            Whatever the stage itself raised.
        """
        return self._asked(
            endpoint, codec.encode(request), envelope, lambda reply: codec.decode(reply, endpoint.reply)
        )

    def forward(self, endpoint: Endpoint[Any, Any], payload: bytes, envelope: Envelope) -> bytes:
        """Ask a stage without reading messages; see `call`, which raises the same.

        Parameters
        ----------
        endpoint
            The stage.
        payload
            The encoded request.
        envelope
            The request's id and deadline, and the mission and run that it belongs to.

        Returns
        -------
        bytes
            The encoded reply, which may turn out to be unreadable.
        """
        return self._asked(endpoint, payload, envelope, lambda reply: reply)

    def _asked(
        self, endpoint: Endpoint[Any, Any], payload: bytes, envelope: Envelope, read: Callable[[bytes], A]
    ) -> A:
        # Refused before it is sent: the replica would only refuse it after megabytes have crossed the network.
        if len(payload) > MAX_REQUEST_BYTES:
            raise InvalidRequest(f"is {len(payload)} bytes; at most {MAX_REQUEST_BYTES}", where=endpoint.stage)
        return _Attempts(self, endpoint, payload, envelope, read).run()


class BusCall:
    """`oxbow.contracts.Call` over the bus: the calls of one run of one mission.

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
        return self.bus.call(endpoint, request, self.envelope(part))

    def envelope(self, part: str = "") -> Envelope:
        """What travels beside the run's next request."""
        return Envelope(
            request_id=uuid.uuid4().hex,
            deadline_s=self.deadline_s,
            mission_id=self.mission_id,
            run_id=self.run_id,
            origin=self.origin,
            part=part,
        )


class _Lost(Unavailable):
    """Nothing came back: the replica went away with the request, or before it."""


class _Failed(Unavailable):
    """The replica is alive, but has not answered: its worker process died, or the answer was a wrong one."""

    def __init__(self, message: str, outcome: str) -> None:
        super().__init__(message)
        self.outcome = outcome


class _Attempts(Generic[A]):
    """The attempts at one request, and what became of them; `read` decodes the bytes of a reply."""

    def __init__(
        self,
        bus: Bus,
        endpoint: Endpoint[Any, Any],
        payload: bytes,
        envelope: Envelope,
        read: Callable[[bytes], A],
    ) -> None:
        self.bus = bus
        self.endpoint = endpoint
        self.payload = payload
        self.envelope = envelope
        self.read = read
        # Once for all attempts: a retry keeps its id, by which a replica recognizes a request that it has
        # answered.
        self.attachment = msgspec.json.encode(envelope)
        self.started = time.monotonic()
        self.tried: dict[str, str] = {}
        self.to_avoid: set[str] = set()
        self.false: set[str] = set()
        self.failures = 0
        self.pause_s = FIRST_PAUSE_S

    def run(self) -> A:
        replicas, stage = self.bus.replicas, self.endpoint.stage
        while True:
            instance = self._next_instance()
            try:
                return self._ask(instance)
            except _Lost:
                self._note(instance, "lost")
            except Busy:
                self._note(instance, "busy")
            except _Failed as error:
                self._note_failure(instance, error)
            finally:
                replicas.release(stage, instance)
            # Only after an attempt has failed; `finally` has released the replica, for other threads of this
            # caller too.
            self._pause()

    def _next_instance(self) -> str:
        replicas, stage = self.bus.replicas, self.endpoint.stage
        while (remaining_s := self.envelope.remaining_s()) > 0:
            instance = replicas.acquire(stage, self.to_avoid, min(remaining_s, LOOK_ROUND_S))
            if instance is not None:
                return instance
            if replicas.missing_s(stage) > self.bus.patience_s:
                raise Unavailable(
                    f"has no live replica on the bus at {self.bus.endpoint}, {self._history()}", where=stage
                )
        raise DeadlineExceeded(f"no answer {self._history()}", where=stage)

    def _ask(self, instance: str) -> A:
        key = self.endpoint.instance_key(instance)
        # Longer than the deadline, so that the stage itself reports where the time went.
        timeout_s = max(0.0, self.envelope.remaining_s()) + REPLY_GRACE_S
        # The key is that of one replica: the first reply is the only one.
        for reply in self.bus.questions.ask(key, self.payload, attachment=self.attachment, timeout_s=timeout_s):
            if reply.ok is not None:
                return self._answer(reply.ok, key)
            if reply.err is not None:
                raise self._error(reply.err, key, timeout_s)
        raise _Lost("nothing came back")

    def _answer(self, sample: zenoh.Sample, key: str) -> A:
        """A reply, if it is one to this request."""
        about = b"" if sample.attachment is None else sample.attachment.to_bytes()
        if str(sample.key_expr) != key or about != self.envelope.request_id.encode():
            whose = f"under {str(sample.key_expr)!r} to request {about[:MOST_ID_CHARACTERS]!r}"
            raise _Failed(f"{key} replied {whose}, not to {self.envelope.request_id!r}", WRONG)
        try:
            return self.read(sample.payload.to_bytes())
        except InvalidRequest as error:
            raise _Failed(f"{key} sent an invalid reply: {error}", WRONG) from error

    def _error(self, reply: zenoh.ReplyError, key: str, timeout_s: float) -> OxbowError:
        """The exception to raise for an error reply, if it is one to this request."""
        # Zenoh's time-out carries no request id, so it is recognized before the id is checked.
        if is_timeout(reply):
            return error_of(reply, key, timeout_s)
        told = error_of_reply(reply, key)
        if told.request_id != self.envelope.request_id:
            whose = f"an error to request {told.request_id[:MOST_ID_CHARACTERS]!r}"
            return _Failed(f"{key} replied {whose}, not to {self.envelope.request_id!r}: {told.message}", WRONG)
        # A stage is unavailable when its worker process is: the request may have killed it, so that this counts.
        if told.code is ErrorCode.UNAVAILABLE:
            return _Failed(told.message, "worker lost")
        return told.error()

    def _note(self, instance: str, outcome: str) -> None:
        self.tried[instance] = outcome
        self.to_avoid.add(instance)

    def _note_failure(self, instance: str, error: _Failed) -> None:
        self._note(instance, error.outcome)
        if error.outcome is WRONG:
            self.false.add(instance)
        self.failures += 1
        if self.failures >= MOST_FAILURES:
            raise Internal(f"{error.message}; given up {self._history()}", where=self.endpoint.stage) from error

    def _pause(self) -> None:
        """Try another replica at once, where there is one; else wait a little and try them again.

        One that gave a wrong answer is asked again only where there is no other.
        """
        # A replica that has just come up counts too: it was not tried yet.
        if set(self.bus.instances(self.endpoint.stage)) - self.to_avoid:
            return
        self.to_avoid = set(self.false)
        time.sleep(min(self.pause_s, max(0.0, self.envelope.remaining_s())))
        self.pause_s = min(2 * self.pause_s, LONGEST_PAUSE_S)

    def _history(self) -> str:
        tried = ", ".join(f"{instance}: {outcome}" for instance, outcome in self.tried.items())
        return f"after {time.monotonic() - self.started:.1f} s (tried {tried or 'no replica'})"
