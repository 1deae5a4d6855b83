"""Requests to the control process and its replies, in two rings of pickled messages in the shared block.

Each ring has one writer and one reader: `RequestClient` is the supervisor's end, `RequestChannel` that of the control
process, which replies once to each request.
"""

from __future__ import annotations

import pickle
import struct
import threading
from contextlib import suppress
from typing import Generic, TypeVar

from rcilab.control_process.layout import MESSAGE_SIZE, MESSAGE_SLOTS, ControlBlock, Counter
from rcilab.control_process.messages import End, NumberedRequest, Reply, Request, as_sendable
from rcilab.core.errors import DeadlineError, RcilabError, UsageError
from rcilab.makers.configuration import RobotConfiguration
from rcilab.motion.speed_scaling import Shift

_LENGTH = struct.Struct("<I")
_Message = TypeVar("_Message")


class MessageRing(Generic[_Message]):
    """One direction of messages: one process calls `post`, the other `pop`.

    Args:
        slots: Memory of the messages.
        counters: The block's counters.
        posted: The counter of the writer.
        read: The counter of the reader.
    """

    def __init__(self, slots: memoryview, counters: memoryview, posted: Counter, read: Counter) -> None:
        self._slots = slots
        self._counters = counters
        self._posted = posted
        self._read = read

    @property
    def has_message(self) -> bool:
        """Whether there is an unread message; cheap enough for every cycle."""
        return self._counters[self._posted] != self._counters[self._read]

    def post(self, message: _Message) -> None:
        """Appends a message.

        Raises:
            UsageError: The ring is full, because the reader does not read it, or the message is too long.
        """
        data = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        if len(data) > MESSAGE_SIZE - _LENGTH.size:
            raise UsageError(f"a message of {len(data)} bytes is too long: at most {MESSAGE_SIZE - _LENGTH.size} fit")
        posted = self._counters[self._posted]
        if posted - self._counters[self._read] >= MESSAGE_SLOTS:
            raise UsageError(
                f"{MESSAGE_SLOTS} requests are queued already; the control process is too slow, restart it"
            ).coded("too_many")
        start = posted % MESSAGE_SLOTS * MESSAGE_SIZE
        self._slots[start + _LENGTH.size : start + _LENGTH.size + len(data)] = data
        _LENGTH.pack_into(self._slots, start, len(data))
        self._counters[self._posted] = posted + 1  # Last: the reader polls this counter.

    def pop(self) -> _Message | None:
        """Returns the oldest message, or None."""
        if not self.has_message:
            return None
        read = self._counters[self._read]
        start = read % MESSAGE_SLOTS * MESSAGE_SIZE
        (length,) = _LENGTH.unpack_from(self._slots, start)
        data = self._slots[start + _LENGTH.size : start + _LENGTH.size + min(length, MESSAGE_SIZE - _LENGTH.size)]
        self._counters[self._read] = read + 1
        return pickle.loads(data)


class PendingRequest:
    """The future of a request to the control process. Thread-safe.

    Args:
        what: Name of the request, for error messages.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._event = threading.Event()
        self._error: RcilabError | None = None
        self.reported: RobotConfiguration | None = None
        """See `Reply`."""
        self.shifts: tuple[Shift, ...] = ()
        """See `Reply`."""

    @property
    def done(self) -> bool:
        """Whether the request has succeeded or failed. For `execute`: the arm is stationary again."""
        return self._event.is_set()

    @property
    def error(self) -> RcilabError | None:
        """Why it failed; None while it is in progress and if it succeeded.

        A stopped `execute` has a `ControlError` without faults.
        """
        return self._error

    def wait(self, timeout: float | None = None) -> None:
        """Returns once the request has succeeded.

        Args:
            timeout: Timeout, [s]; None: no timeout.

        Raises:
            DeadlineError: It is still in progress after `timeout`; it continues.
            RcilabError: It failed; the same object as `.error`.
        """
        if not self._event.wait(timeout):
            raise DeadlineError(f"{self._what} is still in progress after {timeout:g} s; it continues, wait again")
        if self._error is not None:
            raise self._error

    def settle(
        self,
        error: RcilabError | None = None,
        reported: RobotConfiguration | None = None,
        shifts: tuple[Shift, ...] = (),
    ) -> None:
        """Marks it done; called by the supervisor. Only the first call has an effect."""
        if not self._event.is_set():
            self._error, self.reported, self.shifts = error, reported, shifts
            self._event.set()

    def __repr__(self) -> str:
        state = "in progress" if not self.done else f"failed: {self._error}" if self._error else "done"
        return f"<PendingRequest {self._what}, {state}>"


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

    def answer(
        self,
        request: NumberedRequest,
        error: Exception | None = None,
        reported: RobotConfiguration | None = None,
        shifts: tuple[Shift, ...] = (),
    ) -> None:
        """Sends the reply to a request: success, with what the controller reports after it, or the error.

        `shifts`: see `Reply`.
        """
        self._replies.post(Reply(request.id, None if error is None else as_sendable(error), reported, shifts))


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
                pending.settle(reply.error, reply.reported, reply.shifts)
            if reply.error is not None:
                errors.append(reply.error)
        return errors

    def fail_all(self, error: RcilabError) -> None:
        """Settles every pending request with an error: no reply will arrive."""
        for pending in self._pending.values():
            pending.settle(error)
        self._pending.clear()
