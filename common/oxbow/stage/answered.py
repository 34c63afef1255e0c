"""The last answers of a replica, for requests that are asked again."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from dataclasses import dataclass

from oxbow.errors import InvalidRequest
from oxbow.stage.wire import Done, Failed

__all__ = ["Answered", "digest", "require_same"]


@dataclass(frozen=True)
class _Kept:
    """An answer, and the digest of its request."""

    digest: bytes
    answer: Done | Failed


class Answered:
    """The newest answers by request id, within `most_bytes` of payload.

    A caller asks again when an answer was lost on its way, as when the router is restarted.
    """

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes = most_bytes
        self._kept: OrderedDict[str, _Kept] = OrderedDict()
        self._bytes = 0

    def get(self, request_id: str, request: bytes) -> Done | Failed | None:
        """The answer to a request, None where it is not kept.

        Parameters
        ----------
        request_id
            The id in the request's envelope.
        request
            The encoded request.

        Returns
        -------
        Done, Failed or None
            An error is kept like a reply: the request would end in it again.

        Raises
        ------
        InvalidRequest
            Another request has the same id.
        """
        kept = self._kept.get(request_id)
        if kept is None:
            return None
        require_same(request_id, kept.digest, request)
        return kept.answer

    def put(self, request_id: str, request_digest: bytes, answer: Done | Failed) -> None:
        """Keep the answer to a request, and forget the oldest ones that no longer fit.

        Parameters
        ----------
        request_id
            The id in the request's envelope.
        request_digest
            What `digest` makes of the encoded request.
        answer
            The reply or the error.
        """
        # Popped rather than overwritten: a renewed answer is the newest, also in the order of the dictionary.
        self._forget(self._kept.pop(request_id, None))
        self._kept[request_id] = _Kept(request_digest, answer)
        self._bytes += _size(answer)
        # This may forget the answer just put, if it alone is too large; it has been sent already.
        while self._bytes > self.most_bytes:
            self._forget(self._kept.popitem(last=False)[1])

    def _forget(self, kept: _Kept | None) -> None:
        self._bytes -= 0 if kept is None else _size(kept.answer)


def digest(request: bytes) -> bytes:
    """What distinguishes an encoded request from others."""
    return hashlib.blake2b(request, digest_size=32).digest()


def require_same(request_id: str, known: bytes, request: bytes) -> None:
    """Refuse a request under the id of another one: it would get the other one's answer.

    Parameters
    ----------
    request_id
        The id.
    known
        The digest of the request that has it.
    request
        The encoded request that comes under it now.

    Raises
    ------
    InvalidRequest
        The two differ.
    """
    if digest(request) != known:
        raise InvalidRequest(
            f"is {request_id!r}, the id of another request; expected a unique id", where="request_id"
        )


def _size(answer: Done | Failed) -> int:
    """Bytes that an answer takes, with what comes with every one of them."""
    return 1024 + (len(answer.payload) if isinstance(answer, Done) else 0)
