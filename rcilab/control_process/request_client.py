"""The desk where requests to the control process are handed in: a ticket for each, settled when the reply comes."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from rcilab.control_process.error_codec import unpack_failure
from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.message_ring import MessageRing
from rcilab.control_process.pending_request import PendingRequest
from rcilab.core.errors import RcilabError, UsageError


class RequestClient:
    """Owns the supervisor's ends of both mailboxes and the tickets under way; guarded by the lock of its owner.

    Args:
        block: Holds the mailboxes.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._requests = MessageRing(block.requests, block.words, Counter.REQUESTS_POSTED, Counter.REQUESTS_TAKEN)
        self._replies = MessageRing(block.replies, block.words, Counter.REPLIES_POSTED, Counter.REPLIES_TAKEN)
        self._tickets: dict[int, PendingRequest] = {}
        self._next_id = 1

    def send(self, what: str, letter: dict[str, Any]) -> PendingRequest:
        """Sends a request and returns the ticket for it.

        Args:
            what: The request, in words.
            letter: The request; its number is added.

        Raises:
            UsageError: Too many requests wait already.
        """
        ticket = PendingRequest(what)
        self._requests.post({"id": self._next_id, **letter})
        self._tickets[self._next_id] = ticket
        self._next_id += 1
        return ticket

    def send_end(self) -> None:
        """Asks the control process to bring the arm to rest and go."""
        with suppress(UsageError):  # A full mailbox: then it does not listen anyway.
            self._requests.post({"id": 0, "kind": "end"})

    def collect(self) -> list[dict[str, Any]]:
        """Settles the tickets that have been answered and returns what failed, see `pack_failure`; does not wait."""
        failures: list[dict[str, Any]] = []
        while (reply := self._replies.take()) is not None:
            ticket = self._tickets.pop(reply["id"], None)
            failure = reply.get("failure")
            if ticket is not None:
                ticket.settle(unpack_failure(failure) if failure else None)
            if failure:
                failures.append(failure)
        return failures

    def fail_all(self, error: RcilabError) -> None:
        """Settles every ticket under way: nobody will answer any more."""
        for ticket in self._tickets.values():
            ticket.settle(error)
        self._tickets.clear()
