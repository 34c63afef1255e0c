"""What a session asks on the bus, and how a question ends when the link to the router does."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import zenoh

from oxbow.bus.keys import require_key
from oxbow.errors import Unavailable
from oxbow.wire.waits import checked_wait

__all__ = ["Questions"]

LINK_LOSS_S = 0.1
"""How long after the loss of the link to the router a query may still leave over it, unnoticed."""


class Questions:
    """The open queries of one session; safe to share between threads."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._open: set[zenoh.CancellationToken] = set()

    def ask(
        self,
        selector: str,
        payload: bytes = b"",
        *,
        timeout_s: float,
        attachment: bytes | None = None,
        all_targets: bool = False,
    ) -> Iterator[zenoh.Reply]:
        """Ask, and take the replies as they come.

        Parameters
        ----------
        selector
            A key expression, with ``?name=value;...`` where there are parameters.
        payload
            What to send with the question.
        timeout_s
            Seconds to wait for the replies.
        attachment
            What travels beside the payload.
        all_targets
            Ask everyone who can answer.

        Yields
        ------
        zenoh.Reply
            A reply, or an error (`oxbow.bus.replies`). None more after the link to the router is lost.

        Raises
        ------
        InvalidRequest
            The selector is not valid.
        InvalidOption
            `timeout_s` is no wait (`oxbow.wire.waits`).
        Unavailable
            The session is closed.
        """
        require_key(selector.partition("?")[0])
        checked_wait(timeout_s, "timeout_s")
        target = zenoh.QueryTarget.ALL if all_targets else zenoh.QueryTarget.BEST_MATCHING
        cancellation = zenoh.CancellationToken()
        self._open.add(cancellation)
        try:
            yield from self._session.get(
                selector,
                payload=payload,
                attachment=attachment,
                timeout=timeout_s,
                target=target,
                # Every reply counts, and the first is of use before the last: none is held back to be merged.
                consolidation=zenoh.ConsolidationMode.NONE,
                cancellation_token=cancellation,
            )
        except zenoh.ZError as error:
            if not cancellation.is_cancelled:
                raise Unavailable(f"cannot ask: {error}", where=selector) from error
        finally:
            self._open.discard(cancellation)

    def give_up_soon(self) -> None:
        """End what was asked before the link was lost: zenoh forgets queries that leave at that very moment."""
        # On another thread: this one is zenoh's, and must not wait.
        give_up = threading.Timer(LINK_LOSS_S, self._give_up)
        give_up.daemon = True
        give_up.start()

    def _give_up(self) -> None:
        # A copy: other threads ask, and end asking, meanwhile.
        for cancellation in tuple(self._open):
            cancellation.cancel()
