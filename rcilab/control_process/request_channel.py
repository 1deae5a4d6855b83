"""The control process's end of the message rings: receives requests and replies once to each."""

from __future__ import annotations

from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.message_ring import MessageRing
from rcilab.control_process.messages import NumberedRequest, Reply, as_sendable


class RequestChannel:
    """Receives requests and sends replies. Owned by the control process's one thread.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._requests: MessageRing[NumberedRequest] = MessageRing(
            block.requests, block.counters, Counter.REQUESTS_POSTED, Counter.REQUESTS_READ
        )
        self._replies: MessageRing[Reply] = MessageRing(
            block.replies, block.counters, Counter.REPLIES_POSTED, Counter.REPLIES_READ
        )
        self._deferred: list[NumberedRequest] = []

    @property
    def has_new(self) -> bool:
        """Whether the ring has an unread request; cheap enough for every cycle."""
        return self._requests.has_message

    def pop_new(self) -> NumberedRequest | None:
        """Returns the next unread request, or None."""
        return self._requests.pop()

    def pop(self) -> NumberedRequest | None:
        """Returns the oldest request, deferred ones first, or None."""
        return self._deferred.pop(0) if self._deferred else self._requests.pop()

    def defer(self, request: NumberedRequest) -> None:
        """Queues a request again: `pop` returns it later."""
        self._deferred.append(request)

    def answer(self, request: NumberedRequest, error: Exception | None = None) -> None:
        """Sends the reply to a request: success, or the error."""
        self._replies.post(Reply(request.id, None if error is None else as_sendable(error)))
