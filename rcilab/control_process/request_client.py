"""The supervisor's end of the message rings: sends requests and matches replies to their `PendingRequest`."""

from __future__ import annotations

from contextlib import suppress

from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.message_ring import MessageRing
from rcilab.control_process.messages import End, NumberedRequest, Reply, Request
from rcilab.control_process.pending_request import PendingRequest
from rcilab.core.errors import RcilabError, UsageError


class RequestClient:
    """Sends requests and collects replies. Guarded by its owner's lock.

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
        self._pending: dict[int, PendingRequest] = {}
        self._next_id = 1

    def send(self, what: str, request: Request) -> PendingRequest:
        """Sends a request and returns its future.

        Args:
            what: Name of the request, for error messages.
            request: The request.

        Raises:
            UsageError: Too many requests are queued.
        """
        pending = PendingRequest(what)
        self._requests.post(NumberedRequest(self._next_id, request))
        self._pending[self._next_id] = pending
        self._next_id += 1
        return pending

    def send_end(self) -> None:
        """Requests that the control process stops the arm and ends."""
        with suppress(UsageError):  # The ring is full: the control process does not read it.
            self._requests.post(NumberedRequest(0, End()))

    def collect(self) -> list[RcilabError]:
        """Settles the requests that have a reply and returns the errors in the replies; does not wait."""
        errors: list[RcilabError] = []
        while (reply := self._replies.pop()) is not None:
            pending = self._pending.pop(reply.id, None)
            if pending is not None:
                pending.settle(reply.error)
            if reply.error is not None:
                errors.append(reply.error)
        return errors

    def fail_all(self, error: RcilabError) -> None:
        """Settles every pending request with an error: no reply will arrive."""
        for pending in self._pending.values():
            pending.settle(error)
        self._pending.clear()
