"""Pushed states of a controller as neutral states.

A controller reports one set of joint angles: they count as measured and as commanded. It reports neither accelerations
nor torques: these are NaN. Poses come in the current work frame, states have them in base.
"""

from __future__ import annotations

import math
from math import radians

import numpy as np

from rcilab.core.arrays import Array, make_readonly
from rcilab.core.fault import FaultCode
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.spatial import IDENTITY
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState, build_state
from rcilab.makers.realman.driver.push_receiver import NumberedPush
from rcilab.makers.realman.errors import RealManError, errors_of_codes
from rcilab.makers.realman.wire.pushed_state import JointStatus, PushedState, Waypoint
from rcilab.makers.realman.wire.units import SPEED_STEP, pose_from_wire_quaternion

IDLE, PAUSED, STOPPED = "idle", "pause", "stop"
"""What an arm does, as reported."""
_MILLIDEGREE = radians(1e-3)
_SPEED = radians(SPEED_STEP)


class StateReader:
    """Converts the states of one connection. Owned by its thread.

    A value that a state repeats is the same array, so that records can repeat a row.

    Args:
        n: Number of joints.
    """

    def __init__(self, n: int) -> None:
        self.T_base_work = IDENTITY
        """The current work frame."""
        self._unknown, self._six = (make_readonly(np.full(size, np.nan)) for size in (n, 6))
        self._still = make_readonly(np.zeros(n))
        self._q = self._dq = self._unknown
        self._pose = ReportedPose(IDENTITY.matrix)
        self._known: tuple[object, ...] = ()

    def read(self, numbered: NumberedPush, *, is_streaming: bool) -> RobotState:
        """Returns a state.

        Args:
            numbered: The pushed state.
            is_streaming: Whether targets are being sent; an arm that is not stopped then follows them.
        """
        pushed = numbered.pushed
        faults = faults_of(pushed)
        is_moved = is_streaming and not faults and pushed.arm_current_status != STOPPED and is_enabled(pushed)
        self._update(pushed.joint_status, pushed.waypoint)
        q, dq, unknown, six = self._q, self._dq, self._unknown, self._six
        return build_state(
            (
                numbered.number,
                q,
                q,
                dq,
                dq,
                unknown,
                self._pose,
                self._pose,
                six,
                six,
                math.nan,
                math.nan,
                math.nan,
                math.nan,
                unknown,
                unknown,
                unknown,
                unknown,
                six,
                six,
                unknown,
                unknown,
                unknown,
                unknown,
                faults,
                1.0,
                MotionGeneratorMode.JOINT_POSITION if is_moved else MotionGeneratorMode.IDLE,
                ControllerMode.JOINT_POSITION if is_moved else ControllerMode.OTHER,
                _robot_mode(pushed, faults, is_moved=is_moved),
            )
        )

    def _update(self, joints: JointStatus, waypoint: Waypoint) -> None:
        """Replaces the values that differ from those of the state before."""
        known = (joints.joint_position, joints.joint_speed, waypoint.position, waypoint.quat, self.T_base_work)
        if known == self._known:
            return
        self._known = known
        self._q = _scaled(joints.joint_position, _MILLIDEGREE)
        self._dq = self._still if joints.joint_speed is None else _scaled(joints.joint_speed, _SPEED)
        pose = self.T_base_work @ pose_from_wire_quaternion((*waypoint.position, *waypoint.quat))
        self._pose = ReportedPose(make_readonly(pose.matrix.copy()))


def is_enabled(pushed: PushedState) -> bool:
    """Returns whether all joints are enabled."""
    return all(pushed.joint_status.joint_en_flag)


def faults_of(pushed: PushedState) -> tuple[FaultCode, ...]:
    """Returns the errors of a state: those of the system, then those of the joints.

    That a joint is disabled is no error here: `is_enabled` has it.
    """
    joints = pushed.joint_status.joint_err_code
    if not any(pushed.err) and not any(joints):
        return ()
    return tuple(error for error in errors_of_codes(pushed.err, joints) if error is not RealManError.JOINT_DISABLED)


def _robot_mode(pushed: PushedState, faults: tuple[FaultCode, ...], *, is_moved: bool) -> RobotMode:
    if pushed.arm_current_status == STOPPED:
        return RobotMode.USER_STOPPED
    if faults:
        return RobotMode.REFLEX
    return RobotMode.MOVE if is_moved or pushed.arm_current_status not in (IDLE, "") else RobotMode.IDLE


def _scaled(numbers: list[int], unit: float) -> Array:
    return make_readonly(unit * np.array(numbers, dtype=np.float64))
