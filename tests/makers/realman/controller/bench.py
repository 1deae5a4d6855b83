"""A RealMan server without sockets and clock: requests in, answers, events and datagrams out, one cycle at a time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rcilab.makers.realman.controller.flash import Flash
from rcilab.makers.realman.controller.identity import Generation
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.controller.realman_server import RealManServer
from rcilab.model.robot_model import load_model
from rcilab.sim.channels import Peer
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm


class Bench:
    """A server and one client.

    Attributes:
        controller: The controller.
        events: What came without a request.
        pushed: The datagrams, with the cycle in which each came.
    """

    def __init__(self, model: str = "RM65", *, file: Path | None = None, generation: Generation = 3) -> None:
        arm = load_model(model)
        self.controller = RealManController(VirtualArm(arm, build_plant("ideal", arm)), Flash(file))
        self.server = RealManServer(self.controller, 0, generation)
        self.n = arm.n
        self.frames: list[bytes] = []
        self.events: list[dict[str, Any]] = []
        self.pushed: list[tuple[int, dict[str, Any]]] = []
        self.logged: list[tuple[str, str]] = []
        self.peer = Peer("127.0.0.1", self.server.channels[0])
        self._answers: list[dict[str, Any]] = []
        self.server.attach(self)
        self.server.connect(self.peer)
        self.run(2)

    def send_frame(self, peer: Peer, frame: bytes) -> None:
        assert frame.endswith(b"\r\n")
        self.frames.append(frame)

    def send_datagram(self, datagram: bytes, peer: Peer | None = None) -> None:
        self.pushed.append((self.controller.cycle_number, json.loads(datagram)))

    def direct_datagrams(self, peer: Peer, port: int) -> bool:
        return True

    def drop(self, peer: Peer, reason: str) -> None:
        raise AssertionError(reason)

    def log(self, kind: str, text: str, /, **facts: object) -> None:
        self.logged.append((kind, text))

    def send(self, command: str, **fields: object) -> None:
        """Sends a request."""
        self.server.receive(self.peer, json.dumps({"command": command, **fields}).encode())
        self._sort()

    def ask(self, command: str, **fields: object) -> dict[str, Any]:
        """Returns the answer to a request."""
        self._answers = []
        self.send(command, **fields)
        (answer,) = self._answers
        return answer

    def run(self, cycles: int) -> None:
        """Advances."""
        for _ in range(cycles):
            self.server.step()
            self.server.send_states()
            self.server.settle()
        self._sort()

    def run_until_event(self, most: int = 20000) -> dict[str, Any]:
        """Advances until the end of a trajectory."""
        before = len(self.events)
        for _ in range(most):
            self.run(1)
            if len(self.events) > before:
                return self.events[-1]
        raise AssertionError(f"no event within {most} cycles")

    @property
    def q(self) -> list[int]:
        """The joint angles, [0.001 deg]."""
        return self.ask("get_joint_degree")["joint"]

    @property
    def pose(self) -> list[int]:
        """The pose of the tool in the work frame."""
        return self.ask("get_current_arm_state")["arm_state"]["pose"]

    @property
    def err(self) -> list[int]:
        """The errors of the system."""
        return self.ask("get_current_arm_state")["arm_state"]["err"]

    def _sort(self) -> None:
        for frame in self.frames:
            message = json.loads(frame)
            is_event = message.get("state") == "current_trajectory_state"
            (self.events if is_event else self._answers).append(message)
        self.frames.clear()
