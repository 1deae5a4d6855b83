"""The state of a client library as rcilab's own; both libraries name its fields alike.

* Desired values (`_d`) are those that the controller follows: `q_c` is `q_d`. Of the tool it is the commanded pose in a
  Cartesian motion, which its next command has to continue, else the desired one.
* The arm angle is the elbow: the angle of joint 3.
* The interface reports forces that the arm exerts, rcilab those that are exerted on the arm.
* It reports neither rates of commanded torques nor torques of the motors: these are NaN. `theta` is that of the
  motor on the side of the joint.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, make_readonly
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState, build_state
from rcilab.makers.franka.errors import FrankaError

_ROBOT_MODES = {int(mode): mode for mode in RobotMode}
_OTHER_NAMES = {
    FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME_FLAG: (
        "cartesian_position_motion_generator_invalid_frame"
    )
}
_ATTRIBUTES = tuple((error, _OTHER_NAMES.get(error, error.name.lower())) for error in FrankaError)
_JOINTS, _TWIST = 7, 6
_UNKNOWN = make_readonly(np.full(_JOINTS, np.nan))


class StateReader:
    """Converts the states of one connection. Owned by its thread.

    A value that a state repeats is the same array, so that records can repeat a row.
    """

    def __init__(self) -> None:
        self._known: dict[str, tuple[list[float], Any]] = {}

    def read(self, raw: Any, controller: ControllerMode, generator: MotionGeneratorMode) -> RobotState:
        """Returns a state.

        Args:
            raw: The state of the library.
            controller: The controller of the motion in progress; OTHER without one.
            generator: Its motion generator; IDLE without one.
        """
        is_cartesian = generator is MotionGeneratorMode.CARTESIAN_POSITION
        vector, robot_mode = self._vector, _ROBOT_MODES[int(raw.robot_mode)]
        q, dq, tau = vector(raw, "q"), vector(raw, "dq"), vector(raw, "tau_J")
        return build_state(
            (
                number_of(raw),
                q,
                vector(raw, "q_d"),
                dq,
                vector(raw, "dq_d"),
                vector(raw, "ddq_d"),
                self._pose(raw, "O_T_EE"),
                self._pose(raw, "O_T_EE_c" if is_cartesian else "O_T_EE_d"),
                vector(raw, "O_dP_EE_c" if is_cartesian else "O_dP_EE_d"),
                vector(raw, "O_ddP_EE_c"),
                raw.elbow[0],
                (raw.elbow_c if is_cartesian else raw.elbow_d)[0],
                raw.delbow_c[0],
                raw.ddelbow_c[0],
                tau,
                tau,
                vector(raw, "tau_J_d"),
                _UNKNOWN,
                self._wrench(raw, "O_F_ext_hat_K"),
                self._wrench(raw, "K_F_ext_hat_K"),
                vector(raw, "theta"),
                vector(raw, "dtheta"),
                _UNKNOWN,
                _UNKNOWN,
                errors_of(raw.current_errors),
                raw.control_command_success_rate if robot_mode is RobotMode.MOVE else 1.0,
                generator,
                controller,
                robot_mode,
            )
        )

    def _vector(self, raw: Any, name: str) -> Array:
        return self._converted(raw, name, _as_array)

    def _wrench(self, raw: Any, name: str) -> Array:
        return self._converted(raw, name, _as_opposite)

    def _pose(self, raw: Any, name: str) -> ReportedPose:
        return self._converted(raw, name, _as_pose)

    def _converted(self, raw: Any, name: str, convert: Callable[[list[float]], Any]) -> Any:
        values = getattr(raw, name)
        known = self._known.get(name)
        if known is not None and known[0] == values:
            return known[1]
        converted = convert(values)
        self._known[name] = values, converted
        return converted


def number_of(raw: Any) -> int:
    """Returns the number of a state, which the library shows as its time."""
    return round(1e3 * raw.time.to_sec())


def errors_of(errors: Any) -> tuple[FrankaError, ...]:
    """Returns the errors that are set in the library's own type."""
    if not errors:
        return ()
    return tuple(error for error, name in _ATTRIBUTES if getattr(errors, name, False))


def _as_array(values: list[float]) -> Array:
    return make_readonly(np.array(values, dtype=np.float64))


def _as_opposite(values: list[float]) -> Array:
    return make_readonly(0.0 - np.array(values, dtype=np.float64))  # Not -0.0 without any.


def _as_pose(columns: list[float]) -> ReportedPose:
    return ReportedPose(make_readonly(np.array(columns, dtype=np.float64).reshape(4, 4).T.copy()))
