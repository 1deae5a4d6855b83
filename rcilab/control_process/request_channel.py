"""The control process's end of the message rings: requests come in, each is answered once."""

from __future__ import annotations

from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.message_ring import MessageRing
from rcilab.control_process.messages import NumberedRequest, Reply, as_sendable


class RequestChannel:
    """Takes requests and answers them. Owned by the control process's one thread.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._requests: MessageRing[NumberedRequest] = MessageRing(
            block.requests, block.counters, Counter.REQUESTS_POSTED, Counter.REQUESTS_TAKEN
        )
        self._replies: MessageRing[Reply] = MessageRing(
            block.replies, block.counters, Counter.REPLIES_POSTED, Counter.REPLIES_TAKEN
        )
        self._deferred: list[NumberedRequest] = []

    @property
    def has_new(self) -> bool:
        """Whether a request has arrived that was not taken yet; cheap enough for every cycle."""
        return self._requests.has_message

    def take_new(self) -> NumberedRequest | None:
        """Returns a request that was not taken yet, or None."""
        return self._requests.take()

    def take(self) -> NumberedRequest | None:
        """Returns the oldest request, the deferred ones first, or None."""
        return self._deferred.pop(0) if self._deferred else self._requests.take()

    def defer(self, request: NumberedRequest) -> None:
        """Keeps a request for later: `take` returns it."""
        self._deferred.append(request)

    def answer(self, request: NumberedRequest, error: Exception | None = None) -> None:
        """Reports that a request was carried out, or why not."""
        self._replies.post(Reply(request.id, None if error is None else as_sendable(error)))
