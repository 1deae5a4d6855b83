"""The supervisor's end of the message rings: requests go out, each has a `PendingRequest` that its reply settles."""

from __future__ import annotations

from contextlib import suppress

from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.message_ring import MessageRing
from rcilab.control_process.messages import End, NumberedRequest, Reply, Request
from rcilab.control_process.pending_request import PendingRequest
from rcilab.core.errors import RcilabError, UsageError


class RequestClient:
    """Sends requests and collects replies; guarded by the lock of its owner.

    Args:
        block: Holds the message rings.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._requests: MessageRing[NumberedRequest] = MessageRing(
            block.requests, block.counters, Counter.REQUESTS_POSTED, Counter.REQUESTS_TAKEN
        )
        self._replies: MessageRing[Reply] = MessageRing(
            block.replies, block.counters, Counter.REPLIES_POSTED, Counter.REPLIES_TAKEN
        )
        self._pending: dict[int, PendingRequest] = {}
        self._next_id = 1

    def send(self, what: str, request: Request) -> PendingRequest:
        """Sends a request and returns what its reply settles.

        Args:
            what: Name of the request, for error messages.
            request: The request.

        Raises:
            UsageError: Too many requests wait already.
        """
        pending = PendingRequest(what)
        self._requests.post(NumberedRequest(self._next_id, request))
        self._pending[self._next_id] = pending
        self._next_id += 1
        return pending

    def send_end(self) -> None:
        """Asks the control process to stop the arm and end."""
        with suppress(UsageError):  # The ring is full: then the control process does not read it anyway.
            self._requests.post(NumberedRequest(0, End()))

    def collect(self) -> list[RcilabError]:
        """Settles the requests that were answered and returns the errors among the answers; does not wait."""
        errors: list[RcilabError] = []
        while (reply := self._replies.take()) is not None:
            pending = self._pending.pop(reply.id, None)
            if pending is not None:
                pending.settle(reply.error)
            if reply.error is not None:
                errors.append(reply.error)
        return errors

    def fail_all(self, error: RcilabError) -> None:
        """Settles every pending request with an error: no reply will come any more."""
        for pending in self._pending.values():
            pending.settle(error)
        self._pending.clear()
