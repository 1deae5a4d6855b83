"""The motor side of the joints: motor angles and torques.

    theta = N (q + tau / k)         the gear is a spring: under torque the motor leads the joint
    motor_tau = (tau + B ddq + d dq) / N      joint torque, rotor inertia B and viscous friction d, seen at the motor

The manual has no values for these drives. Ratio and stiffness are typical of strain-wave gears of this size; rotor
inertia and friction are those of the MuJoCo plant.
"""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import JointVector, Matrix, readonly_copy
from rcilab.model.robot_model import RobotModel
from rcilab.robots.mjcf import ARMATURE_PER_TORQUE, DAMPING_PER_TORQUE

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
