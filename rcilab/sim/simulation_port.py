"""The simulation port: a second listener, on loopback, that controls the environment of the virtual robot.

It serves the user who started the controller; other accounts of the machine are refused. An idle client stays connected
until another one needs its slot. Requests are lines of JSON, see `rcilab.sim.api`. A client whose line is not a valid
request gets one line with the reason and is disconnected; further data is not read. So a web page's POST, whose first
line is not a request, has no effect.

Each call of `serve` reads at most one line of a client, because the cycle of the arm waits meanwhile; the socket stays
readable for the others.
"""

from __future__ import annotations

import ipaddress
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import suppress

from rcilab.core.errors import DecodeError, UsageError
from rcilab.sim.api import LineReader, Refused, WorldAnswer, WorldRequest, decode_world_request, encode_world_answer
from rcilab.sim.peer_user import is_allowed_peer

MAX_CLIENTS = 8  # At once. A tuning value: one script and one page need two.
IDLE_TIMEOUT = 60.0  # [s] A connection that has been idle for longer is closed when another one needs its slot.
_FALLBACK = "127.0.0.1"  # For a controller that listens on an address of the network.
_BYTES_AT_ONCE = 4096


class SimulationPort:
    """Owns the listener and its connections. Never waits; owned by the thread that runs the controller.

    Args:
        host: Address of the controller; the simulation port uses it, too, if it is a loopback address.
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
        self._clients: dict[socket.socket, LineReader] = {}
        self._last_message: dict[socket.socket, float] = {}  # Time of the last message of each client, [s].
        self.sockets: Sequence[socket.socket] = (self._listener,)
        """Sockets to poll; another object whenever it changes."""

    @property
    def address(self) -> tuple[str, int]:
        """Address of the listener."""
        host, port = self._listener.getsockname()
        return host, port

    def serve(self, readable: Sequence[socket.socket]) -> None:
        """Reads from these sockets and handles one request of each."""
        for sock in readable:
            if sock is self._listener:
                self._accept()
            elif sock in self._clients:
                self._read(sock)

    def close(self) -> None:
        """Closes every socket."""
        for sock in (*self._clients, self._listener):
            sock.close()
        self._clients.clear()
        self.sockets = ()

    def _accept(self) -> None:
        try:
            client, _ = self._listener.accept()
        except OSError:  # The client has already disconnected.
            return
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if not is_allowed_peer(client):  # Before anything else: a user without access takes no slot.
            _refuse(client, Refused("this simulation port is for the user who started the controller"))
            return
        if len(self._clients) >= MAX_CLIENTS:
            self._drop_idle()
        if len(self._clients) >= MAX_CLIENTS:
            full = UsageError(
                f"all {MAX_CLIENTS} connections of the simulation port are in use; close one, or try again later: one "
                f"that has been idle for {IDLE_TIMEOUT:g} s is closed when another is needed"
            ).coded("world_full", most=MAX_CLIENTS, seconds=f"{IDLE_TIMEOUT:g}")
            _refuse(client, Refused(str(full), full.code, full.facts))
            return
        self._clients[client], self._last_message[client] = LineReader(), self._clock()
        self.sockets = (self._listener, *self._clients)

    def _read(self, client: socket.socket) -> None:
        try:
            data = client.recv(_BYTES_AT_ONCE, socket.MSG_PEEK)
            data = client.recv(data.find(b"\n") + 1 or _BYTES_AT_ONCE)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        self._last_message[client] = self._clock()
        try:
            for line in self._clients[client].feed(data):
                request_id, request = decode_world_request(line)
                answer = request if isinstance(request, Refused) else self._handle(request)
                if not self._answer(client, answer, request_id):
                    return
        except DecodeError as error:
            if self._answer(client, Refused(str(error)), 0):
                with suppress(OSError):  # Unread bytes would reset the connection, and with it the answer.
                    client.recv(_BYTES_AT_ONCE)
                self._drop(client)

    def _answer(self, client: socket.socket, answer: WorldAnswer, request_id: int) -> bool:
        """Sends a response; returns whether the client is still connected."""
        line = encode_world_answer(answer, request_id)
        try:
            is_sent = client.send(line) == len(line)
        except OSError:
            is_sent = False
        if not is_sent:  # It has disconnected, or does not read its answers.
            self._drop(client)
        return is_sent

    def _drop_idle(self) -> None:
        """Drops the client that has been idle for the longest time, if longer than `IDLE_TIMEOUT`."""
        client = min(self._last_message, key=self._last_message.__getitem__)
        if self._clock() - self._last_message[client] > IDLE_TIMEOUT:
            self._drop(client)

    def _drop(self, client: socket.socket) -> None:
        client.close()
        del self._clients[client], self._last_message[client]
        self.sockets = (self._listener, *self._clients)


def _refuse(client: socket.socket, why: Refused) -> None:
    with suppress(OSError):  # It has already disconnected.
        client.send(encode_world_answer(why, 0))
    client.close()


def _listen(host: str, port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(MAX_CLIENTS)
        listener.setblocking(False)
    except OSError as error:
        listener.close()
        raise UsageError(
            f"the simulation port {port} on {host} cannot be used ({error.strerror}); choose another with "
            "--world-port N (0 takes any free one), or none with --no-world"
        ) from error
    return listener
