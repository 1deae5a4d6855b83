"""The state as the controller reports it: everything that follows from where the arm is told to be and where it is.

What this virtual arm knows and how (each documented here because a state must not lie):

* Commanded velocities and accelerations are backward differences of the commanded angles over one cycle, the tool's
  twist is the Jacobian times them, the tool's acceleration the twist's backward difference.
* The drive ratio is one and the joints are stiff: motor angles, velocities and torques equal those of the joints.
* The arm angle is undefined where shoulder and wrist are one above the other or the arm is stretched: there its last
  value stays, and at first 0. On 6-axis arms it is 0.
* Filtered torques pass a first-order low pass at the frequency of SetTorqueFilterCutOffFrequency.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rcilab.arrays import Array, JointVector, Matrix, frozen
from rcilab.clock import CYCLE_TIME
from rcilab.controller.commanded import CommandedMotion
from rcilab.controller.plant import Measurement
from rcilab.controller.settings import MAX_FREQUENCY, Settings
from rcilab.errors import SingularError
from rcilab.faults import Fault
from rcilab.model import RobotModel
from rcilab.spatial import Pose
from rcilab.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState

_SETTLED_TORQUE = 1e-6  # [N m] A filtered torque this close to the true one takes its value, so that rest is rest.


class StateReporter:
    """Builds the state of each cycle; while nothing moves it repeats the last one. Owned by the controller's cycle.

    Args:
        model: The arm with its tool and load.
        settings: What the client has set.
    """

    def __init__(self, model: RobotModel, settings: Settings) -> None:
        self._zeros = frozen(np.zeros(model.n))
        self._zeros6 = frozen(np.zeros(6))
        self.configure(model, settings)

    def configure(self, model: RobotModel, settings: Settings) -> None:
        """Takes a new tool, load, force frame or filter; only while the arm is at rest."""
        self._model = model
        self._T_tool_force = model.T_flange_tool.inverse() @ settings.T_flange_force
        self._gain = _low_pass_gain(settings.torque_report_filter)
        self._state: RobotState | None = None
        self._measurement: Measurement | None = None
        self._version = -1
        self._is_settled = False
        self._psi = self._psi_c = self._dpsi_c = 0.0

    def report(
        self,
        message_id: int,
        commanded: CommandedMotion,
        measurement: Measurement,
        *,
        faults: tuple[Fault, ...],
        success_rate: float,
        motion_generator_mode: MotionGeneratorMode,
        controller_mode: ControllerMode,
        robot_mode: RobotMode,
    ) -> RobotState:
        """Returns the state of this cycle."""
        is_same = measurement is self._measurement and commanded.version == self._version
        base = self._state if is_same and self._is_settled else None
        if base is None:
            base = self._compute(commanded, measurement)
        state = self._state = replace(
            base,
            message_id=message_id,
            faults=faults,
            success_rate=success_rate,
            motion_generator_mode=motion_generator_mode,
            controller_mode=controller_mode,
            robot_mode=robot_mode,
        )
        self._measurement, self._version = measurement, commanded.version
        return state

    def _compute(self, commanded: CommandedMotion, measured: Measurement) -> RobotState:
        model, last, h = self._model, self._state, CYCLE_TIME
        q_c, dq_c, ddq_c = frozen(commanded.q), frozen(commanded.dq), frozen(commanded.ddq)
        is_exact = measured.q.tolist() == commanded.q
        pose_c = model.forward(q_c)
        pose = pose_c if is_exact else model.forward(measured.q)
        twist_c = self._zeros6 if commanded.is_at_rest else model.jacobian(q_c) @ dq_c
        acceleration_c = self._zeros6 if last is None else (twist_c - last.tool_velocity_c) / h
        psi_c = self._arm_angle(q_c, self._psi_c)
        psi = psi_c if is_exact else self._arm_angle(measured.q, self._psi)
        dpsi_c = 0.0 if last is None else math.remainder(psi_c - self._psi_c, math.tau) / h
        ddpsi_c = 0.0 if last is None else (dpsi_c - self._dpsi_c) / h
        follows = is_exact and measured.dq.tolist() == commanded.dq
        tau_c = measured.tau if follows else model.rigid_body.full_torque(q_c, dq_c, ddq_c)
        dtau_c = self._zeros if last is None else (tau_c - last.tau_c) / h
        tau_filtered = measured.tau if last is None else self._low_pass(last.tau_filtered, measured.tau)
        self._psi, self._psi_c, self._dpsi_c = psi, psi_c, dpsi_c
        self._is_settled = (
            commanded.is_at_rest
            and not (dpsi_c or ddpsi_c or acceleration_c.any() or dtau_c.any())
            and tau_filtered is measured.tau
        )
        return RobotState(
            message_id=0,
            q=measured.q,
            q_c=q_c,
            dq=measured.dq,
            dq_c=dq_c,
            ddq_c=ddq_c,
            T_base_tool=_matrix(pose),
            T_base_tool_c=_matrix(pose_c),
            tool_velocity_c=twist_c,
            tool_acceleration_c=acceleration_c,
            psi=psi,
            psi_c=psi_c,
            dpsi_c=dpsi_c,
            ddpsi_c=ddpsi_c,
            tau=measured.tau,
            tau_filtered=tau_filtered,
            tau_c=tau_c,
            dtau_c=dtau_c,
            tau_ext_in_base=measured.wrench_ext,
            tau_ext_in_stiff=self._in_force_frame(measured.wrench_ext, pose),
            theta=measured.q,
            dtheta=measured.dq,
            motor_tau=measured.tau,
            motor_tau_filtered=tau_filtered,
            faults=(),
            success_rate=1.0,
            motion_generator_mode=MotionGeneratorMode.IDLE,
            controller_mode=ControllerMode.OTHER,
            robot_mode=RobotMode.OTHER,
        )

    def _arm_angle(self, q: JointVector, last: float) -> float:
        if self._model.n != 7:
            return 0.0
        try:
            return self._model.arm_angle(q)
        except SingularError:
            return last

    def _low_pass(self, last: JointVector, tau: JointVector) -> JointVector:
        filtered = last + self._gain * (tau - last)
        return tau if np.abs(tau - filtered).max() < _SETTLED_TORQUE else filtered

    def _in_force_frame(self, wrench: Array, T_base_tool: Pose) -> Array:
        """Returns a wrench on the tool (base axes, tool's origin) in axes and at the origin of the force frame."""
        if not wrench.any():
            return self._zeros6
        T_base_force = T_base_tool @ self._T_tool_force
        R = T_base_force.rotation.T
        arm = T_base_tool.position - T_base_force.position
        moment = wrench[3:] + np.cross(arm, wrench[:3])
        return np.concatenate((R @ wrench[:3], R @ moment))


def _matrix(pose: Pose) -> Matrix:
    return np.array(pose.as_row_major()).reshape(4, 4)


def _low_pass_gain(frequency: float) -> float:
    """Returns the share of the difference that a first-order low pass takes up in one cycle; 1000 Hz is no filter."""
    if frequency >= MAX_FREQUENCY:
        return 1.0
    return CYCLE_TIME / (CYCLE_TIME + 1.0 / (2.0 * math.pi * frequency)) if frequency > 0.0 else 0.0
