"""The command for a row of a motion in each of the five modes: joint angles, the tool pose, or torques.

Joint position and joint impedance take the angles themselves, Cartesian position and Cartesian impedance the pose of
the tool and, on a 7-axis arm, the arm angle. Torque mode takes the torques of a computed-torque controller around the
plan, with gravity and friction left to the robot as the manual has it (4.3):

    tau = M (ddq_d + 2 D w (dq_d - dq) + w^2 (q_d - q)) + C dq

w = `TORQUE_FREQUENCY` and D = `TORQUE_DAMPING` are the same for every joint and deliberately small. This loop closes
over the network: with the jitter buffer of the virtual controller a torque acts about 45 ms after the state that it
answers, and a bandwidth much above 10 rad/s cannot be damped with that delay. The arm is compliant.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from rcilab.core.arrays import Array, JointPath
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.errors import KinematicsError
from rcilab.core.state import Mode, RobotState

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

TORQUE_FREQUENCY = 6.0  # [rad/s] Below the 10 rad/s that the delay allows, see above.
TORQUE_DAMPING = 0.9  # Of critical: the delay takes some phase, so almost critical.
TORQUE_SHARE = 0.95  # Largest part of the torque limits that is commanded, so that rounding stays inside them.

Commander: TypeAlias = Callable[[JointPath, int, RobotState], Command]
"""`(rows, k, state) -> command`: what to send for row k of rows, shape (N, n), [rad]."""


def build_commander(mode: Mode, model: RobotModel) -> Commander:
    """Returns the function that turns rows into commands of a mode.

    Args:
        mode: Command mode.
        model: The arm, with the tool and load of the controller.
    """
    if mode == "torque":
        return _torques(model)
    return _poses(model) if mode.startswith("cartesian") else _angles


def _angles(rows: JointPath, k: int, state: RobotState) -> Command:
    return JointPosition(rows[k])


def _poses(model: RobotModel) -> Commander:
    has_psi = bool(model.redundancy)

    def command(rows: JointPath, k: int, state: RobotState) -> Command:
        q = rows[k]
        try:
            psi = model.arm_angle(q) if has_psi else None
        except KinematicsError:  # At a singularity; the controller holds its own.
            psi = None
        return CartesianPosition(model.forward(q).matrix, psi)

    return command


def _torques(model: RobotModel) -> Commander:
    stiffness, damping = TORQUE_FREQUENCY**2, 2.0 * TORQUE_DAMPING * TORQUE_FREQUENCY
    largest = TORQUE_SHARE * model.limits.joint.torque
    motion_torque = model.rigid_body.motion_torque

    def command(rows: JointPath, k: int, state: RobotState) -> Command:
        q, dq, ddq = _reference(rows, k)
        ddq = ddq + damping * (dq - state.dq) + stiffness * (q - state.q)
        return JointTorque(np.clip(motion_torque(state.q, state.dq, ddq), -largest, largest))

    return command


def _reference(rows: JointPath, k: int) -> tuple[Array, Array, Array]:
    """Returns position, velocity and acceleration of row k by backward differences, with standstill before row 0.

    The first torque is then zero, as the torque rate requires.
    """
    now, before, earlier = rows[k], rows[max(k - 1, 0)], rows[max(k - 2, 0)]
    return now, (now - before) / CYCLE_TIME, (now - 2.0 * before + earlier) / CYCLE_TIME**2
