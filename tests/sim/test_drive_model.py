"""The motor side agrees with the joint side."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.model.robot_model import load_model
from rcilab.robots.mjcf import ARMATURE_PER_TORQUE
from rcilab.sim.drive_report import DriveModel


def test_without_torque_the_motor_is_the_joint_times_the_ratio() -> None:
    drive, q, zeros = DriveModel(load_model("xMatePro7")), np.linspace(-1.0, 1.0, 7), np.zeros(7)
    assert drive.theta(q, zeros) == pytest.approx(drive.ratio * q)
    assert drive.dtheta(q, zeros) == pytest.approx(drive.ratio * q)


def test_torque_winds_the_gear_up_by_torque_over_stiffness() -> None:
    drive, q, tau = DriveModel(load_model("xMate3")), np.zeros(6), np.full(6, 30.0)
    ahead = drive.theta(q, tau) / drive.ratio
    assert ahead * drive.gear_stiffness == pytest.approx(tau)
    assert np.abs(ahead).max() < 0.01  # [rad] A gear, not a rubber band.


def test_the_speed_of_the_motor_is_the_rate_of_its_angle() -> None:
    drive, h = DriveModel(load_model("xMatePro3")), 1e-6
    q, dq, tau, dtau = np.full(7, 0.3), np.linspace(-1, 1, 7), np.full(7, 10.0), np.linspace(50, -50, 7)
    rate = (drive.theta(q + h * dq, tau + h * dtau) - drive.theta(q, tau)) / h
    assert drive.dtheta(dq, dtau) == pytest.approx(rate, rel=1e-6, abs=1e-6)


def test_power_of_a_steady_motor_is_that_of_the_joint_and_its_friction() -> None:
    model = load_model("xMatePro7")
    drive, tau, dq = DriveModel(model), np.linspace(-20.0, 20.0, 7), np.full(7, 0.5)
    power = drive.motor_tau(tau, dq, np.zeros(7)) * drive.dtheta(dq, np.zeros(7))
    assert power == pytest.approx(tau * dq + drive.friction * dq**2)


def test_the_rotor_is_the_one_that_the_mujoco_arm_moves_with() -> None:
    model = load_model("xMatePro7")
    drive, zeros, ddq = DriveModel(model), np.zeros(7), np.full(7, 5.0)
    felt = drive.motor_tau(zeros, zeros, ddq) * drive.ratio
    assert felt == pytest.approx(ARMATURE_PER_TORQUE * model.limits.joint.torque * ddq)


def test_all_at_once_is_each_for_itself() -> None:
    drive, (q, dq, tau, ddq, dtau) = DriveModel(load_model("xMate3")), np.random.default_rng(3).normal(size=(5, 6))
    theta, dtheta, motor_tau = np.split(drive.matrix @ np.concatenate((q, dq, tau, ddq, dtau)), 3)
    assert theta == pytest.approx(drive.theta(q, tau))
    assert dtheta == pytest.approx(drive.dtheta(dq, dtau))
    assert motor_tau == pytest.approx(drive.motor_tau(tau, dq, ddq))
