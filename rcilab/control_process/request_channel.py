"""The control process's end of the mail: requests come in, each is answered once."""

from __future__ import annotations

from typing import Any, TypeAlias

from rcilab.control_process.error_codec import pack_failure
from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.message_ring import MessageRing

Letter: TypeAlias = "dict[str, Any]"
"""A request: its id, its kind, and what that takes."""


class RequestChannel:
    """Takes requests and answers them. Owned by the control process's one thread.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._inbox = MessageRing(block.requests, block.words, Counter.REQUESTS_POSTED, Counter.REQUESTS_TAKEN)
        self._outbox = MessageRing(block.replies, block.words, Counter.REPLIES_POSTED, Counter.REPLIES_TAKEN)
        self._put_off: list[Letter] = []

    @property
    def has_new(self) -> bool:
        """Whether a request has come that nobody has seen yet; cheap enough for every cycle."""
        return self._inbox.waiting

    def take_new(self) -> Letter | None:
        """Returns a request that nobody has seen yet, or None."""
        return self._inbox.take()

    def take(self) -> Letter | None:
        """Returns the oldest request, or None."""
        return self._put_off.pop(0) if self._put_off else self._inbox.take()

    def put_off(self, request: Letter) -> None:
        """Keeps a request for later: `take` returns it."""
        self._put_off.append(request)

    def answer(self, request: Letter, error: Exception | None = None) -> None:
        """Says that a request was carried out, or why not."""
        reply: Letter = {"id": request["id"]}
        if error is not None:
            reply["failure"] = pack_failure(error)
        self._outbox.post(reply)
