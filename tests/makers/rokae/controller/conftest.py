"""A controller without sockets, and a scripted hand that leads it through its life."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.core.state import RobotState
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm


class Hand:
    """Sends requests and commands to a cycle, one step a command, and keeps every state."""

    def __init__(self, model: RobotModel, plant: str = "ideal", **options: object) -> None:
        sign: Any = options.pop("force_sign", "on-arm")
        arm = VirtualArm(model, build_plant(plant, model), **{"prefill": 0, **options})  # type: ignore[arg-type]
        self.cycle = RciController(arm, mode_delay=3, force_sign=sign)
        self.states: list[RobotState] = [self.cycle.state]

    @property
    def model(self) -> RobotModel:
        return self.cycle.model

    @property
    def state(self) -> RobotState:
        return self.states[-1]

    def step(self, count: int = 1) -> RobotState:
        for _ in range(count):
            self.states.append(self.cycle.step())
        return self.state

    def ask(self, request: rci.Request) -> object:
        """The status (or content) of a reply; steps until it is due."""
        reply = self.cycle.handle(request)
        if reply.when.name == "AT_REST":
            self.step()
            while not self.cycle.is_settled:
                self.step()
        return getattr(reply.response, "status", reply.response)

    def start(self, controller_mode: int = 0, motion_mode: int = 1) -> None:
        """Powers on and starts a motion, up to the first state that shows its modes."""
        assert self.ask(rci.SetMotorPower(1)) == 0
        assert self.ask(rci.StartMove(controller_mode, motion_mode)) == 0
        while self.state.controller_mode != controller_mode:
            self.step()

    def command(self, q: Sequence[float] = (0.0,) * 7, **fields: object) -> RobotState:
        """Answers the newest state and steps."""
        self.cycle.receive(rci.CommandPacket(self.state.message_id, tuple(map(float, q)), **fields))  # type: ignore[arg-type]
        return self.step()

    def pose(self, pose: Pose | np.ndarray, psi: float | None = None, **fields: object) -> RobotState:
        """Answers the newest state with a tool pose and steps."""
        numbers = pose.as_row_major() if isinstance(pose, Pose) else tuple(pose.ravel().tolist())
        return self.command(T_base_tool_c=numbers, psi_valid=psi is not None, psi_c=psi or 0.0, **fields)

    def torque(self, tau: Sequence[float], **fields: object) -> RobotState:
        """Answers the newest state with joint torques and steps."""
        return self.command(tau_c=tuple(map(float, tau)), **fields)

    def torque_only(self, tau: Sequence[float]) -> None:
        """Answers the newest state with joint torques."""
        self.cycle.receive(rci.CommandPacket(self.state.message_id, tau_c=tuple(map(float, tau))))

    def shift(self, offset: Sequence[float], duration: float, psi: float = 0.0) -> RobotState:
        """Moves the commanded tool smoothly by an offset in base, [m], and its arm angle; from rest to rest."""
        start, psi_start = self.state.T_base_tool_c.matrix, self.state.psi_c
        for k in range(1, round(duration * 1000) + 1):
            share = smooth(k / (duration * 1000))
            T = start.copy()
            T[:3, 3] += share * np.asarray(offset)
            if self.pose(T, psi_start + share * psi if psi else None).faults:
                break
        return self.state

    def play(self, rows: np.ndarray) -> RobotState:
        for row in rows:
            self.command(row)
        return self.state

    def rest(self, limit: int = 2000) -> RobotState:
        """Steps until nothing moves."""
        for _ in range(limit):
            if self.step().faults and not (self.state.dq_c.any() or self.state.ddq_c.any()):
                return self.state
            if self.cycle.is_settled:
                return self.state
        raise AssertionError("the arm did not come to rest")

    def box(self, edge: float) -> rci.SetCartesianLimit:
        """An active safety box around where the tool is, [m]."""
        x, y, z = self.state.T_base_tool.position.tolist()
        return rci.SetCartesianLimit((edge,) * 3, (1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1), True)

    def swing(self, joint: int, peak: float, duration: float) -> np.ndarray:
        """Rows that bring one joint (from 1) smoothly to a velocity: a quarter of a (1 - cos) swing, from rest."""
        t = np.arange(1, round(duration * 1000) + 1) / 1000.0
        rows = np.tile(self.state.q_c, (len(t), 1))
        w = math.pi / duration
        rows[:, joint - 1] += peak / 2.0 * (t - np.sin(w * t) / w)
        return rows

    def differences(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Velocity, acceleration and jerk of every recorded commanded angle, by backward differences."""
        q = np.array([state.q_c for state in self.states])
        dq = np.diff(q, axis=0) * 1000.0
        return dq, np.diff(dq, axis=0) * 1000.0, np.diff(dq, 2, axis=0) * 1e6

    def assert_smooth(self) -> None:
        """Every recorded cycle kept the acceleration and jerk limits of the arm."""
        _, ddq, jerk = self.differences()
        limits = self.model.limits.joint
        assert (np.abs(ddq) < limits.acceleration).all(), np.abs(ddq).max(axis=0)
        assert (np.abs(jerk) < limits.jerk).all(), np.abs(jerk).max(axis=0)


def smooth(u: float) -> float:
    """A share from 0 to 1 with no velocity, acceleration and jerk at either end."""
    return u**4 * (35.0 - 84.0 * u + 70.0 * u * u - 20.0 * u**3)


@pytest.fixture
def model() -> RobotModel:
    return load_model("xMatePro7")


@pytest.fixture
def hand(model: RobotModel) -> Hand:
    return Hand(model)


@pytest.fixture
def make_hand():
    def make(name: str = "xMatePro7", plant: str = "ideal", **options: object) -> Hand:
        return Hand(load_model(name), plant, **options)

    return make
