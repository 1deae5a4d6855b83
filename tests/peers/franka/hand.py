"""The client of the hand as the wire sees it, version 3: ten bytes of header. Shares no code with the package."""

from __future__ import annotations

import socket
import struct
from typing import NamedTuple

from tests.peers.franka.robot import PATIENCE

CONNECT, HOMING, GRASP, MOVE, STOP = range(5)
STATUSES = ("success", "fail", "unsuccessful", "aborted")
STATE_SIZE = 23  # [bytes]


class HandState(NamedTuple):
    """A received state."""

    number: int
    width: float
    max_width: float
    is_grasped: bool
    temperature: int


class Hand:
    """A program's connection to the fingers.

    Args:
        host: Address of the controller.
        port: TCP port of the hand.
        version: That the client names.
    """

    def __init__(self, host: str, port: int, version: int = 3) -> None:
        self.tcp = socket.create_connection((host, port), timeout=PATIENCE)
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.bind(("0.0.0.0", 0))
        self.udp.settimeout(PATIENCE)
        self._id = 0
        try:
            self.send(CONNECT, struct.pack("<HH", version, self.udp.getsockname()[1]))
            answer = self._receive(14)
        except BaseException:
            self.close()
            raise
        self.status, self.server_version = struct.unpack("<HH", answer[10:])

    def close(self) -> None:
        self.tcp.close()
        self.udp.close()

    def __enter__(self) -> Hand:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send(self, command: int, payload: bytes = b"") -> int:
        """Sends a command; returns its id."""
        self._id += 1
        self.tcp.sendall(struct.pack("<HII", command, self._id, 10 + len(payload)) + payload)
        return self._id

    def response(self) -> tuple[int, str]:
        """Waits for the next answer; returns its id and status."""
        _, number, size, status = struct.unpack("<HIIH", self._receive(12))
        assert size == 12
        return number, STATUSES[status]

    def ask(self, command: int, *values: float) -> str:
        """Sends a command and waits for its answer."""
        number = self.send(command, struct.pack(f"<{len(values)}d", *values))
        answered, status = self.response()
        assert answered == number
        return status

    def state(self) -> HandState:
        """Waits for the next state; earlier ones are skipped."""
        self.udp.setblocking(False)
        try:
            while True:
                self.udp.recv(4096)
        except BlockingIOError:
            pass
        finally:
            self.udp.settimeout(PATIENCE)
        data = self.udp.recv(4096)
        assert len(data) == STATE_SIZE
        return HandState(*struct.unpack("<Idd?H", data))

    def _receive(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            part = self.tcp.recv(size - len(data))
            if not part:
                raise ConnectionResetError("the controller closed the connection")
            data += part
        return data
