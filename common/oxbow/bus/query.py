"""A question from the bus, as its answerer sees it."""

from __future__ import annotations

import logging
from types import TracebackType
from typing import Self

import msgspec
import zenoh

from oxbow.errors import ErrorReply, Internal, error_text
from oxbow.wire.parameters import parameters_of

__all__ = ["JSON", "MSGPACK", "Query"]

JSON = "application/json"
MSGPACK = "application/msgpack"

_log = logging.getLogger(__name__)


class Query:
    """A query to answer: a context manager, since the asker waits until it is closed."""

    def __init__(self, query: zenoh.Query) -> None:
        self._query = query

    @property
    def key(self) -> str:
        """The key expression that is asked, which may be wider than the answerer's own."""
        return str(self._query.key_expr)

    @property
    def parameters(self) -> dict[str, str]:
        """By name; `InvalidRequest` where one is given twice (`oxbow.wire.parameters`)."""
        return parameters_of(str(self._query.parameters))

    @property
    def size_bytes(self) -> int:
        """The size of the payload, which is not copied for it."""
        return 0 if self._query.payload is None else len(self._query.payload)

    @property
    def payload(self) -> bytes:
        return b"" if self._query.payload is None else self._query.payload.to_bytes()

    @property
    def attachment(self) -> bytes:
        return b"" if self._query.attachment is None else self._query.attachment.to_bytes()

    def reply(self, key: str, payload: bytes, *, encoding: str = JSON, attachment: bytes | None = None) -> None:
        """Give one of any number of replies.

        Parameters
        ----------
        key
            What the reply is about; it must match the key that is asked.
        payload
            The reply, encoded.
        encoding
            The MIME type of the payload.
        attachment
            What travels beside the payload, as the id of a request to a stage.
        """
        self._query.reply(key, payload, encoding=encoding, attachment=attachment)

    def fail(self, error: ErrorReply) -> None:
        """Reply an error; its JSON encoding distinguishes it from zenoh's own."""
        self._query.reply_err(msgspec.json.encode(error), encoding=JSON)

    def fail_of(self, error: BaseException, where: str) -> None:
        """Log an exception that nobody expected, and reply it as `internal`.

        Parameters
        ----------
        error
            What was raised on the way to an answer.
        where
            The keys that are answered for.
        """
        _log.error("%s: no answer", where, exc_info=error)
        self.fail(ErrorReply.of(Internal(error_text(error), where=where)))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Zenoh ends a query when its object is collected, which is too late for the asker, who waits for it.
        self._query.drop()
