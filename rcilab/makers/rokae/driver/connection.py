"""A connection in values instead of bytes: requests and their answers, states, commands."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rcilab.core.errors import DeadlineError, DecodeError
from rcilab.core.state import RobotState
from rcilab.makers.rokae.driver.transport import Transport
from rcilab.makers.rokae.wire import (
    CommandPacket,
    Request,
    StateDecoder,
    decode_header,
    decode_response,
    encode_command,
    encode_request,
)

_LOOK = 0.05  # [s] Longest wait between two checks of a request's deadline.


class RciConnection:
    """One connection. Owned by one thread; others may use `request_alongside`.

    Args:
        transport: The wire.
        n: Number of joints of the arm at the other end.
        name: Name of the other end in errors, such as its address.
        timeout: For the answer to a request, [s].
    """

    def __init__(self, transport: Transport, n: int, name: str, timeout: float) -> None:
        self.n = n
        self.name = name
        self.timeout = timeout
        self.latest: RobotState | None = None
        """The newest state received so far."""
        self.received_ns = 0
        """Time of its arrival, monotonic, [ns]."""
        self._empty_ns = 0  # When the socket was last seen empty.
        self._latest_since_ns = 0  # When it was last empty before the newest state arrived.
        self.on_states: Callable[[list[RobotState]], None] = _ignore
        """Called at least every 0.05 s while the answer to a request is awaited, with the states that came in."""
        self._transport = transport
        self._decoder = StateDecoder()
        self._command_id = 0
        self._one_request = threading.Lock()  # Of the TCP connection: a motion's thread and others may send requests.

    @property
    def local_address(self) -> tuple[str, int]:
        """Where states arrive: our address and UDP port."""
        return self._transport.local_address

    @property
    def age(self) -> float:
        """Upper bound of the newest state's age: since the buffer was last empty before it arrived, [s]."""
        return (time.monotonic_ns() - self._latest_since_ns) * 1e-9

    def poll(self, timeout: float) -> list[RobotState]:
        """Returns every state that has arrived, oldest first; waits up to `timeout`, [s], for the first one."""
        deadline = time.monotonic() + timeout
        while self._transport.wait(deadline - time.monotonic()):
            states = self._take_states()  # Empty if the datagrams were no states of this robot.
            if states:
                return states
        return []

    @property
    def has_listener(self) -> bool:
        """Whether `on_states` is set."""
        return self.on_states is not _ignore

    def send(self, packet: CommandPacket) -> None:
        """Sends one command."""
        self._transport.send_command(encode_command(packet))

    def request(self, request: Request, timeout: float | None = None) -> Any:
        """Sends a request and returns its answer; answers to older requests are dropped.

        Raises:
            DeadlineError: No answer within the timeout.
            ConnectionLostError: The connection broke.
            DecodeError: The answer is malformed.
        """
        return self._request(request, timeout, self._wait_and_take_states)

    def request_alongside(self, request: Request, timeout: float | None = None) -> Any:
        """Sends a request while a motion's thread receives the states, from any thread; see `request`."""
        return self._request(request, timeout, self._transport.wait_for_frame)

    def _request(self, request: Request, timeout: float | None, wait: Callable[[float], object]) -> Any:
        limit = self.timeout if timeout is None else timeout
        deadline = time.monotonic() + limit
        with self._one_request:
            self._command_id = self._command_id % 0xFFFFFFFF + 1
            self._transport.send_request(encode_request(request, self._command_id))
            while True:
                frame = self._transport.receive_frame()
                if frame is not None:
                    if decode_header(frame).command_id == self._command_id:
                        return decode_response(request.code, frame)[1]
                    continue
                remaining = deadline - time.monotonic()
                if remaining <= 0.0:
                    raise DeadlineError(
                        f"{self.name} did not answer {type(request).__name__} within {limit:g} s; "
                        "look whether the controller is busy or hangs, and connect again if it goes on"
                    ).coded("no_answer", command=type(request).__name__, seconds=f"{limit:g}")
                wait(min(remaining, _LOOK))

    def _wait_and_take_states(self, timeout: float) -> None:
        is_ready = self._transport.wait(timeout, frames=True)
        self.on_states(self._take_states() if is_ready else [])

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        self._transport.close()

    def _take_states(self) -> list[RobotState]:
        states: list[RobotState] = []
        empty_ns = self._empty_ns
        datagrams = self._transport.receive_states()
        self._empty_ns = self.received_ns = time.monotonic_ns()
        for datagram in datagrams:
            with suppress(DecodeError):  # Of the right size, but no state.
                states.append(self._decoder.decode(datagram, self.n))
        if states:
            self.latest = states[-1]
            self._latest_since_ns = empty_ns
        return states


def _ignore(states: list[RobotState]) -> None:
    """Drops states without a listener."""
