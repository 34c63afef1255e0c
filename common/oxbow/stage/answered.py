"""The last answers of a replica, for a request that is asked again."""

from __future__ import annotations

from collections import OrderedDict

from oxbow.stage.wire import Done, Failed

__all__ = ["Answered"]


class Answered:
    """The newest answers by request id, within `most_bytes` of payload.

    A caller asks again when an answer was lost on its way, as when the router is restarted.
    """

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes = most_bytes
        self._answers: OrderedDict[str, Done | Failed] = OrderedDict()
        self._bytes = 0

    def get(self, request_id: str) -> Done | Failed | None:
        return self._answers.get(request_id)

    def put(self, request_id: str, answer: Done | Failed) -> None:
        """Keep an answer, and forget the oldest ones that no longer fit."""
        self._answers[request_id] = answer
        self._bytes += _size(answer)
        while self._bytes > self.most_bytes:
            _, forgotten = self._answers.popitem(last=False)
            self._bytes -= _size(forgotten)


def _size(answer: Done | Failed) -> int:
    """Bytes that an answer takes, with what comes with every one of them."""
    return 1024 + (len(answer.payload) if isinstance(answer, Done) else 0)
