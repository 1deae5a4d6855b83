"""A controller without sockets and clock: requests as bytes, answers as bytes, cycles as fast as they compute."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from rcilab.makers.ufactory.controller.xarm_controller import XArmController
from rcilab.makers.ufactory.controller.xarm_server import XArmServer
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.model.robot_model import load_model
from rcilab.sim.channels import Peer
from rcilab.sim.controller_config import PlantKind
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

PROTOCOL = 3
ALL = 8
Q6 = (0.2, -0.5, -0.8, 0.1, 1.1, 0.3)
JOINT_SPEED, JOINT_ACCELERATION = 1.0, 10.0
TOOL_SPEED, TOOL_ACCELERATION = 200.0, 2000.0  # [mm/s], [mm/s^2]


class Link:
    """Keeps what the server sends; a `ClientLink`."""

    def __init__(self) -> None:
        self.sent: dict[Peer, list[bytes]] = {}
        self.logged: list[str] = []

    def send_frame(self, peer: Peer, frame: bytes) -> None:
        self.sent.setdefault(peer, []).append(frame)

    def send_datagram(self, datagram: bytes, peer: Peer | None = None) -> None:
        raise AssertionError("the interface has no datagrams")

    def direct_datagrams(self, peer: Peer, port: int) -> bool:
        return False

    def drop(self, peer: Peer, reason: str) -> None:
        raise AssertionError(reason)

    def log(self, kind: str, text: str, /, **facts: object) -> None:
        self.logged.append(text)


class Arm:
    """A virtual arm and one client of it."""

    def __init__(self, model: str = "xArm6", plant: PlantKind = "ideal") -> None:
        loaded = load_model(model)
        self.controller = XArmController(VirtualArm(loaded, build_plant(plant, loaded, "off")))
        self.server = XArmServer(self.controller, 0)
        self.link = Link()
        self.server.attach(self.link)
        self._transaction = 0
        self.client = self.join(0)

    def join(self, channel: int) -> Peer:
        """Returns a new client of a channel."""
        peer = Peer("127.0.0.1", self.server.channels[channel])
        self.link.sent[peer] = []
        self.server.connect(peer)
        return peer

    def call(self, function: int, code: str = "", *values: Any, client: Peer | None = None) -> tuple[int, bytes]:
        """Returns status and payload of a request's answer."""
        peer = self.client if client is None else client
        self._transaction += 1
        payload = struct.pack(code if code[:1] in "<>" else f"<{code}", *values)
        number, before = struct.pack(">H", self._transaction), len(self.link.sent[peer])
        self.server.receive(peer, number + struct.pack(">HHB", PROTOCOL, 1 + len(payload), function) + payload)
        (frame,) = (f for f in self.link.sent[peer][before:] if f[:2] == number and f[6] != 0xFF)
        assert frame[2:4] == struct.pack(">H", PROTOCOL)
        assert struct.unpack(">H", frame[4:6]) == (len(frame) - 6,)
        assert frame[6] == function
        return frame[7], frame[8:]

    def step(self, cycles: int = 1) -> None:
        for _ in range(cycles):
            self.server.step()
            self.server.send_states()

    def run(self, most: int = 20_000, until: Callable[[], bool] | None = None) -> int:
        """Advances until nothing moves, or until a condition; returns the number of cycles."""
        for cycle in range(1, most + 1):
            self.step()
            if until() if until is not None else not self.controller.is_moving:
                return cycle
        raise AssertionError(f"still waiting after {most} cycles, in state {self.controller.shown_state}")

    def ready(self, mode: int = 0) -> None:
        """Cleans errors, switches the motors on, sets the mode and state 0."""
        self.call(Function.CLEAN_ERROR)
        self.call(Function.CLEAN_WARNING)
        self.call(Function.MOTION_ENABLE, "2B", ALL, 1)
        self.call(Function.SET_STATE, "B", 4)
        self.run()
        self.call(Function.SET_MODE, "2B", mode, 0)
        assert self.call(Function.SET_STATE, "B", 0)[0] == 0
        self.step()

    def ready_again(self) -> None:
        """Sends what `ready` sends, whatever comes of it."""
        for function, values in (
            (Function.CLEAN_ERROR, ()),
            (Function.MOTION_ENABLE, (ALL, 1)),
            (Function.SET_MODE, (0, 0)),
            (Function.SET_STATE, (0,)),
        ):
            self.call(function, f"{len(values)}B", *values)
            self.step()

    def move_joints(self, q: Sequence[float], speed: float = JOINT_SPEED, radius: float | None = None) -> int:
        function = Function.MOVE_JOINT if radius is None else Function.MOVE_JOINT_BLENDED
        padded = (*q, *(0.0,) * (7 - len(q)))
        return self.call(function, "10f", *padded, speed, JOINT_ACCELERATION, radius or 0.0)[0]

    def move_line(self, pose: Sequence[float], speed: float = TOOL_SPEED, radius: float = -1.0) -> int:
        values = (*pose, speed, TOOL_ACCELERATION, 0.0, radius, 0, 0, 0)
        return self.call(Function.MOVE_LINE, "10f3B", *values)[0]

    @property
    def pose(self) -> tuple[float, ...]:
        """Of the tool, [mm, rad]."""
        return struct.unpack("<6f", self.call(Function.GET_TCP_POSE)[1])

    @property
    def q(self) -> list[float]:
        return self.controller.arm.measured_state.measured.q.tolist()

    @property
    def error(self) -> tuple[int, int]:
        """Error and warning."""
        error, warning = self.call(Function.GET_ERROR)[1]
        return error, warning

    @property
    def state(self) -> int:
        return self.call(Function.GET_STATE)[1][0]


@pytest.fixture
def arm() -> Arm:
    """An xArm6 with motors on, in mode 0 and state 2, away from singular poses."""
    arm = Arm()
    arm.ready()
    assert arm.move_joints(Q6) == 0
    arm.run()
    return arm
