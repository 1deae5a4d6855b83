"""What is sent for a row of a motion in each of the five modes: joint angles, the pose they lead to, or torques.

Joint position and joint impedance take the angles themselves, Cartesian position and Cartesian impedance the pose of
the tool and, on a 7-axis arm, the arm angle. Torque mode takes the torques of a computed-torque controller around the
plan, with gravity and friction left to the robot as the manual has it (4.3):

    tau = M (ddq_d + 2 D w (dq_d - dq) + w^2 (q_d - q)) + C dq

w = `TORQUE_FREQUENCY` and D = `TORQUE_DAMPING` are the same for every joint and small on purpose. This loop closes over
the network: with the play-out of our own virtual controller a torque acts some 45 ms after the state that it answers,
and what is much faster than 10 rad/s cannot be damped across that. The arm is soft: a push moves it, and it comes back.
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

TORQUE_FREQUENCY = 6.0  # [rad/s] A choice, see above.
TORQUE_DAMPING = 0.9  # Of critical; a choice.
TORQUE_SHARE = 0.95  # Part of the torque limits that is commanded at most; a choice.

Commander: TypeAlias = Callable[[JointPath, int, RobotState], Command]
"""`(rows, k, state) -> command`: what to send for row k of rows, shape (N, n), [rad]."""


def build_commander(mode: Mode, model: RobotModel) -> Commander:
    """Returns what turns rows into commands of a mode.

    Args:
        mode: How the arm is commanded.
        model: The arm, with its tool and load as the controller knows them.
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
        except KinematicsError:  # At a singularity; the controller keeps its own.
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
    """Returns where row k is, how fast and how accelerated, by backward differences; before row 0 it stood there.

    So the first torque is that of an arm at rest: nothing, as the torque rate has it.
    """
    now, before, far = rows[k], rows[max(k - 1, 0)], rows[max(k - 2, 0)]
    return now, (now - before) / CYCLE_TIME, (now - 2.0 * before + far) / CYCLE_TIME**2
