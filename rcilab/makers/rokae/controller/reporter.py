"""The reported state: all fields that follow from the reference and the measurement.

Computation of the fields:

* Commanded velocities and accelerations are backward differences of the commanded angles over one cycle, the tool's
  twist is the Jacobian times them, the tool's acceleration the twist's backward difference; the same for the arm angle.
* While forces move the arm (torque commands, hand guiding), the commanded angles are the measured ones.
* The arm angle is undefined if shoulder and wrist are aligned with the base axis or the arm is stretched: its last
  value is then kept, initially 0. On 6-axis arms it is 0.
* `tau_c` is the client's command in torque mode (without gravity), otherwise the torque of the commanded motion by
  the rigid-body model (with gravity). When it changes between the two, its rate is reported as zero.
* External torques are the observer's estimates of what the environment exerts on the arm. `tau_ext_in_base` is the
  wrench on the tool, base axes, at the tool's origin. `tau_ext_in_stiff` is the same wrench at the origin of the force
  frame of setFcCoor, in the axes of its type: WORLD those of the base, TOOL those of the force frame, PATH x along
  the commanded velocity of the tool (at standstill, its last direction), z as near as possible to the force frame's
  z; at a sharp turn of the path its axes turn within 0.5 s. By default the sign is that of the action on the
  arm: a hand that presses down gives a negative z in base axes. With "by-arm" it is that of the arm's action on its
  environment. The manual does not define it, and it is not verified on an arm: a published admittance program that ran
  on one follows the hand with "by-arm" only.
* Motor angles, velocities and torques come from the drive model. Filtered torques pass a first-order low pass at the
  frequency of SetTorqueFilterCutOffFrequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, make_readonly, readonly_copy, scalar
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState, build_state
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import RobotModel
from rcilab.sim.controller_config import ForceSign
from rcilab.sim.drive_report import DriveReport
from rcilab.sim.force_frame import ForceAxes
from rcilab.sim.tool_kinematics import ToolKinematics
from rcilab.sim.virtual_arm import CycleSignals
from rcilab.sim.wrench import wrench_at, wrench_in

_CYCLE = scalar(CYCLE_TIME)  # [s]


class StateReporter:
    """Builds the state of each cycle; at standstill it repeats the last one. Owned by the controller.

    Attributes:
        has_repeated: Whether the last state equals the one before, and the next one will at standstill.

    Args:
        model: The arm with its tool and load.
        settings: The client's settings.
        force_sign: Sign of the reported external forces.
    """

    def __init__(self, model: RobotModel, settings: Settings, force_sign: ForceSign = "on-arm") -> None:
        self._is_by_arm = force_sign == "by-arm"
        self._zeros = readonly_copy(np.zeros(model.n))
        self._axes = ForceAxes(model, settings)
        self.configure(model, settings)

    def configure(self, model: RobotModel, settings: Settings) -> None:
        """Sets a new tool, load, force frame or filter; only at standstill."""
        self._model = model
        self._axes.configure(model, settings)
        self._is_wrench_at_tool = self._axes.is_world and not any(self._axes.T_tool_force.parts[1])
        self._drives = DriveReport(model, settings.torque_report_filter)
        self._body: tuple[Any, ...] | None = None
        self._tau_c = self._zeros
        self._last_signals: CycleSignals | None = None
        self._version = -1
        self._is_settled = False
        self.has_repeated = False
        self._rest: tuple[Any, ...] = ()

    def report(
        self,
        message_id: int,
        signals: CycleSignals,
        *,
        faults: tuple[Fault, ...],
        success_rate: float,
        motion_generator_mode: MotionGeneratorMode,
        controller_mode: ControllerMode,
        robot_mode: RobotMode,
    ) -> RobotState:
        """Returns the state of this cycle."""
        body = self._body
        is_settled = self._is_settled and self._axes.is_settled
        self.has_repeated = body is not None and is_settled and self._is_same(signals)
        if body is None or not self.has_repeated:
            body = self._body = self._compute(signals)
            self._last_signals, self._version = signals, signals.commanded.version
        self._rest = (*body, faults, success_rate, motion_generator_mode, controller_mode, robot_mode)
        return self.repeat(message_id)

    def repeat(self, message_id: int) -> RobotState:
        """Returns the state of a cycle that differs from the last one in its number only."""
        return build_state((message_id, *self._rest))

    def _is_same(self, signals: CycleSignals) -> bool:
        last = self._last_signals
        return (
            last is not None
            and signals.measured is last.measured
            and signals.tau_ext is last.tau_ext
            and signals.tau_c == last.tau_c
            and signals.commanded.version == self._version
        )

    def _compute(self, signals: CycleSignals) -> tuple[Any, ...]:
        """Returns the fields of a state between its number and its faults, in their order."""
        commanded, tool_c, measured, tool, tau_commanded, _, wrench = signals
        if self._is_by_arm and wrench.any():
            wrench = make_readonly(-wrench)
        before = self._last_signals
        q_c, dq_c, ddq_c = commanded.arrays
        if tau_commanded is not None:
            tau_c = readonly_copy(tau_commanded)
        else:
            tau_c = self._model.rigid_body.shared_torque(q_c, dq_c, ddq_c)
        dtau_c = self._zeros
        if before is not None and (tau_commanded is None) == (before.tau_c is None):
            dtau_c = (tau_c - self._tau_c) / _CYCLE
        self._tau_c = tau_c
        is_new = before is None or measured is not before.measured
        drives = self._drives
        theta, dtheta, motor_tau, tau_filtered, motor_tau_filtered = drives.step(measured, commanded.is_stationary)
        self._is_settled = (
            commanded.is_stationary and tool_c.is_stationary and drives.is_settled and not is_new and not dtau_c.any()
        )
        tool_rates_c = make_readonly(np.array([*tool_c.twist, *tool_c.acceleration]))
        return (
            measured.q,
            q_c,
            measured.dq,
            dq_c,
            ddq_c,
            ReportedPose(tool.matrix),
            ReportedPose(tool_c.matrix),
            tool_rates_c[:6],
            tool_rates_c[6:],
            tool.psi,
            tool_c.psi,
            tool_c.dpsi,
            tool_c.ddpsi,
            measured.tau,
            tau_filtered,
            tau_c,
            dtau_c,
            wrench,
            self._in_force_frame(wrench, tool, tool_c.twist[:3]),
            theta,
            dtheta,
            motor_tau,
            motor_tau_filtered,
        )

    def _in_force_frame(self, wrench: Array, tool: ToolKinematics, velocity: Sequence[float]) -> Array:
        """Returns a wrench on the tool (base axes, tool's origin) at the force frame's origin, in its type's axes."""
        self._axes.follow(velocity, tool)
        if self._is_wrench_at_tool:
            return wrench
        if not wrench.any():
            return wrench
        T_base_tool = tool.pose
        T_base_force = T_base_tool @ self._axes.T_tool_force
        moved = wrench_at(wrench, T_base_tool.parts[1], T_base_force.parts[1])
        return moved if self._axes.is_world else wrench_in(moved, self._axes.rotation(T_base_tool))
