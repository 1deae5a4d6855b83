"""The values of the reports, in the units of the wire.

Currents, voltages, temperatures and a force sensor are not simulated: currents and forces are zero, the others are
those of a real arm at standstill.
"""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.makers.ufactory.bounds import JOINT_ACCELERATION, JOINT_VELOCITY, TOOL_ACCELERATION
from rcilab.makers.ufactory.controller.xarm_controller import XArmController
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.wire.identity import FIRMWARE, Identity
from rcilab.makers.ufactory.wire.poses import (
    MILLIMETRE,
    pose_as_mm_rotation,
    pose_as_mm_rpy,
    rotation_vector,
)
from rcilab.makers.ufactory.wire.reports import HIGH_RATE, RICH, ReportLayout, ReportValue

_AXES = 7  # On the wire, for every arm.
_TEMPERATURE, _VOLTAGE = 30, 4800  # [deg C], [0.01 V]
_OVERLOADED = (1, 33)
"""Status and error of an overloaded drive, the only error of one here: client library, table of servo codes."""
_SLOWEST = (0.1, 1.0, 1e-4, 0.01)
"""Least speed and acceleration of tool, [mm], and joints, [rad]: as the client library has them before any report."""


def padded(values: list[float]) -> list[float]:
    """Returns joint values with zeros for the joints that the arm has not, 7 numbers."""
    return values + [0.0] * (_AXES - len(values))


def servo_codes(controller: XArmController) -> bytes:
    """Returns status and error of the drive of each joint, 14 bytes."""
    failed = (controller.error or 0) - UfactoryError.JOINT_1
    return b"".join(bytes(_OVERLOADED if joint == failed else (0, 0)) for joint in range(_AXES))


def encode_report(controller: XArmController, identity: Identity, layout: ReportLayout) -> bytes:
    """Returns a report of this cycle."""
    if layout is HIGH_RATE:
        return layout.encode(_high_rate(controller))
    values = _basic(controller)
    if layout.size > 135:
        values |= _normal(controller)
    if layout is RICH:
        values |= _rich(controller, identity)
    return layout.encode(values)


def _shown(controller: XArmController) -> dict[str, ReportValue]:
    return {
        "state_and_mode": controller.shown_state | controller.mode << 4,
        "queued": min(controller.queued, 0xFFFF),
    }


def user_pose(controller: XArmController) -> Pose:
    """Returns the measured pose of the tool in the user frame."""
    return controller.settings.T_base_user.inverse() @ controller.arm.measured_state.tool.pose


def _basic(controller: XArmController) -> dict[str, ReportValue]:
    measured = controller.arm.measured_state.measured
    torque = [0.0] * _AXES if controller.settings.reports_currents else padded(measured.tau.tolist())
    return {
        **_shown(controller),
        "q": padded(measured.q.tolist()),
        "pose": pose_as_mm_rpy(user_pose(controller)),
        "torque": torque,
    }


def _normal(controller: XArmController) -> dict[str, ReportValue]:
    settings = controller.settings
    load = settings.load
    return {
        "brakes": controller.enabled,
        "enabled": controller.enabled,
        "error": controller.error or 0,
        "warning": controller.warning or 0,
        "tcp_offset": pose_as_mm_rpy(settings.T_flange_tool),
        "load": (load.mass, *(x / MILLIMETRE for x in load.center_of_mass.tolist())),
        "collision_sensitivity": settings.collision_sensitivity,
        "teach_sensitivity": settings.teach_sensitivity,
        "gravity": settings.gravity,
    }


def _rich(controller: XArmController, identity: Identity) -> dict[str, ReportValue]:
    settings, signals, limits = controller.settings, controller.signals, controller.model.limits
    tool = controller.arm.measured_state.tool
    slow_tool, weak_tool, slow_joint, weak_joint = _SLOWEST
    n = controller.model.n
    ranges = [angle for pair in zip(settings.reduced_lower, settings.reduced_upper, strict=True) for angle in pair]
    return {
        "type": identity.type,
        "axes": identity.axes,
        "bus_ids": (0xAA, 0x55, 0x55, 0xAA),
        "version": FIRMWARE.encode(),
        "tcp_limits": (
            settings.tool_jerk / MILLIMETRE, weak_tool, TOOL_ACCELERATION / MILLIMETRE,
            slow_tool, limits.cartesian.translation_velocity / MILLIMETRE,
        ),
        "joint_limits": (settings.joint_jerk, weak_joint, JOINT_ACCELERATION, slow_joint, JOINT_VELOCITY),
        "rotation_limits": (limits.cartesian.rotation_jerk, limits.cartesian.rotation_acceleration),
        "servo_codes": tuple(servo_codes(controller)),
        "temperatures": (_TEMPERATURE,) * n + (0,) * (_AXES - n),
        "tcp_speed": tool_speed_mm(controller),
        "joint_speeds": padded(controller.arm.measured_state.measured.dq.tolist()),
        "counter": controller.counter,
        "world_offset": pose_as_mm_rpy(settings.T_base_user),
        "io_reset": settings.io_reset,
        "is_simulation": settings.is_simulation,
        "self_collision": settings.self_collision,
        "tool_model": settings.tool_model,
        "tool_parameters": settings.tool_parameters,
        "voltages": (_VOLTAGE,) * n + (0,) * (_AXES - n),
        "io_digital": (0, signals.box_inputs, 0, signals.box_outputs),
        "io_analog": (*signals.analog_inputs, *signals.analog_outputs),
        "io_functions": (
            *signals.input_functions[:8], *signals.output_functions[:8],
            *signals.input_functions[8:], *signals.output_functions[8:],
        ),
        "rotation_vector": rotation_vector(settings.T_base_user.inverse() @ tool.pose),
        "configuration": configuration_bits(controller),
        "reduced": settings.reduced,
        "boundary": settings.boundary,
        "reduced_speeds": (settings.reduced_tool_speed / MILLIMETRE, settings.reduced_joint_speed),
        "reduced_ranges": ranges + [0.0] * (2 * _AXES - len(ranges)),
        "fence": settings.fence,
        "rebound": settings.rebound,
    }  # fmt: skip


def configuration_bits(controller: XArmController) -> int:
    """Returns the bits of reduced mode, fence, reported currents, approximation and continuity."""
    settings = controller.settings
    flags = (settings.reduced, settings.fence, settings.reports_currents, settings.approximate, settings.continuous)
    return sum(bool(flag) << k for k, flag in enumerate(flags))


def tool_speed_mm(controller: XArmController) -> float:
    """Returns the measured speed of the tool, [mm/s]."""
    x, y, z = controller.arm.measured_state.tool.twist[:3]
    return (x * x + y * y + z * z) ** 0.5 / MILLIMETRE


def _twist_mm(twist: Sequence[float], R: Array) -> list[float]:
    """Returns a twist, or its derivative, in the axes of the user frame."""
    linear, angular = R @ twist[:3] / MILLIMETRE, R @ twist[3:]
    return [*linear.tolist(), *angular.tolist()]


def _high_rate(controller: XArmController) -> dict[str, ReportValue]:
    commanded, tool_c, measured, tool, _, _, wrench = controller.arm.signals
    user, signals = controller.settings.T_base_user.inverse(), controller.signals
    R = user.rotation
    q_c, dq_c, ddq_c = commanded.arrays
    box_in, box_out = ([round(1e3 * 10.0 * code / 4095.0) for code in codes] for codes in (
        signals.analog_inputs, signals.analog_outputs
    ))  # fmt: skip
    return {
        "microseconds": 1000 * controller.cycle_number,
        **_shown(controller),
        "target_q": padded(q_c.tolist()),
        "target_dq": padded(dq_c.tolist()),
        "target_ddq": padded(ddq_c.tolist()),
        "q": padded(measured.q.tolist()),
        "dq": padded(measured.dq.tolist()),
        "ddq": padded(controller.accelerations.joints),
        "joint_torque": padded(measured.tau.tolist()),
        "target_pose_aa": pose_as_mm_rotation(user @ tool_c.pose),
        "target_twist": _twist_mm(tool_c.twist, R),
        "pose_aa": pose_as_mm_rotation(user @ tool.pose),
        "twist": _twist_mm(tool.twist, R),
        "tcp_wrench": wrench.tolist(),
        "target_tcp_acceleration": _twist_mm(tool_c.acceleration, R),
        "tcp_acceleration": _twist_mm(controller.accelerations.tool, R),
        "inputs": signals.box_inputs,
        "outputs": signals.box_outputs,
        "analog_inputs": box_in,
        "analog_outputs": box_out,
        "tool_inputs": signals.tool_inputs,
        "tool_outputs": signals.tool_outputs,
    }
