"""One session on the bus: publish, subscribe, answer, query, and be seen alive.

Nothing here knows a message's type: a process that only forwards bytes imports this module alone, and pays for
neither numpy nor shapely.
"""

from __future__ import annotations

import atexit
import logging
import threading
import time
from collections.abc import Callable, Collection, Iterable
from typing import Self

import zenoh
from zenoh.handlers import Callback

from oxbow.bus.config import DEFAULT_ENDPOINT, client_config
from oxbow.bus.keys import require_key
from oxbow.bus.mailbox import Mailbox
from oxbow.bus.query import JSON, Query
from oxbow.bus.questions import Questions
from oxbow.bus.replies import error_of
from oxbow.bus.subscription import Audience, Declared, OnQuery, OnSample, Subscription
from oxbow.errors import Busy, ErrorReply, OxbowError, Unavailable
from oxbow.runtime.closing import Closing
from oxbow.wire.parameters import require_known
from oxbow.wire.waits import checked_wait

__all__ = ["Session"]

OPEN_ATTEMPT_S = 1.0

_log = logging.getLogger(__name__)


class Session(Closing):
    """A client of the router; a context manager that leaves the bus on exit. Safe to share between threads.

    Callbacks run on zenoh's network thread and only put into a bounded queue, since one that takes its time
    stops the whole session. They are `direct`: zenoh's own helper threads would keep a program that forgot to
    close its session from ending.

    Attributes
    ----------
    links
        How often a link to the router came up: what was put between two links was not heard.
    questions
        What is asked, for callers that take replies as they come; see `query`.
    """

    def __init__(self, session: zenoh.Session, endpoint: str) -> None:
        self.endpoint = endpoint
        self.links = 0
        self._session = session
        self._lock = threading.Lock()
        self._subscriptions: list[Subscription] = []
        self._tokens: dict[str, zenoh.LivelinessToken] = {}
        self.questions = Questions(session)
        session.info.declare_transport_events_listener(Callback(self._on_transport, indirect=False))
        # At exit, zenoh must not call back into an interpreter that is gone.
        atexit.register(session.close)

    @classmethod
    def connect(cls, endpoint: str = DEFAULT_ENDPOINT, *, timeout_s: float = 5.0) -> Self:
        """Join the router at `endpoint`.

        Parameters
        ----------
        endpoint
            Where the router listens, as PROTOCOL/ADDRESS.
        timeout_s
            Seconds to wait for it.

        Returns
        -------
        Self
            An open session; it joins again by itself when the router comes back.

        Raises
        ------
        InvalidOption
            The endpoint is not valid, or `timeout_s` is no wait (`oxbow.wire.waits`).
        Unavailable
            Nothing answered at `endpoint` within `timeout_s`.
        """
        give_up = time.monotonic() + checked_wait(timeout_s, "timeout_s")
        while True:
            # zenoh.open is deaf to signals: short attempts keep Ctrl-C working.
            attempt_s = min(OPEN_ATTEMPT_S, max(0.1, give_up - time.monotonic()))
            try:
                return cls(zenoh.open(client_config(endpoint, attempt_s)), endpoint)
            except zenoh.ZError as error:
                if time.monotonic() >= give_up:
                    raise Unavailable(
                        f"no router answers there within {timeout_s:g} s; start one with: oxbow up",
                        where=endpoint,
                    ) from error
                time.sleep(0.05)

    @classmethod
    def join(cls, endpoint: str, is_over: Callable[[], bool]) -> Self | None:
        """Join a router that may not be up yet.

        Parameters
        ----------
        endpoint
            Where the router listens, as PROTOCOL/ADDRESS.
        is_over
            Whether to give up, asked about once a second.

        Returns
        -------
        Self or None
            The session; None where it was given up.
        """
        while not is_over():
            try:
                return cls.connect(endpoint, timeout_s=1.0)
            except Unavailable as error:
                _log.warning("%s; waiting for it", error)
        return None

    def close(self) -> None:
        """Leave the bus: no longer alive, then nothing more received, then what was received is dealt with."""
        if self._session.is_closed():
            return
        # The order matters: first nobody new asks, then what has been accepted is answered, and only then the
        # link goes.
        for key in tuple(self._tokens):
            self.undeclare_live(key)
        for subscription in self._subscriptions:
            subscription.close()
        self._session.close()
        atexit.unregister(self._session.close)

    def publish(
        self, key: str, payload: bytes, *, encoding: str = JSON, urgent: bool = False, droppable: bool = False
    ) -> None:
        """Put a sample.

        A sample put while the router is away is lost: whatever matters is kept by its publisher, which answers
        queries for it.

        Parameters
        ----------
        key
            Where to put it.
        payload
            The sample, encoded.
        encoding
            The MIME type of the payload.
        urgent
            Overtakes other traffic.
        droppable
            Lost rather than waited for on a congested link, and sent after all other traffic.

        Raises
        ------
        Unavailable
            The session is closed.
        InvalidRequest
            The key is not valid.
        """
        priority = zenoh.Priority.INTERACTIVE_HIGH if urgent else zenoh.Priority.DATA
        require_key(key)
        try:
            self._session.put(
                key,
                payload,
                encoding=encoding,
                congestion_control=zenoh.CongestionControl.DROP if droppable else zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.DATA_LOW if droppable else priority,
            )
        except zenoh.ZError as error:
            raise Unavailable(f"cannot publish: {error}", where=key) from error

    def subscribe(self, key_expr: str, on_sample: OnSample, *, queue_size: int = 1024) -> Subscription:
        """Receive samples, one after another, on a thread of this subscription.

        Samples that find the queue full are lost, which is logged.

        Parameters
        ----------
        key_expr
            The keys to receive.
        on_sample
            Called with the key and the payload of each sample; an exception costs that sample only, and is logged.
        queue_size
            Samples that may wait.

        Returns
        -------
        Subscription
            It ends when it or the session is closed.
        """
        mailbox = Mailbox[zenoh.Sample](
            f"subscription {key_expr}",
            lambda sample: on_sample(str(sample.key_expr), sample.payload.to_bytes()),
            size=queue_size,
        )

        def accept(sample: zenoh.Sample) -> None:
            if not mailbox.offer(sample):
                _log.warning("%s: the queue of %d is full; a sample is lost", sample.key_expr, queue_size)

        require_key(key_expr)
        # The mailbox first: samples may arrive before the declaration returns.
        declared = self._session.declare_subscriber(key_expr, Callback(accept, indirect=False))
        return self._keep(Subscription([declared], mailbox))

    def answer(
        self,
        key_expr: str | Iterable[str],
        on_query: OnQuery,
        *,
        parameters: Collection[str] = (),
        workers: int = 1,
        queue_size: int = 64,
    ) -> Subscription:
        """Answer queries (JSON).

        An `OxbowError` travels to the asker unchanged; any other exception is logged and travels as `internal`.
        A query that finds the queue full is answered `busy`, and one with an unknown parameter `invalid_request`.

        Parameters
        ----------
        key_expr
            The keys to answer for, as one expression or several.
        on_query
            Called with the key, the parameters and the payload of each query; gives the replies.
        parameters
            The names of all parameters that a query may have.
        workers
            Threads that answer, for all of the keys together.
        queue_size
            Queries that may wait.

        Returns
        -------
        Subscription
            It ends when it or the session is closed.
        """
        keys = [key_expr] if isinstance(key_expr, str) else list(key_expr)

        def deliver(query: Query) -> None:
            with query:
                try:
                    given = query.parameters
                    require_known(given, parameters)
                    for key, reply in on_query(query.key, given, query.payload):
                        query.reply(key, reply)
                except OxbowError as error:
                    query.fail(ErrorReply.of(error))
                except BaseException as error:  # noqa: BLE001 - becomes an `internal` reply
                    query.fail_of(error, keys[0])

        mailbox = Mailbox[Query](f"answer {keys[0]}", deliver, size=queue_size, workers=workers)

        def accept(query: Query) -> None:
            if not mailbox.offer(query):
                busy = Busy(f"{queue_size} queries are waiting; try again later", where=keys[0])
                with query:
                    query.fail(ErrorReply.of(busy))

        return self._keep(Subscription([self.declare_queryable(key, accept) for key in keys], mailbox))

    def declare_queryable(self, key: str, accept: Callable[[Query], None]) -> Declared:
        """Receive queries on the network thread.

        Parameters
        ----------
        key
            The keys to answer for.
        accept
            Called with each query, which it must hand on at once; where it raises, the query is answered
            `internal`.

        Returns
        -------
        Declared
            To be taken back by `undeclare`; the session does so only when it is closed.
        """
        require_key(key)

        def wrap(zenoh_query: zenoh.Query) -> None:
            query = Query(zenoh_query)
            try:
                accept(query)
            except BaseException as error:  # noqa: BLE001 - zenoh would drop the query without a word
                with query:
                    query.fail_of(error, key)

        return self._session.declare_queryable(key, Callback(wrap, indirect=False))

    def query(
        self,
        selector: str,
        payload: bytes = b"",
        *,
        timeout_s: float,
        attachment: bytes | None = None,
        all_targets: bool = False,
        may_be_empty: bool = False,
    ) -> list[tuple[str, bytes]]:
        """Ask, and wait for all replies.

        Parameters
        ----------
        selector
            A key expression, with ``?name=value;...`` where there are parameters.
        payload
            What to send with the question.
        timeout_s
            Seconds to wait for the replies.
        attachment
            What travels beside the payload, as the `Envelope` of a request to a stage.
        all_targets
            Ask everyone who can answer; an error of one does not hide the replies of others.
        may_be_empty
            Return an empty list where nobody answered.

        Returns
        -------
        list of (str, bytes)
            The key and the payload of each reply.

        Raises
        ------
        OxbowError
            The error that was replied; `DeadlineExceeded` after `timeout_s`; `Unavailable` where nobody answered;
            `InvalidRequest` where the selector is not valid; `InvalidOption` where `timeout_s` is no wait
            (`oxbow.wire.waits`).
        """
        found: list[tuple[str, bytes]] = []
        failure: OxbowError | None = None
        replies = self.questions.ask(
            selector, payload, timeout_s=timeout_s, attachment=attachment, all_targets=all_targets
        )
        for reply in replies:
            if reply.ok is not None:
                found.append((str(reply.ok.key_expr), reply.ok.payload.to_bytes()))
            elif reply.err is not None:
                failure = error_of(reply.err, selector, timeout_s)
        # Of many answerers some may fail; what the others replied is still of use.
        if failure is not None and not (all_targets and found):
            raise failure
        if not found and not may_be_empty:
            raise Unavailable("nobody answers there", where=selector)
        return found

    def audience(self, key_expr: str) -> Audience:
        """Watch whether anyone subscribes to keys that match `key_expr`."""
        require_key(key_expr)
        return Audience(self._session.declare_publisher(key_expr))

    def declare_live(self, key: str) -> None:
        """Be seen alive under `key` until `undeclare_live`, `close`, or the death of this process."""
        require_key(key)
        # Kept, since a token is withdrawn when its object is collected.
        self._tokens[key] = self._session.liveliness().declare_token(key)

    def undeclare_live(self, key: str) -> None:
        """Withdraw the token of `declare_live`."""
        self._tokens.pop(key).undeclare()

    def _watch_liveness(self, key_expr: str, on_change: Callable[[str, bool], None]) -> None:
        """Call `on_change(key, alive)` for every token now and later; on the network thread, so briefly."""

        def accept(sample: zenoh.Sample) -> None:
            try:
                on_change(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)
            except Exception:  # noqa: BLE001 - one token that is not understood must not hide the others
                _log.exception("%s: not understood", sample.key_expr)

        self._session.liveliness().declare_subscriber(key_expr, Callback(accept, indirect=False), history=True)

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        if event.kind == zenoh.SampleKind.PUT:
            self.links += 1
        if event.kind == zenoh.SampleKind.DELETE:
            self.questions.give_up_soon()

    def _keep(self, subscription: Subscription) -> Subscription:
        with self._lock:
            # Closed ones are dropped at this occasion, or a client that follows plan after plan would collect
            # them.
            self._subscriptions = [kept for kept in self._subscriptions if not kept.closed] + [subscription]
        return subscription
