"""The sockets of a virtual controller: TCP channels and the UDP streams."""

from __future__ import annotations

import errno
import select
import socket
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rcilab.core.errors import DecodeError, UsageError
from rcilab.sim.arrivals import (
    Arrival,
    ClientConnected,
    ClientDisconnected,
    ClientRefused,
    DatagramArrived,
    ExtraSocketsReady,
    FrameArrived,
    UnknownSenderDetected,
)
from rcilab.sim.channels import LOWEST_CLIENT_PORT, Channel, Framer, Peer, TcpChannel, UdpChannel

CLOSED = "closed the connection"
"""Reason for the end of a connection that its client closed."""

_LARGEST_DATAGRAM = 2048  # Larger than any valid one, so that a wrong length is detected.
_DATAGRAMS_AT_ONCE = 512  # Read in one call; the rest waits for the next, so that a flood cannot delay the cycle.
_UNKNOWN_AT_ONCE = 64  # The same for the shared socket once the client has its own: the rest fills the kernel's buffer.
_UNKNOWN_POLL_INTERVAL = 16  # [polls] Between reads of the shared socket, from then on.
_FRAME_BYTES_AT_ONCE = 4096
_BACKLOG = 8  # [connections] Waiting to be accepted.
_ALLOW = "sysctl net.ipv4.ip_unprivileged_port_start={}"
_ATTEMPTS = 20  # To find a port number that is free for both TCP and UDP.


@dataclass(frozen=True, slots=True, eq=False)
class _Connection:
    peer: Peer
    framer: Framer


class Endpoint:
    """Owns every socket of a controller. Never blocks longer than the timeout.

    Attributes:
        host: Address that it listens on.
        port: TCP port of the main channel.
        warning: What the user should know about the channels; "" without anything.
        unknown_senders: Datagrams that were ignored because they did not come from the client; of a flood, only those
            that were read: the kernel drops the rest if its buffer is full.

    Args:
        host: Address to listen on.
        channels: At least one of TCP, the main one first; at most one of UDP.
        client: Host and port for states from power-up on, for any peer; a port of None: the UDP channel's.
            None: states go to the client that connects.

    Raises:
        UsageError: An address or port cannot be used; the message says what to change.
    """

    def __init__(self, host: str, channels: Sequence[Channel], client: tuple[str, int | None] | None = None) -> None:
        self._listeners, self._datagrams = _open(_resolve(host), channels)
        self._main = next(channel for channel in channels if isinstance(channel, TcpChannel))
        main = next(iter(self._listeners))
        has_port = main.family is socket.AF_INET and self._listeners[main] is self._main
        self.host, self.port = main.getsockname() if has_port else (_resolve(host), self._main.port)
        self.warning = "" if has_port else _describe_socket(self._main)
        udp = next((channel for channel in channels if isinstance(channel, UdpChannel)), None)
        self._own_port = self.port if udp is None or udp.target_port is None else udp.target_port
        self._state_port = self._own_port
        self._is_state_port_only = udp is not None and udp.is_state_port_only
        self._fixed_target: tuple[str, int] | None = None
        if client is not None:
            self._fixed_target = (_resolve(client[0]), self._own_port if client[1] is None else client[1])
        self._target = self._fixed_target
        self._connections: dict[socket.socket, _Connection] = {}
        self._sockets: dict[Peer, socket.socket] = {}
        self._ports: dict[Peer, int] = {}  # For datagrams to clients of other channels than the main one.
        self._owner: Peer | None = None  # The client of the main channel whose datagrams are accepted.
        self._sender: tuple[str, int] | None = None  # Its UDP address, once a datagram has arrived.
        self._has_reported_unknown = False
        self.unknown_senders = 0
        self._arrivals: deque[Arrival] = deque()
        self._client_sockets: dict[socket.socket, tuple[str, int]] = {}  # Connected: receive its datagrams only.
        self._has_client_socket = False  # Whether they receive the client's datagrams.
        self._polls = 0
        self._watched: list[socket.socket] = []
        self._watched_without_shared: list[socket.socket] = []  # Without the shared socket.
        self._separate_client()

    @property
    def options(self) -> str:
        """Options of the address for non-default ports, such as "?udp_port=1338"; "" for default ones."""
        found = [
            (channel.name, listener.getsockname()[1], channel.default_port)
            for listener, channel in self._listeners.items()
            if channel is not self._main and listener.family is socket.AF_INET
        ]
        if self._datagrams is not None:
            sock, channel = self._datagrams
            found.append((channel.name, sock.getsockname()[1], None))
        words = [
            f"{name}={port}" for name, port, default in found if port != (self.port if default is None else default)
        ]
        return "?" + "&".join(words) if words else ""

    @property
    def fixed_target(self) -> tuple[str, int] | None:
        """Host and port for states, independent of the client; None: states go to the client that connects."""
        return self._fixed_target

    @property
    def fixed_host(self) -> str | None:
        """Host of `fixed_target`."""
        return None if self._fixed_target is None else self._fixed_target[0]

    @property
    def peers(self) -> list[Peer]:
        """The connected clients."""
        return list(self._sockets)

    def poll(self, timeout: float, extra_sockets: Sequence[socket.socket] = ()) -> list[Arrival]:
        """Returns the arrivals; waits up to `timeout`, [s], for the first one. Datagrams come before frames.

        Args:
            timeout: Longest wait, [s].
            extra_sockets: Additional sockets to poll.
        """
        self._polls += 1
        reads_shared = self._polls % _UNKNOWN_POLL_INTERVAL == 0 or not self._has_client_socket
        watched = [*(self._watched if reads_shared else self._watched_without_shared), *extra_sockets]
        readable = select.select(watched, (), (), 0.0 if self._arrivals else max(timeout, 0.0))[0]
        if not (readable or self._arrivals):
            return []
        extra: list[socket.socket] = []
        for sock in readable:  # In the order in which they are watched.
            if sock in self._client_sockets:
                self._receive_from_client(sock)
            elif self._datagrams is not None and sock is self._datagrams[0]:
                self._receive_shared(sock)
            elif sock in self._connections:
                self._receive_frames(sock)
            elif sock in self._listeners:
                self._accept(sock)
            elif sock in extra_sockets:
                extra.append(sock)
        if extra:
            self._arrivals.append(ExtraSocketsReady(extra))
        arrivals = list(self._arrivals)
        self._arrivals.clear()
        return arrivals

    def send_datagram(self, datagram: bytes, peer: Peer | None = None) -> None:
        """Sends a datagram to a destination, if it is known. If it cannot be sent, it is lost.

        Args:
            datagram: The bytes.
            peer: A client of another channel than the main one; None: the destination of states.
        """
        target = self._target if peer is None else self._target_of(peer)
        if target is not None and self._datagrams is not None:
            try:
                self._datagrams[0].sendto(datagram, target)
            except OSError:  # No route or no buffer: the state is lost, as on any network.
                return

    def send_frame(self, peer: Peer, frame: bytes) -> None:
        """Sends a frame with a single send call, as the clients of the RCI need it."""
        sock = self._sockets.get(peer)
        if sock is None:
            return
        try:
            sent = sock.send(frame)
        except OSError as error:
            self.drop(peer, f"could not be answered ({error.strerror})")
            return
        if sent < len(frame):
            self.drop(peer, "does not read its answers")

    def drop(self, peer: Peer, reason: str) -> None:
        """Ends a connection; the next `poll` reports it."""
        sock = self._sockets.pop(peer, None)
        if sock is None:
            return
        sock.close()
        del self._connections[sock]
        self._ports.pop(peer, None)
        if peer is self._owner:
            self._owner = self._sender = None
            self._state_port = self._own_port
            self._target = self._fixed_target
            self._separate_client()
        self._watch()
        self._arrivals.append(ClientDisconnected(peer, reason))

    def direct_datagrams(self, peer: Peer, port: int) -> bool:
        """Directs datagrams to a UDP port of this client until it disconnects; returns False for an invalid port.

        A host given with `--client` is kept. A client of another channel than the main one only receives datagrams.
        """
        if not LOWEST_CLIENT_PORT <= port <= 65535 or peer not in self._sockets:
            return False
        if peer.channel is not self._main:
            self._ports[peer] = port
            return True
        if peer is not self._owner:
            self._own(peer)
        self._state_port = port
        self._target = (peer.address if self.fixed_host is None else self.fixed_host, port)
        self._separate_client()
        return True

    def close(self) -> None:
        """Closes every socket."""
        for sock in self._watched:
            _close(sock)
        self._connections.clear()
        self._sockets.clear()
        self._ports.clear()
        self._client_sockets.clear()
        self._watched = []

    def _target_of(self, peer: Peer) -> tuple[str, int] | None:
        port = self._ports.get(peer)
        return None if port is None else (peer.address if self.fixed_host is None else self.fixed_host, port)

    def _own(self, peer: Peer) -> None:
        """Makes a client the one whose datagrams are accepted."""
        self._owner = peer
        self._sender, self._has_reported_unknown = None, False
        if self._fixed_target is None and self._state_port:
            self._target = (peer.address, self._state_port)
        self._separate_client()

    def _separate_client(self) -> None:
        """Opens sockets for the client's datagrams alone: for the port that states go to, and the one it sends from.

        The kernel prefers a connected socket, so that no flood of unknown senders displaces a command.
        """
        self._has_client_socket = False
        wanted = {address for address in (self._target, self._sender) if address is not None}
        for sock, address in list(self._client_sockets.items()):
            if address in wanted:
                wanted.remove(address)
            else:
                del self._client_sockets[sock]
                sock.close()
        for address in wanted:
            self._open_client_socket(address)
        self._watch()

    def _open_client_socket(self, address: tuple[str, int]) -> None:
        if self._datagrams is None:
            return
        shared, channel = self._datagrams
        host, port = shared.getsockname()
        try:
            sock = _bind(socket.SOCK_DGRAM, host, port, channel.option)
        except (OSError, UsageError):  # Out of descriptors: the client keeps using the shared socket.
            return
        try:
            sock.setblocking(False)
            sock.connect(address)
        except OSError:  # No route to this address.
            sock.close()
            return
        self._client_sockets[sock] = address
        for _ in range(_DATAGRAMS_AT_ONCE):  # Until it was connected, it received those of any sender.
            try:
                datagram, sender = sock.recvfrom(_LARGEST_DATAGRAM)
            except OSError:
                break
            if sender == address:
                self._arrivals.append(DatagramArrived(datagram))
            else:
                self.unknown_senders += 1

    def _watch(self) -> None:
        shared = () if self._datagrams is None else (self._datagrams[0],)
        self._watched_without_shared = [*self._client_sockets, *self._connections, *self._listeners]
        self._watched = [*shared, *self._watched_without_shared]  # The shared one first: its datagrams are older.

    def _receive_from_client(self, sock: socket.socket) -> None:
        before = len(self._arrivals)
        for _ in range(_DATAGRAMS_AT_ONCE):
            try:
                self._arrivals.append(DatagramArrived(sock.recv(_LARGEST_DATAGRAM)))
            except BlockingIOError:
                break
            except OSError:  # An earlier state was sent to a closed port.
                continue
        is_known = self._has_client_socket and self._client_sockets[sock] == self._sender
        if not is_known and len(self._arrivals) > before:
            self._sender = self._client_sockets[sock]
            self._separate_client()
            self._has_client_socket = True

    def _receive_shared(self, sock: socket.socket) -> None:
        for _ in range(_UNKNOWN_AT_ONCE if self._has_client_socket else _DATAGRAMS_AT_ONCE):
            try:
                datagram, sender = sock.recvfrom(_LARGEST_DATAGRAM)
            except OSError:  # Nothing more, or an error report that concerns an earlier send.
                return
            if sender == self._sender or self._accepts(sender):
                self._arrivals.append(DatagramArrived(datagram))

    def _accepts(self, sender: tuple[str, int]) -> bool:
        """Returns whether a sender other than the last one is the client; others are counted, the first is reported."""
        client = "" if self._owner is None else self._owner.address
        may_be_other = self._sender is None and not self._is_state_port_only
        if sender[0] in (client, self.fixed_host) and (may_be_other or sender[1] == self._state_port):
            self._sender = sender
            self._separate_client()
            return True
        self.unknown_senders += 1
        if not self._has_reported_unknown:
            self._has_reported_unknown = True
            self._arrivals.append(UnknownSenderDetected("{}:{}".format(*sender), client))
        return False

    def _receive_frames(self, sock: socket.socket) -> None:
        connection = self._connections[sock]
        try:
            data = sock.recv(_FRAME_BYTES_AT_ONCE)
        except BlockingIOError:
            return
        except ConnectionResetError:  # It was closed with states unread.
            data = b""
        except OSError as error:
            self.drop(connection.peer, f"lost the connection ({error.strerror})")
            return
        if not data:
            self.drop(connection.peer, CLOSED)
            return
        try:
            self._arrivals.extend(FrameArrived(connection.peer, frame) for frame in connection.framer.feed(data))
        except DecodeError as error:
            self.drop(connection.peer, f"sent bytes that are not valid {connection.peer.channel.protocol}: {error}")

    def _accept(self, listener: socket.socket) -> None:
        channel = self._listeners[listener]
        try:
            sock, name = listener.accept()
        except OSError:  # It has already disconnected.
            return
        is_local = listener.family is socket.AF_UNIX
        address = "127.0.0.1" if is_local else name[0]
        clients = [peer for peer in self._sockets if peer.channel is channel]
        if len(clients) >= channel.max_clients:
            sock.close()
            self._arrivals.append(ClientRefused(address, tuple(client.address for client in clients)))
            return
        sock.setblocking(False)
        if not is_local:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer = Peer(address, channel)
        self._connections[sock] = _Connection(peer, channel.open_framer())
        self._sockets[peer] = sock
        self._watch()
        if channel is self._main and self._owner is None and self._datagrams is not None:
            self._own(peer)
        self._arrivals.append(ClientConnected(peer))


def _open(
    address: str, channels: Sequence[Channel]
) -> tuple[dict[socket.socket, TcpChannel], tuple[socket.socket, UdpChannel] | None]:
    udp = next((channel for channel in channels if isinstance(channel, UdpChannel)), None)
    main = next(channel for channel in channels if isinstance(channel, TcpChannel))
    attempts = _ATTEMPTS if main.port == 0 and udp is not None and udp.port is None else 1
    while True:
        attempts -= 1
        sockets: list[socket.socket] = []
        try:
            return _open_once(address, channels, sockets)
        except UsageError:
            for sock in sockets:
                _close(sock)
            if attempts <= 0:
                raise


def _open_once(
    address: str, channels: Sequence[Channel], sockets: list[socket.socket]
) -> tuple[dict[socket.socket, TcpChannel], tuple[socket.socket, UdpChannel] | None]:
    """Opens every channel; `sockets` receives the open ones, also if a later one cannot be opened."""
    listeners: dict[socket.socket, TcpChannel] = {}
    datagrams: tuple[socket.socket, UdpChannel] | None = None
    is_denied = False
    for channel in channels:
        if not isinstance(channel, TcpChannel):
            continue
        try:
            sock = _bind(socket.SOCK_STREAM, address, channel.port, channel.option)
        except UsageError as error:
            if not isinstance(error.__cause__, PermissionError) or channel.socket_path is None:
                raise
            is_denied = True
            continue
        sockets.append(sock)
        listeners[sock] = channel
    for channel in channels if is_denied else ():
        if isinstance(channel, TcpChannel) and channel.socket_path is not None:
            sock = _bind_path(channel.socket_path, channel.port)
            sockets.append(sock)
            listeners[sock] = channel
    main = next(iter(listeners))
    for channel in channels:
        if isinstance(channel, UdpChannel):
            if channel.port is None:
                sock = _bind(socket.SOCK_DGRAM, address, main.getsockname()[1], listeners[main].option)
            else:
                # SO_REUSEADDR below lets two sockets share a UDP port unnoticed; this port must really be free.
                _bind(socket.SOCK_DGRAM, address, channel.port, channel.option, shared=False).close()
                sock = _bind(socket.SOCK_DGRAM, address, channel.port, channel.option)
            sockets.append(sock)
            datagrams = (sock, channel)
    for listener, channel in listeners.items():
        try:
            listener.listen(_BACKLOG)
        except OSError as error:  # Another one listens since.
            problem = _explain(error, socket.SOCK_STREAM, address, channel.port, channel.option)
            raise UsageError(problem) from error
    for sock in sockets:
        sock.setblocking(False)
    return listeners, datagrams


def _bind(
    kind: socket.SocketKind, address: str, port: int, option: str | None, *, shared: bool = True
) -> socket.socket:
    sock = socket.socket(socket.AF_INET, kind)
    # On UDP so that the vendor's client, which binds the same port on every address, can run on this machine, too.
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, int(shared))
    try:
        sock.bind((address, port))
    except OSError as error:
        sock.close()
        raise UsageError(_explain(error, kind, address, port, option)) from error
    return sock


def _bind_path(path: Path, port: int) -> socket.socket:
    """Returns a Unix-domain socket; a file that a killed controller has left is replaced."""
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
            if probe.connect_ex(str(path)) == errno.ECONNREFUSED:
                path.unlink()
        sock.bind(str(path))
    except OSError as error:
        sock.close()
        reason = "is in use" if error.errno == errno.EADDRINUSE else f"cannot be used ({error.strerror})"
        raise UsageError(
            f"TCP port {port} needs privileges, and {path}, which clients on this machine use instead, {reason}; stop "
            f"the other controller, start as root, or allow the port: {_ALLOW.format(port)}"
        ) from error
    return sock


def _close(sock: socket.socket) -> None:
    """Closes a socket, and removes the file of a Unix-domain one that listens."""
    name = sock.getsockname() if sock.family is socket.AF_UNIX else ""
    sock.close()
    if name:
        Path(name).unlink(missing_ok=True)


def _describe_socket(channel: TcpChannel) -> str:
    return (
        f"TCP port {channel.port} needs privileges: clients on this machine connect by {channel.socket_path}, whatever "
        "address they name; for other clients, or several controllers, start as root or allow the port: "
        + _ALLOW.format(channel.port)
    )


def _explain(error: OSError, kind: socket.SocketKind, address: str, port: int, option: str | None) -> str:
    name = "TCP" if kind is socket.SOCK_STREAM else "UDP"
    if error.errno == errno.EADDRINUSE:
        others = "controller" if kind is socket.SOCK_STREAM else "controller, or the client that took every address,"
        if option is None:
            return (
                f"{name} port {port} on {address}, on which clients insist, is in use; stop the other {others} there, "
                "or choose another address with --host, such as 127.0.0.3"
            )
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
        return (
            f"{name} port {port} needs privileges; choose one above 1023 with {option} N, start as root, or allow the "
            f"port: {_ALLOW.format(port)}"
        )
    return f"{name} port {port} on {address} cannot be used: {error.strerror}; choose others with --host and {option}"


def _resolve(host: str) -> str:
    try:
        return socket.gethostbyname(host)
    except OSError as error:
        raise UsageError(
            f"{host!r} is not an address that can be resolved; use an IPv4 address such as 127.0.0.2"
        ) from error
