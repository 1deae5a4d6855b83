"""Reports of a controller as states.

The arm angle is the angle of joint 3. A controller reports poses in the user frame (`set_world_offset`), states have
them in base. It reports neither commanded torques nor values of the motors: these are NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, make_readonly
from rcilab.core.fault import FaultCode
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState, build_state
from rcilab.makers.ufactory.wire.poses import MILLIMETRE, pose_from_mm_rotation
from rcilab.makers.ufactory.wire.reports import HIGH_RATE

READY_MODE, SERVO_MODE, TEACH_MODE = 0, 1, 2
MOVING, READY, PAUSED, STOPPED, CHANGED = 1, 2, 3, 4, 5
"""States as reported."""
_RUNNING = (0, MOVING, READY)
_MICROSECONDS = 1000  # Per cycle.
_FLOAT = np.dtype("<f4")
_FIELDS = {
    field.name: slice(HIGH_RATE.offsets[field.name], HIGH_RATE.offsets[field.name] + 4 * field.length)
    for field in HIGH_RATE.fields
    if field.code == "f"
}
_TIME = slice(HIGH_RATE.offsets["microseconds"], HIGH_RATE.offsets["microseconds"] + 8)
_SHOWN = HIGH_RATE.offsets["state_and_mode"]
_QUEUED = slice(HIGH_RATE.offsets["queued"], HIGH_RATE.offsets["queued"] + 2)
_TWIST_UNIT = make_readonly(np.array([MILLIMETRE] * 3 + [1.0] * 3))


def shown_by(report: bytes) -> tuple[int, int, int]:
    """Returns state, mode and number of queued motions of a report."""
    number = report[_SHOWN]
    return number & 0xF, number >> 4, int.from_bytes(report[_QUEUED], "big")


class StateReader:
    """Converts the reports of one connection. Owned by its thread.

    A value that a report repeats is the same array, so that records can repeat a row.

    Args:
        n: Number of joints.
    """

    def __init__(self, n: int) -> None:
        self._T_base_user = IDENTITY
        self._n = n
        self._has_psi = n == 7
        self._known: dict[str, tuple[bytes, Any]] = {}
        self._unknown = make_readonly(np.full(n, np.nan))

    @property
    def T_base_user(self) -> Pose:
        """The user frame in base."""
        return self._T_base_user

    @T_base_user.setter
    def T_base_user(self, pose: Pose) -> None:
        if pose is not self._T_base_user:
            self._T_base_user = pose
            self._known.clear()

    def read(
        self, report: bytes, faults: tuple[FaultCode, ...], robot_mode: RobotMode | None, *, is_streaming: bool
    ) -> RobotState:
        """Returns a state.

        Args:
            report: The report.
            faults: The error that is set; reports of this port do not have it.
            robot_mode: The mode of the arm if an error stops it; None: that of the report.
            is_streaming: Whether a motion of this connection is in progress, which mode 1 then is.
        """
        joints, unknown = self._joints, self._unknown
        state, mode, _ = shown_by(report)
        q, q_c, dq_c, ddq_c = (joints(report, name) for name in ("q", "target_q", "target_dq", "target_ddq"))
        tau, wrench = joints(report, "joint_torque"), self._converted(report, "tcp_wrench", _as_array)
        is_moved = is_streaming and mode == SERVO_MODE and state in _RUNNING
        psi = [values[2] if self._has_psi else math.nan for values in (q, q_c, dq_c, ddq_c)]
        return build_state(
            (
                int.from_bytes(report[_TIME], "big") // _MICROSECONDS,
                q,
                q_c,
                joints(report, "dq"),
                dq_c,
                ddq_c,
                self._converted(report, "pose_aa", self._as_pose),
                self._converted(report, "target_pose_aa", self._as_pose),
                self._converted(report, "target_twist", self._as_twist),
                self._converted(report, "target_tcp_acceleration", self._as_twist),
                *psi,
                tau,
                tau,
                unknown,
                unknown,
                wrench,
                wrench,
                unknown,
                unknown,
                unknown,
                unknown,
                faults,
                1.0,
                MotionGeneratorMode.JOINT_POSITION if is_moved else MotionGeneratorMode.IDLE,
                ControllerMode.JOINT_POSITION if is_moved else ControllerMode.OTHER,
                robot_mode or _robot_mode(state, mode, is_moved=is_moved),
            )
        )

    def _joints(self, report: bytes, name: str) -> Array:
        return self._converted(report, name, self._as_joints)

    def _converted(self, report: bytes, name: str, convert: Callable[[bytes], Any]) -> Any:
        data = report[_FIELDS[name]]
        known = self._known.get(name)
        if known is not None and known[0] == data:
            return known[1]
        converted = convert(data)
        self._known[name] = data, converted
        return converted

    def _as_joints(self, data: bytes) -> Array:
        return make_readonly(np.frombuffer(data, _FLOAT)[: self._n].astype(np.float64))

    def _as_pose(self, data: bytes) -> ReportedPose:
        pose = self._T_base_user @ pose_from_mm_rotation(np.frombuffer(data, _FLOAT).tolist())
        return ReportedPose(make_readonly(pose.matrix.copy()))

    def _as_twist(self, data: bytes) -> Array:
        linear, angular = (_as_array(data) * _TWIST_UNIT).reshape(2, 3)
        R_base_user = self._T_base_user.rotation
        return make_readonly(np.concatenate((R_base_user @ linear, R_base_user @ angular)))


def _as_array(data: bytes) -> Array:
    return make_readonly(np.frombuffer(data, _FLOAT).astype(np.float64))


def _robot_mode(state: int, mode: int, *, is_moved: bool) -> RobotMode:
    if mode == TEACH_MODE and state in _RUNNING:
        return RobotMode.GUIDING
    return RobotMode.MOVE if is_moved or state == MOVING else RobotMode.IDLE
