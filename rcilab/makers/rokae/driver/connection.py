"""A connection to a controller: requests and answers over TCP, states and commands over UDP."""

from __future__ import annotations

import errno
import select
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rcilab.core.errors import ConnectionLostError, DeadlineError, DecodeError
from rcilab.core.state import RobotState
from rcilab.makers.network import RECEIVE_BUFFER, no_robot_error
from rcilab.makers.rokae.driver.address import RciAddress, Route, choose_route
from rcilab.makers.rokae.wire import (
    CommandPacket,
    FrameReader,
    Request,
    StateDecoder,
    decode_header,
    decode_response,
    encode_command,
    encode_request,
)

_LARGEST = 2048  # [bytes] More than any datagram of the RCI.
_DATAGRAMS_AT_ONCE = 512  # Read in one call: more states than the buffer holds, so that a flood blocks no caller.
_MS = 1000.0
_LOOK = 0.05  # [s] Longest wait between two checks of a request's deadline.


class RciConnection:
    """A connection in values instead of bytes. Owned by one thread; others may use `request_alongside`.

    Args:
        transport: The sockets.
        n: Number of joints of the arm at the other end.
        name: Name of the other end in errors, such as its address.
        timeout: For the answer to a request, [s].
    """

    def __init__(self, transport: SocketTransport, n: int, name: str, timeout: float) -> None:
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
        self._posted: dict[int, PostedRequest] = {}
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

    def post(self, request: Request) -> PostedRequest:
        """Sends a request, or later if another thread awaits an answer; never waits."""
        posted = PostedRequest(self, request)
        self.send_posted(posted)
        return posted

    def send_posted(self, posted: PostedRequest) -> None:
        """Sends a posted request, unless another thread awaits an answer."""
        if not self._one_request.acquire(blocking=False):
            return
        try:
            self._command_id = self._command_id % 0xFFFFFFFF + 1
            self._transport.send_request(encode_request(posted.request, self._command_id))
            self._posted[self._command_id] = posted
            posted.is_sent = True
        finally:
            self._one_request.release()

    def receive_posted(self) -> None:
        """Takes the answers to posted requests that have arrived, unless another thread receives answers."""
        if not self._one_request.acquire(blocking=False):
            return
        try:
            while (frame := self._transport.receive_frame()) is not None:
                self._take_posted(frame)
        finally:
            self._one_request.release()

    def _take_posted(self, frame: bytes) -> None:
        """Keeps a frame that answers a posted request; drops any other one."""
        posted = self._posted.pop(decode_header(frame).command_id, None)
        if posted is not None:
            posted.answer = decode_response(posted.request.code, frame)[1]

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
                    self._take_posted(frame)
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


class PostedRequest:
    """A request that was sent without waiting for its answer.

    Attributes:
        request: The request.
        is_sent: Whether it was sent.
        answer: Its answer; None until then.

    Args:
        connection: The connection.
        request: As the attribute.
    """

    def __init__(self, connection: RciConnection, request: Request) -> None:
        self.request, self._connection = request, connection
        self.is_sent = False
        self.answer: Any = None

    def poll(self) -> Any:
        """Returns the answer, or None until it arrives; never waits.

        Raises:
            ConnectionLostError: The connection broke.
            DecodeError: The answer is malformed.
        """
        if self.answer is None:
            if self.is_sent:
                self._connection.receive_posted()
            else:
                self._connection.send_posted(self)
        return self.answer


def _ignore(states: list[RobotState]) -> None:
    """Drops states without a listener."""


class SocketTransport:
    """The sockets of a connection; it sends and receives bytes. Owned by one thread.

    Args:
        address: Address of the robot.
        state_size: Bytes of a state datagram; others are counted in `foreign` and dropped.
        timeout: For the TCP connection, [s].

    Raises:
        ConnectionLostError: The robot cannot be reached, or the port for states is taken.
    """

    def __init__(self, address: RciAddress, state_size: int, timeout: float) -> None:
        self.address = address
        self.foreign = 0
        """Number of datagrams that were read and dropped because of their size or sender."""
        self._state_size = state_size
        route = choose_route(address)
        self._robot_host = route.robot_udp[0]
        self._frames: list[bytes] = []
        self._was_answered = False
        self._reader = FrameReader()
        self._udp, rest = _bind_udp(address, route)
        self._rest: socket.socket | None = rest  # For other ports; until a state arrives at the other socket.
        self._other_port: int | None = None  # The robot's port that states come from.
        try:
            self._tcp = _connect_tcp(address, route, timeout)
        except BaseException:
            self._udp.close()
            rest.close()
            raise
        self._tcp_number = self._tcp.fileno()
        self._states_ready = select.poll()
        self._states_ready.register(self._udp, select.POLLIN)
        self._states_ready.register(rest, select.POLLIN)
        self._states_ready.register(self._tcp, select.POLLRDHUP)
        self._frames_ready = select.poll()
        self._frames_ready.register(self._tcp, select.POLLIN)
        self._anything_ready = select.poll()
        self._anything_ready.register(self._udp, select.POLLIN)
        self._anything_ready.register(rest, select.POLLIN)
        self._anything_ready.register(self._tcp, select.POLLIN)

    @property
    def local_address(self) -> tuple[str, int]:
        """Where states come to: our address and UDP port."""
        host, port = self._udp.getsockname()
        return host, port

    def send_request(self, frame: bytes) -> None:
        """Sends one TCP frame."""
        try:
            self._tcp.sendall(frame)
        except OSError as error:
            raise self._lost(error) from error

    def receive_frame(self) -> bytes | None:
        """Returns the next complete TCP frame that has arrived, or None; does not wait."""
        while not self._frames:
            try:
                piece = self._tcp.recv(4096)
            except (BlockingIOError, InterruptedError):
                return None
            except OSError as error:
                raise self._lost(error) from error
            if not piece:
                raise self._lost(None)
            self._was_answered = True
            try:
                self._frames += self._reader.feed(piece)
            except DecodeError as error:
                raise ConnectionLostError(f"{self.address}: what answers there does not speak RCI: {error}").coded(
                    "no_rci", address=str(self.address)
                ) from error
        return self._frames.pop(0)

    def receive_states(self) -> list[bytes]:
        """Returns the state datagrams that have arrived, oldest first; does not wait.

        States are accepted from the robot's address, and from the port that commands go to. From another port they are
        accepted from the first one, until one comes from the port that commands go to.
        """
        states: list[bytes] = []
        for _ in range(_DATAGRAMS_AT_ONCE):
            try:
                datagram = self._udp.recv(_LARGEST)
            except (BlockingIOError, InterruptedError):
                break
            except ConnectionError:  # An earlier command met a closed port; its ICMP answer contains nothing new.
                continue
            if len(datagram) == self._state_size:
                states.append(datagram)
            else:
                self.foreign += 1
            if not self._states_ready.poll(0):  # A third of the time of an exception, and there is mostly just one.
                break
        if self._rest is not None:
            if not states:
                return self._receive_from_other_port(self._rest)
            self._states_ready.unregister(self._rest)
            self._anything_ready.unregister(self._rest)
            self._rest.close()
            self._rest = None
        return states

    def _receive_from_other_port(self, udp: socket.socket) -> list[bytes]:
        """Returns the states of a robot that sends them from another port than commands go to."""
        states: list[bytes] = []
        for _ in range(_DATAGRAMS_AT_ONCE):
            try:
                datagram, (host, port) = udp.recvfrom(_LARGEST)
            except (BlockingIOError, InterruptedError):
                break
            except ConnectionError:
                continue
            if len(datagram) != self._state_size or host != self._robot_host or port != (self._other_port or port):
                self.foreign += 1
                continue
            states.append(datagram)
            if self._other_port is None:
                self._other_port = port
                udp.connect((host, port))  # From here on its buffer, too, accepts no datagrams of unknown senders.
        return states

    def send_command(self, datagram: bytes) -> None:
        """Sends one command datagram; a full or refusing network drops it, as the network may at any time."""
        try:
            self._udp.send(datagram)
        except (BlockingIOError, InterruptedError, ConnectionError):
            pass
        except OSError as error:
            raise self._lost(error) from error

    def wait(self, timeout: float, *, frames: bool = False) -> bool:
        """Returns once a state (or with `frames` a piece of a TCP frame) is there, or False after `timeout`, [s].

        Raises:
            ConnectionLostError: No state is there, and the other side has closed the connection.
        """
        if frames and self._frames:
            return True
        if frames:
            return bool(self._anything_ready.poll(max(0.0, timeout) * _MS))
        events = self._states_ready.poll(max(0.0, timeout) * _MS)
        if len(events) == 1 and events[0][0] == self._tcp_number:
            raise self._lost(None)
        return bool(events)

    def wait_for_frame(self, timeout: float) -> bool:
        """Returns once a piece of a TCP frame is there, or False after `timeout`, [s]; leaves states alone."""
        return bool(self._frames) or bool(self._frames_ready.poll(max(0.0, timeout) * _MS))

    def close(self) -> None:
        """Ends both channels. May be called twice."""
        self._tcp.close()
        self._udp.close()
        if self._rest is not None:
            self._rest.close()

    def _lost(self, error: OSError | None) -> ConnectionLostError:
        reason = "it closed the connection" if error is None else (error.strerror or str(error))
        if not self._was_answered:
            return ConnectionLostError(
                f"{self.address}: the controller ended the connection before its first answer ({reason}), probably "
                "because another client is connected: it takes one at a time; close that one and connect again"
            )
        return ConnectionLostError(
            f"{self.address}: the connection is lost ({reason}); look whether the controller runs, and connect again"
        )


def _bind_udp(address: RciAddress, route: Route) -> tuple[socket.socket, socket.socket]:
    """Returns a socket that is connected to the robot, and one for datagrams from elsewhere to the same port of ours.

    The kernel prefers the connected one. Only these two share the port: another client of the robot finds it taken.
    """
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    rest = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        for sock in (udp, rest):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            sock.setblocking(False)
        rest.bind(route.local_udp)
        for sock in (udp, rest):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        udp.bind(route.local_udp)
        for sock in (udp, rest):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)
        udp.connect(route.robot_udp)
        with suppress(BlockingIOError):
            while True:
                udp.recv(_LARGEST)  # Until it was connected, it accepted any sender.
    except OSError as error:
        udp.close()
        rest.close()
        host, port = route.local_udp
        if error.errno == errno.EADDRINUSE:
            raise ConnectionLostError(
                f"{address}: states would come to UDP port {port} of {host}, and a program here already listens "
                "there, probably another client of this robot; close it and connect again"
            ).coded("port_taken", address=str(address), port=port) from error
        raise ConnectionLostError(f"{address}: cannot receive at {host}:{port}: {error.strerror or error}").coded(
            "no_port", address=str(address), port=port
        ) from error
    return udp, rest


def _connect_tcp(address: RciAddress, route: Route, timeout: float) -> socket.socket:
    tcp = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    start = time.monotonic()
    try:
        tcp.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        tcp.settimeout(timeout)
        tcp.bind(route.local_tcp)
        tcp.connect(route.robot_tcp)
        tcp.setblocking(False)
    except OSError as error:
        tcp.close()
        advice = (
            "check that it is switched on, that its IP address and port are those "
            "of the teach pendant's RCI page with RCI enabled there, and that the cable and no firewall is in between; "
            "a virtual one is started with, for example: rcilab controller --model xMatePro7"
        )
        raise no_robot_error(address, error, time.monotonic() - start, timeout, advice) from error
    return tcp
