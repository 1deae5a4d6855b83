"""The world port: a second listener, on loopback, through which things happen to the virtual robot from outside.

For the user who started the controller; other accounts of the machine are refused. A guest that says nothing may stay
until another one needs its place. Lines of JSON, see `rcilab.sim.api`. A client that sends a line that is no
request gets one line that says why and is cut off, so that a web page's POST gets nowhere: its first line already is
none, and what follows is not looked at.
"""

from __future__ import annotations

import ipaddress
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import suppress

from rcilab.core.errors import DecodeError, UsageError
from rcilab.sim.api import LineReader, Refused, WorldAnswer, WorldRequest, decode_world_request, encode_world_answer
from rcilab.sim.peer_user import is_ours

MOST_GUESTS = 8  # At once. One script and one page need two.
IDLE = 60.0  # [s] A connection that has been silent for so long gives its place to the next one.
_FALLBACK = "127.0.0.1"  # For a controller that listens on an address which others can reach.
_BYTES_AT_ONCE = 4096


class SimulationPort:
    """Owns the listener and its connections. Never waits; owned by the thread that runs the controller.

    Args:
        host: Address of the controller; the world port is there, too, if that is a loopback address.
        port: TCP port; 0 takes any free one.
        handle: Handles a request.
        clock: Returns the time, [s].

    Raises:
        UsageError: The port cannot be used.
    """

    def __init__(
        self,
        host: str,
        port: int,
        handle: Callable[[WorldRequest], WorldAnswer],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._handle, self._clock = handle, clock
        self._listener = _listen(host if ipaddress.ip_address(host).is_loopback else _FALLBACK, port)
        self._guests: dict[socket.socket, LineReader] = {}
        self._last_message: dict[socket.socket, float] = {}  # When each guest has said something last, [s].
        self.sockets: Sequence[socket.socket] = (self._listener,)
        """Sockets to poll; another object whenever it changes."""

    @property
    def address(self) -> tuple[str, int]:
        """Address of the listener."""
        host, port = self._listener.getsockname()
        return host, port

    def serve(self, readable: Sequence[socket.socket]) -> None:
        """Reads from these sockets and handles the requests."""
        for sock in readable:
            if sock is self._listener:
                self._accept()
            elif sock in self._guests:
                self._read(sock)

    def close(self) -> None:
        """Closes every socket."""
        for sock in (*self._guests, self._listener):
            sock.close()
        self._guests.clear()
        self.sockets = ()

    def _accept(self) -> None:
        try:
            guest, _ = self._listener.accept()
        except OSError:  # It was gone before we looked.
            return
        guest.setblocking(False)
        guest.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if not is_ours(guest):  # Before anything else: a user without access takes no place.
            _turn_away(guest, Refused("this world port is for the user who started the controller"))
            return
        if len(self._guests) >= MOST_GUESTS:
            self._drop_idle()
        if len(self._guests) >= MOST_GUESTS:
            full = UsageError(
                f"all {MOST_GUESTS} places of the world port are taken; close what uses it, or try again later: one "
                f"that has been silent for {IDLE:g} s gives its place up"
            ).coded("world_full", most=MOST_GUESTS, seconds=f"{IDLE:g}")
            _turn_away(guest, Refused(str(full), full.code, full.facts))
            return
        self._guests[guest], self._last_message[guest] = LineReader(), self._clock()
        self.sockets = (self._listener, *self._guests)

    def _read(self, guest: socket.socket) -> None:
        try:
            data = guest.recv(_BYTES_AT_ONCE)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(guest)
            return
        self._last_message[guest] = self._clock()
        try:
            for line in self._guests[guest].feed(data):
                request_id, request = decode_world_request(line)
                answer = request if isinstance(request, Refused) else self._handle(request)
                if not self._answer(guest, answer, request_id):
                    return
        except DecodeError as error:
            if self._answer(guest, Refused(str(error)), 0):
                self._drop(guest)

    def _answer(self, guest: socket.socket, answer: WorldAnswer, request_id: int) -> bool:
        """Sends a response; returns whether the client is still connected."""
        line = encode_world_answer(answer, request_id)
        try:
            is_sent = guest.send(line) == len(line)
        except OSError:
            is_sent = False
        if not is_sent:  # It is gone, or does not read its answers.
            self._drop(guest)
        return is_sent

    def _drop_idle(self) -> None:
        """Drops the client that has been idle for the longest time, if longer than `IDLE`."""
        guest = min(self._last_message, key=self._last_message.__getitem__)
        if self._clock() - self._last_message[guest] > IDLE:
            self._drop(guest)

    def _drop(self, guest: socket.socket) -> None:
        guest.close()
        del self._guests[guest], self._last_message[guest]
        self.sockets = (self._listener, *self._guests)


def _turn_away(guest: socket.socket, why: Refused) -> None:
    with suppress(OSError):  # It is gone already.
        guest.send(encode_world_answer(why, 0))
    guest.close()


def _listen(host: str, port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(MOST_GUESTS)
        listener.setblocking(False)
    except OSError as error:
        listener.close()
        raise UsageError(
            f"the world port {port} on {host} cannot be used ({error.strerror}); choose another with --world-port N "
            "(0 takes any free one), or none with --no-world"
        ) from error
    return listener
