"""The sockets of the controller: one TCP client at a time, and the two UDP streams. Bytes in, bytes out, no meaning."""

from __future__ import annotations

import errno
import select
import socket
from collections import deque
from collections.abc import Sequence

from rcilab.core.errors import DecodeError, UsageError
from rcilab.makers.rokae.controller.config import ControllerConfig
from rcilab.makers.rokae.wire import FrameReader
from rcilab.sim.arrivals import (
    Arrival,
    ClientConnected,
    ClientDisconnected,
    ClientRefused,
    DatagramArrived,
    ExtraSocketsReady,
    FrameArrived,
    StrangerDetected,
)

_LARGEST_DATAGRAM = 2048  # Larger than any that is right, so that a wrong length shows.
_DATAGRAMS_AT_ONCE = 512  # Read in one go; the rest waits for the next look, so that no flood can hold us.
_FRAME_BYTES_AT_ONCE = 4096
_ATTEMPTS = 20  # At a number that is free for TCP and UDP alike, when any will do.


class Endpoint:
    """Owns every socket of a controller. Never blocks longer than the timeout.

    Commands count that come from the address of the TCP client, or of `--client`, and from the port that states go to:
    both ends of the RCI have one port number for both ways. A client that sends from another port is taken at its first
    datagram's, until one comes from where states go. Others are strangers.

    Attributes:
        strangers: Datagrams that were ignored because they did not come from the client.

    Args:
        config: Addresses and ports.

    Raises:
        UsageError: An address or port cannot be used; the message says what to change.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._listener, self._datagrams = _open(config)
        self.host, self.port = self._listener.getsockname()
        self.udp_port: int = self._datagrams.getsockname()[1]
        self._own_port = self._state_port = self.port if config.client_port is None else config.client_port
        self._fixed_target = None if config.client_host is None else (_resolve(config.client_host), self._state_port)
        self._target = self._fixed_target
        self._connection: socket.socket | None = None
        self._holder = ""
        self._sender: tuple[str, int] | None = None  # Whose datagrams count, once one has come.
        self._has_named_stranger = False
        self.strangers = 0
        self._reader = FrameReader()
        self._arrivals: deque[Arrival] = deque()

    @property
    def fixed_host(self) -> str | None:
        """Where states go, whichever client connects; None: to the client that connects."""
        return None if self._fixed_target is None else self._fixed_target[0]

    @property
    def has_client(self) -> bool:
        """Whether a client is connected."""
        return self._connection is not None

    def poll(self, timeout: float, extra_sockets: Sequence[socket.socket] = ()) -> list[Arrival]:
        """Returns what has arrived; waits up to `timeout`, [s], for the first thing. Datagrams come before frames.

        Args:
            timeout: Longest wait, [s].
            extra_sockets: Sockets of other parts to be watched, too.
        """
        sockets = [self._datagrams, self._listener, *extra_sockets]
        if self._connection is not None:
            sockets.append(self._connection)
        readable = select.select(sockets, (), (), 0.0 if self._arrivals else max(timeout, 0.0))[0]
        if not (readable or self._arrivals):
            return []
        if self._datagrams in readable:
            self._receive_datagrams()
        if self._connection is not None and self._connection in readable:
            self._receive_frames(self._connection)
        if self._listener in readable:
            self._accept()
        ready = [sock for sock in extra_sockets if sock in readable]
        if ready:
            self._arrivals.append(ExtraSocketsReady(ready))
        arrivals = list(self._arrivals)
        self._arrivals.clear()
        return arrivals

    def send_state(self, datagram: bytes) -> None:
        """Sends a state to where states go; nowhere while that is unknown. A state that cannot be sent is lost."""
        if self._target is not None:
            try:
                self._datagrams.sendto(datagram, self._target)
            except OSError:  # No route, no buffer: the client sees a missing state, as on any network.
                return

    def send_frame(self, frame: bytes) -> None:
        """Sends a response with a single send call, as the vendor's client needs it."""
        if self._connection is None:
            return
        try:
            sent = self._connection.send(frame)
        except OSError as error:
            self.drop_client(f"could not be answered ({error.strerror})")
            return
        if sent < len(frame):
            self.drop_client("does not read its answers")

    def drop_client(self, reason: str) -> None:
        """Ends the connection; the next `poll` reports it."""
        if self._connection is None:
            return
        self._connection.close()
        self._connection = None
        self._state_port = self._own_port
        self._target = self._fixed_target
        self._arrivals.append(ClientDisconnected(reason))

    def redirect_states(self, port: int) -> None:
        """Sends states to another UDP port of this client from now on (the RCI's Connect command)."""
        self._state_port = port
        if self._target is not None:
            self._target = (self._target[0], port)

    def close(self) -> None:
        """Closes every socket."""
        for sock in (self._connection, self._listener, self._datagrams):
            if sock is not None:
                sock.close()
        self._connection = None

    def _receive_datagrams(self) -> None:
        for _ in range(_DATAGRAMS_AT_ONCE):
            try:
                datagram, sender = self._datagrams.recvfrom(_LARGEST_DATAGRAM)
            except OSError:  # Nothing more, or an error report that concerns an earlier send.
                return
            if sender == self._sender or self._accepts(sender):
                self._arrivals.append(DatagramArrived(datagram))

    def _accepts(self, sender: tuple[str, int]) -> bool:
        """Returns whether a sender other than the last one is the client; others are counted, one is named."""
        hosts = {self.fixed_host} if self._connection is None else {self._holder, self.fixed_host}
        if sender[0] in hosts and (self._sender is None or sender[1] == self._state_port):
            self._sender = sender
            return True
        self.strangers += 1
        if not self._has_named_stranger:
            self._has_named_stranger = True
            self._arrivals.append(
                StrangerDetected("{}:{}".format(*sender), "" if self._connection is None else self._holder)
            )
        return False

    def _receive_frames(self, connection: socket.socket) -> None:
        try:
            data = connection.recv(_FRAME_BYTES_AT_ONCE)
        except BlockingIOError:
            return
        except OSError as error:
            self.drop_client(f"connection broke ({error.strerror})")
            return
        if not data:
            self.drop_client("closed the connection")
            return
        try:
            self._arrivals.extend(FrameArrived(frame) for frame in self._reader.feed(data))
        except DecodeError as error:
            self.drop_client(f"sent bytes that are no RCI: {error}")

    def _accept(self) -> None:
        try:
            connection, (address, _) = self._listener.accept()
        except OSError:  # It was gone before we looked.
            return
        if self._connection is not None:
            connection.close()
            self._arrivals.append(ClientRefused(address, self._holder))
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection = connection
        self._holder = address
        self._sender, self._has_named_stranger = None, False
        self._reader = FrameReader()
        if self._fixed_target is None:
            self._target = (address, self._state_port)
        self._arrivals.append(ClientConnected(address))


def _open(config: ControllerConfig) -> tuple[socket.socket, socket.socket]:
    address = _resolve(config.host)
    attempts = _ATTEMPTS if config.port == 0 and config.udp_port is None else 1
    while True:
        attempts -= 1
        listener = _bind(socket.SOCK_STREAM, address, config.port, "--port")
        try:
            if config.udp_port is None:
                datagrams = _bind(socket.SOCK_DGRAM, address, listener.getsockname()[1], "--port")
            else:
                # SO_REUSEADDR below lets two sockets share a UDP port unseen; a number of its own must really be free.
                _bind(socket.SOCK_DGRAM, address, config.udp_port, "--udp-port", shared=False).close()
                datagrams = _bind(socket.SOCK_DGRAM, address, config.udp_port, "--udp-port")
        except UsageError:
            listener.close()
            if attempts <= 0:
                raise
            continue
        listener.listen(8)
        listener.setblocking(False)
        datagrams.setblocking(False)
        return listener, datagrams


def _bind(kind: socket.SocketKind, address: str, port: int, option: str, *, shared: bool = True) -> socket.socket:
    sock = socket.socket(socket.AF_INET, kind)
    # On UDP so that the vendor's client, which binds the same number on every address, can live on this machine too.
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, int(shared))
    try:
        sock.bind((address, port))
    except OSError as error:
        sock.close()
        raise UsageError(_explain(error, kind, address, port, option)) from error
    return sock


def _explain(error: OSError, kind: socket.SocketKind, address: str, port: int, option: str) -> str:
    name = "TCP" if kind is socket.SOCK_STREAM else "UDP"
    if error.errno == errno.EADDRINUSE:
        others = "controller" if kind is socket.SOCK_STREAM else "controller, or the client that took every address,"
        return (
            f"{name} port {port} on {address} is in use; stop the other {others} there, or choose another port "
            f"with {option} N (0 takes any free one)"
        )
    if error.errno == errno.EADDRNOTAVAIL:
        return (
            f"{address} is not an address of this machine; choose one with --host, such as 127.0.0.2, or start the "
            "controller where that address is: ip netns exec NAME rcilab controller …"
        )
    if error.errno == errno.EACCES:
        return f"{name} port {port} needs privileges; choose one above 1023 with {option} N"
    return f"{name} port {port} on {address} cannot be used: {error.strerror}; choose others with --host and {option}"


def _resolve(host: str) -> str:
    try:
        return socket.gethostbyname(host)
    except OSError as error:
        raise UsageError(
            f"{host!r} is not an address that can be resolved; use an IPv4 address such as 127.0.0.2"
        ) from error
