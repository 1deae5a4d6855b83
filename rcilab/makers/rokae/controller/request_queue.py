"""The client's requests, one after the other: handled, answered, some of them only once the arm is at rest."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from rcilab.core.errors import DecodeError
from rcilab.makers.rokae.controller.endpoint import Endpoint
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.makers.rokae.controller.request_handlers import Reply
from rcilab.makers.rokae.controller.state_machine import When
from rcilab.makers.rokae.wire import Connect, Request, decode_request, encode_response
from rcilab.makers.rokae.wire.bounds import LOWEST_CLIENT_PORT
from rcilab.sim.faulty_network import FaultyNetwork


class RequestQueue:
    """Handles requests in order; one whose answer has to wait holds up those behind it. Owned by the server's loop.

    Args:
        cycle: What grants or refuses them.
        endpoint: Where states go, as `Connect` asks.
        network: What carries the answers.
        log: Takes a line about each refusal.
    """

    def __init__(
        self, cycle: RciController, endpoint: Endpoint, network: FaultyNetwork, log: Callable[[str], None]
    ) -> None:
        self._log = log
        self._cycle = cycle
        self._endpoint = endpoint
        self._network = network
        self._frames: deque[bytes] = deque()
        self._pending: tuple[Request, int, Reply] | None = None
        self._asked = 0  # Number of the last state before the request that waits.

    @property
    def is_waiting(self) -> bool:
        """Whether a request was granted whose answer is not due yet."""
        return self._pending is not None

    def take(self, frame: bytes) -> None:
        """Takes a request as it came, and handles it when it is its turn."""
        self._frames.append(frame)
        self._serve()

    def settle(self) -> None:
        """Gives the answer that had to wait if it is due, and goes on to the requests behind it."""
        if self._pending is not None and self._is_due(self._pending[2].when):
            waited, self._pending = self._pending, None
            self._answer(*waited)
            self._serve()

    def _is_due(self, when: When) -> bool:
        is_shown = self._cycle.state.message_id > self._asked
        return is_shown and (when is When.SHOWN or self._cycle.is_settled)

    def clear(self) -> None:
        """Forgets everything: who asked is gone."""
        self._frames.clear()
        self._pending = None

    def _serve(self) -> None:
        """Handles requests in order, up to one whose answer has to wait."""
        while self._frames and self._pending is None:
            frame = self._frames.popleft()
            try:
                command_id, request = decode_request(frame)
            except DecodeError as error:
                self._frames.clear()
                self._network.drop_client(f"sent bytes that are no RCI: {error}")
                return
            reply = self._cycle.handle(request)
            if reply.refusal:
                self._log(reply.refusal)
            if isinstance(request, Connect) and request.udp_port >= LOWEST_CLIENT_PORT:
                self._endpoint.redirect_states(request.udp_port)
            # What was answered is to be seen: after a reply that waits, every state shows the new mode.
            if reply.when is When.NOW:
                self._answer(request, command_id, reply)
            else:
                self._pending, self._asked = (request, command_id, reply), self._cycle.state.message_id

    def _answer(self, request: Request, command_id: int, reply: Reply) -> None:
        self._network.send_frame(encode_response(request.code, command_id, self._cycle.conclude(reply)))
        if reply.ends_connection:
            self._network.drop_client("asked for a reboot")
