"""The values of the drives in the state: motor side, and low-pass filtered torques.

They are linear in the sensor values, in their changes since the last cycle, and in the previous filtered torques. A
single matrix product computes them in a third of the time of separate operations.

The motor side of the joints:

    theta = N (q + tau / k)         the gear is a spring: under torque the motor leads the joint
    motor_tau = (tau + B ddq + d dq) / N      joint torque, rotor inertia B and viscous friction d, seen at the motor

The manual has no values for these drives. Ratio and stiffness are typical of strain-wave gears of this size; rotor
inertia and friction are those of the MuJoCo plant.
"""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import Array, JointVector, Matrix, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.model.robot_model import RobotModel
from rcilab.robots.mjcf import ARMATURE_PER_TORQUE, DAMPING_PER_TORQUE
from rcilab.sim.filters import low_pass_gain
from rcilab.sim.plant import Measurement

_SETTLED_TORQUE = 1e-6  # [N m] Difference below which a filtered torque is set to the true one.

GEAR_RATIO = 101.0  # motor turns a joint turn, N; a typical strain-wave gear
STIFFNESS_PER_TORQUE = 200.0  # [N m/rad per N m of torque limit] gear stiffness k: 17000 at 85 N m; a typical value


class DriveModel:
    """Motor angles and torques of an arm. Immutable.

    Args:
        model: The arm.
    """

    def __init__(self, model: RobotModel) -> None:
        torque = model.limits.joint.torque
        self.ratio: JointVector = readonly_copy(np.full(model.n, GEAR_RATIO))
        """Gear ratio, motor turns per joint turn, shape (n,)."""
        self.gear_stiffness: JointVector = readonly_copy(STIFFNESS_PER_TORQUE * torque)
        """Shape (n,), [N m/rad]."""
        self.rotor_inertia: JointVector = readonly_copy(ARMATURE_PER_TORQUE * torque / GEAR_RATIO**2)
        """Of the motor, shape (n,), [kg m^2]; at the joint it is N^2 times larger."""
        self.friction: JointVector = readonly_copy(DAMPING_PER_TORQUE * torque)
        """Viscous friction at the joint, shape (n,), [N m s/rad]."""
        q, dq, tau, ddq, dtau = np.split(np.eye(5 * model.n), 5, axis=1)
        columns = self.theta(q, tau), self.dtheta(dq, dtau), self.motor_tau(tau, dq, ddq)
        self.matrix: Matrix = readonly_copy(np.concatenate(columns, axis=1).T)
        """All three are linear: theta, dtheta and motor_tau from q, dq, tau, ddq and dtau, shape (3 n, 5 n)."""

    def theta(self, q: JointVector, tau: JointVector) -> JointVector:
        """Returns motor angles, shape (n,), [rad], from joint angles [rad] and joint torques [N m]."""
        return self.ratio * (q + tau / self.gear_stiffness)

    def dtheta(self, dq: JointVector, dtau: JointVector) -> JointVector:
        """Returns motor velocities, shape (n,), [rad/s], from joint velocities [rad/s] and torque rates [N m/s]."""
        return self.ratio * (dq + dtau / self.gear_stiffness)

    def motor_tau(self, tau: JointVector, dq: JointVector, ddq: JointVector) -> JointVector:
        """Returns motor torques, shape (n,), [N m], from joint torques, velocities and accelerations."""
        return (tau + self.friction * dq) / self.ratio + self.ratio * self.rotor_inertia * ddq


class DriveReport:
    """Computes the values of the drives cycle by cycle. Owned by the reporter.

    Attributes:
        is_settled: Whether the filtered torques equal the true ones.

    Args:
        model: The arm.
        cutoff: Of the low pass on the torques, [Hz].
    """

    def __init__(self, model: RobotModel, cutoff: float) -> None:
        self.is_settled = True
        self._gain = low_pass_gain(cutoff)
        self._matrix = _report_matrix(DriveModel(model).matrix, self._gain)
        self._last: Measurement | None = None
        self._filtered = np.zeros(2 * model.n)

    def step(self, measured: Measurement, is_stationary: bool) -> tuple[JointVector, ...]:
        """Returns theta, dtheta, motor_tau, and filtered both tau and motor_tau, each of shape (n,), in SI.

        Args:
            measured: The measurement; the same object means that nothing has changed.
            is_stationary: Whether the reference is stationary, so that the filter may settle.
        """
        last = self._last or measured
        q, dq, tau = measured.q, measured.dq, measured.tau
        report = self._matrix.dot(np.concatenate((q, dq, tau, dq - last.dq, tau - last.tau, self._filtered)))
        n = len(q)
        true, filtered = report[2 * n : 4 * n], report[4 * n :]
        self.is_settled = self._last is None or self._gain == 1.0 or (is_stationary and _is_close(true, filtered))
        self._last, self._filtered = measured, true if self.is_settled else filtered
        return report[:n], report[n : 2 * n], true[n:], self._filtered[:n], self._filtered[n:]


def _is_close(true: Array, filtered: Array) -> bool:
    return bool(np.abs(true - filtered).max() < _SETTLED_TORQUE)


def _report_matrix(motor_side: Matrix, gain: float) -> Matrix:
    """Returns the matrix of a report, shape (6 n, 7 n).

    It maps q, dq, tau, the changes of the last two in a cycle, and the filtered tau and motor_tau to theta, dtheta,
    tau, motor_tau, and the next filtered values: x += gain (u - x).
    """
    n = len(motor_side) // 3
    motor_side = np.concatenate((motor_side[:, : 3 * n], motor_side[:, 3 * n :] / CYCLE_TIME), axis=1)
    torques = np.concatenate((np.eye(5 * n)[2 * n : 3 * n], motor_side[2 * n :]))
    sensed = np.concatenate((motor_side[: 2 * n], torques, gain * torques))
    filtered = np.concatenate((np.zeros((4 * n, 2 * n)), (1.0 - gain) * np.eye(2 * n)))
    return np.concatenate((sensed, filtered), axis=1)
