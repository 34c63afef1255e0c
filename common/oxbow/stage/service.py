"""The session process of a stage: takes queries from the bus, and has its worker process answer them."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from statistics import fmean, quantiles

import msgspec

from oxbow.bus.mailbox import Mailbox
from oxbow.bus.query import MSGPACK, Query
from oxbow.bus.session import Session
from oxbow.errors import (
    Busy,
    DeadlineExceeded,
    ErrorReply,
    Internal,
    InvalidRequest,
    OxbowError,
    Unavailable,
    error_text,
)
from oxbow.ids import excerpt
from oxbow.stage.answered import Answered, digest, require_same
from oxbow.stage.wire import Described, Done, Failed, Job, Shown
from oxbow.stage.worker import Worker
from oxbow.wire.envelope import Envelope, StageError
from oxbow.wire.introspection import Info, Ping, Stats, rss_bytes

__all__ = ["Stage"]

MOST_ANSWERED_BYTES = 16 * 2**20
_log = logging.getLogger(__name__)


class _Exchange:
    """A request, and the queries that wait for its answer: more than one where a caller asked again."""

    def __init__(self, envelope: Envelope, query: Query) -> None:
        self.envelope = envelope
        self.queries = [query]


class Stage:
    """One replica of a stage on the bus.

    Parameters
    ----------
    session
        The bus.
    worker
        The worker process, just started.
    instance
        This replica's name.
    queue_size
        Requests that may wait; more are answered `busy`.
    on_failure
        Called when no new worker process can be started, which ends this replica.
    """

    def __init__(
        self, session: Session, worker: Worker, instance: str, queue_size: int, on_failure: Callable[[], None]
    ) -> None:
        self.session = session
        self.worker = worker
        self.instance = instance
        self.on_failure = on_failure
        self.failed = False
        self.described: Described = worker.describe()
        self.started_s = time.time()
        self._lock = threading.Lock()
        self._open: dict[str, _Exchange] = {}
        self._answered = Answered(MOST_ANSWERED_BYTES)
        self._served = self._failed = self._busy = 0
        self._seconds: deque[float] = deque(maxlen=1000)
        # Asked about at each job: layers cost time to make and to send, and mostly nobody records.
        self._audience = session.audience(self.described.layers_key)
        self._requests = Mailbox("requests", self._work, size=queue_size)
        self._queryable = session.declare_queryable(self.described.instance_key, self._accept)
        session.answer(self.described.introspection_keys.values(), self._introspect)
        session.answer(f"{self.described.instance_key}/*/**", self._refuse)
        # Last of all: whoever sees the token asks at once.
        session.declare_live(self.described.live_key)
        _log.info("%s serves %s", self.described.instance_key, worker.handler)

    def drain(self) -> None:
        """Withdraw from the bus, and answer what has been accepted."""
        self.session.undeclare_live(self.described.live_key)
        self._requests.close()
        # Until this, whoever still asks is answered `busy`, and so asks another replica at once.
        self._queryable.undeclare()

    def _accept(self, query: Query) -> None:
        """Queue a request; on the network thread, so nothing here may take its time."""
        request_id = ""
        try:
            envelope = self._envelope(query)
            request_id = envelope.request_id
            answer = self._enqueue(envelope, query)
        except OxbowError as error:
            answer = Failed(request_id=request_id, error=ErrorReply.of(error))
        if answer is not None:
            self._reply(query, answer)

    def _envelope(self, query: Query) -> Envelope:
        size, most = query.size_bytes, self.described.most_request_bytes
        if size > most:
            raise InvalidRequest(f"is {size} bytes; at most {most}", where=self.described.stage)
        return Envelope.decode(query.attachment)

    def _enqueue(self, envelope: Envelope, query: Query) -> Done | Failed | None:
        """Wait for the answer to an equal request, or queue a new one; return an answer that is there already."""
        with self._lock:
            same = self._open.get(envelope.request_id)
            if same is not None:
                # Before the query joins: an id that is used twice must not get the other request's plan.
                require_same(envelope.request_id, digest(same.queries[0].payload), query.payload)
                same.queries.append(query)
                return None
            answer = self._answered.get(envelope.request_id, query.payload)
            if answer is not None:
                return answer
            exchange = _Exchange(envelope, query)
            if not self._requests.offer(exchange):
                self._busy += 1
                waiting = len(self._requests)
                raise Busy(
                    f"accepts no more requests now; {waiting} are waiting", where=self.described.instance_key
                )
            # Still under the lock: its worker thread may have the request already, and waits to settle it.
            self._open[envelope.request_id] = exchange
            return None

    def _work(self, exchange: _Exchange) -> None:
        """Answer a request, whatever is raised on the way."""
        started = time.monotonic()
        answer: Done | Failed = self._fault(exchange, "was left without an answer")
        try:
            answer = self._answer(exchange)
        except OxbowError as error:
            answer = Failed(request_id=exchange.envelope.request_id, error=ErrorReply.of(error))
        except BaseException as error:  # noqa: BLE001 - becomes an `internal` reply
            _log.exception("request %s", exchange.envelope.request_id)
            answer = self._fault(exchange, error_text(error))
        finally:
            self._settle(exchange, answer, time.monotonic() - started)
        # Now, so that the next request need not wait for a new process.
        with suppress(Unavailable):
            self._require_worker()

    def _fault(self, exchange: _Exchange, message: str) -> Failed:
        error = Internal(message, where=self.described.instance_key)
        return Failed(request_id=exchange.envelope.request_id, error=ErrorReply.of(error))

    def _settle(self, exchange: _Exchange, answer: Done | Failed, seconds: float) -> None:
        """Close a request, and answer all who wait for it."""
        with self._lock:
            del self._open[exchange.envelope.request_id]
            self._served += 1
            self._failed += isinstance(answer, Failed)
            self._seconds.append(seconds)
        # It is no longer open, so that no further query can join it.
        for query in exchange.queries:
            self._reply(query, answer)

    def _answer(self, exchange: _Exchange) -> Done | Failed:
        """Have the worker answer; an error raised by this is not about the request, which may be asked again."""
        envelope = exchange.envelope
        # Looked at when it is taken from the queue, not when it came: it may have waited past its deadline.
        if envelope.remaining_s() <= 0:
            raise DeadlineExceeded("not started: the deadline passed in the queue", where=self.described.stage)
        self._require_worker()
        show = bool(envelope.mission_id and self._audience)
        payload = exchange.queries[0].payload
        job = Job(envelope=envelope, payload=payload, show=show)
        try:
            answer = self.worker.run(job, self._publish)
        except OxbowError as error:
            _log.error("request %s: %s", envelope.request_id, error)
            raise
        # Outside the lock, on which the network thread waits: a digest of 128 MB takes a tenth of a second.
        of = digest(payload)
        with self._lock:
            self._answered.put(envelope.request_id, of, answer)
        return answer

    def _require_worker(self) -> None:
        """Replace a worker process that has ended; where that fails, this replica ends."""
        if self.worker.alive():
            return
        try:
            self.worker.restart()
        except Unavailable:
            _log.exception("%s: no new worker process; this replica ends", self.described.instance_key)
            self.failed = True
            self.on_failure()
            raise

    def _publish(self, shown: Shown) -> None:
        """Publish a layer; where that fails, it is lost, and the plan is not."""
        try:
            self.session.publish(shown.key, shown.payload, encoding=MSGPACK, droppable=True)
        except OxbowError as error:
            _log.warning("a layer is lost: %s", error)

    def _reply(self, query: Query, answer: Done | Failed) -> None:
        try:
            with query:
                if isinstance(answer, Done):
                    about = answer.request_id.encode()
                    query.reply(self.described.instance_key, answer.payload, encoding=MSGPACK, attachment=about)
                else:
                    query.fail(StageError.about(answer.request_id, answer.error))
        except BaseException:  # noqa: BLE001 - who asked is gone; others may wait for the same answer
            _log.exception("request %s: the answer is lost", answer.request_id)

    def _refuse(self, key: str, _parameters: dict[str, str], _payload: bytes) -> Iterator[tuple[str, bytes]]:
        """Refuse queries for unknown keys: silence would look like a lost replica."""
        keys = (self.described.instance_key, *self.described.introspection_keys.values())
        raise InvalidRequest(f"is {excerpt(key)}; expected {', '.join(keys)}", where="key")

    def _introspect(self, key: str, _parameters: dict[str, str], _payload: bytes) -> Iterator[tuple[str, bytes]]:
        answers = {"ping": self._ping, "info": self._info, "stats": self._stats, "schema": self._schema}
        for what, own_key in self.described.introspection_keys.items():
            if key.endswith(f"@{what}"):
                yield own_key, msgspec.json.encode(answers[what]())

    def _ping(self) -> Ping:
        uptime_s = time.time() - self.started_s
        return Ping(stage=self.described.stage, instance=self.instance, pid=os.getpid(), uptime_s=uptime_s)

    def _info(self) -> Info:
        return Info(
            stage=self.described.stage,
            instance=self.instance,
            version=self.described.version,
            handler=self.worker.handler,
            started_s=self.started_s,
            worker_pid=self.worker.pid,
        )

    def _schema(self) -> msgspec.Raw:
        return msgspec.Raw(self.described.schema)

    def _stats(self) -> Stats:
        with self._lock:
            seconds = list(self._seconds)
            served, failed, busy = self._served, self._failed, self._busy
        return Stats(
            stage=self.described.stage,
            instance=self.instance,
            served=served,
            failed=failed,
            busy=busy,
            queued=len(self._requests),
            mean_s=fmean(seconds) if seconds else 0.0,
            # `quantiles` needs two values; of one, the sum is the value, and of none it is 0.
            p95_s=quantiles(seconds, n=20, method="inclusive")[-1] if len(seconds) > 1 else sum(seconds),
            worker_restarts=self.worker.restarts,
            session_rss_bytes=rss_bytes(os.getpid()),
            worker_rss_bytes=rss_bytes(self.worker.pid),
        )
