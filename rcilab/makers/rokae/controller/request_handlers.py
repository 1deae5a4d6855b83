"""The answers of the controller that do not follow from its table of phases: contents, and invalid arguments."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from rcilab.conformance.common_conditions import ANGLE_ALLOWANCE, BOX_ALLOWANCE
from rcilab.core.errors import InvalidValueError
from rcilab.core.fault import name_faults
from rcilab.core.safety_box import active_box
from rcilab.core.state import ControllerMode
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.bounds import SIGNAL_COUNT
from rcilab.makers.rokae.controller.modes import MODES
from rcilab.makers.rokae.controller.settings import Settings, apply_request
from rcilab.makers.rokae.controller.state_machine import (
    GROUNDED,
    POWER_OFF,
    Action,
    Phase,
    Transition,
    When,
    transition,
)
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import RobotModel
from rcilab.sim.channels import LOWEST_CLIENT_PORT
from rcilab.sim.measured_state import MeasuredStateMonitor
from rcilab.sim.reference_trajectory import ReferenceTrajectory
from rcilab.sim.virtual_arm import VirtualArm


class Reply(NamedTuple):
    """An answer, and when it is sent."""

    response: rci.Response
    when: When = When.NOW
    ends_connection: bool = False
    refusal: str = ""
    """Why the request is refused, as a sentence; "" if it is granted."""


def answer_query(
    request: rci.Request,
    phase: Phase,
    safety_stop: rci.SafetyStop,
    settings: Settings,
    model_response: rci.Response,
) -> rci.Response | None:
    """Returns the content for a query, or None for other requests."""
    match request:
        case rci.GetMotorState():
            return rci.MotorStateResponse(int(phase not in (Phase.OFF, Phase.CUT_OFF, Phase.USER_STOPPED)))
        case rci.GetSafetyStopState():
            return rci.SafetyStopResponse(safety_stop)
        case rci.GetDIState(signal=signal):
            if signal >= SIGNAL_COUNT:
                return rci.DigitalInputResponse(rci.SettingStatus.INVALID_ARGUMENT, False)
            return rci.DigitalInputResponse(rci.SettingStatus.SUCCESS, settings.inputs[signal])
        case rci.LoadRobotModel():
            return model_response
        case _:
            return None


def check_request(request: rci.Request, phase: Phase, settings: Settings, arm: VirtualArm) -> Transition | rci.Status:
    """Returns the effect of a request, or the status that refuses it regardless of the settings."""
    cell = transition(phase, request.code)
    refusal: rci.Status | None = None
    match request:
        case rci.SetMotorPower(power=0):
            return POWER_OFF[phase]
        case rci.Connect(udp_port=port):
            refusal = None if port >= LOWEST_CLIENT_PORT else rci.SettingStatus.INVALID_ARGUMENT
        case rci.SetMotorPower(power=power):
            refusal = None if power == 1 else rci.SettingStatus.INVALID_ARGUMENT
            if refusal is None and phase is Phase.OFF and not arm.is_standstill:  # The brakes have not yet stopped it.
                return cell._replace(when=When.AT_REST)
        case rci.StartMove() if cell.status is rci.StartStatus.SUCCESS:  # A refusal by the phase has priority.
            refusal = _check_start(request, arm.model, arm.commanded)
        case rci.StartDrag(space=space, type=kind):
            is_known = space in tuple(rci.DragSpace) and kind in tuple(rci.DragType)
            refusal = None if is_known else rci.SettingStatus.INVALID_ARGUMENT
        case rci.AutomaticErrorRecovery() if phase in (Phase.REFLEX, Phase.CUT_OFF):
            refusal = check_recovery(settings, arm.measured_state)
        case _ if request.code in GROUNDED and Action.APPLY in cell.actions and not arm.commanded.is_stationary:
            refusal = rci.SettingStatus.NOT_POSSIBLE
        case _:
            pass
    return cell if refusal is None else refusal


def _check_start(request: rci.StartMove, model: RobotModel, commanded: ReferenceTrajectory) -> rci.StartStatus | None:
    controller_mode, motion_mode = request.controller_mode, request.motion_mode
    if controller_mode >= ControllerMode.OTHER or motion_mode not in tuple(rci.StartMotionMode):
        return rci.StartStatus.INVALID_ARGUMENT
    mode = MODES.get((ControllerMode(controller_mode), rci.StartMotionMode(motion_mode)))
    if mode is None or not commanded.is_stationary:
        return rci.StartStatus.NOT_POSSIBLE
    if mode.is_cartesian and model.solver.singularity(commanded.q) is not None:
        return rci.StartStatus.SINGULAR_START_POSE
    return None


def check_recovery(settings: Settings, sensors: MeasuredStateMonitor) -> rci.RecoveryStatus | None:
    """Returns why a stopped arm cannot recover, or None if it can.

    Beyond a soft limit or the safety box by more than a measurement error, an operator must move it back (power off
    and on, then hand guiding, or a motion that leads back): MANUAL_RECOVERY_NEEDED. While an external force is still
    above the collision thresholds: REFLEX.

    Args:
        settings: Soft limits, box and thresholds.
        sensors: Position of the arm, and external forces.
    """
    if find_outside(settings, sensors) is not None:
        return rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED
    return None if sensors.find_collision(settings.collision_thresholds) is None else rci.RecoveryStatus.REFLEX


def find_outside(settings: Settings, sensors: MeasuredStateMonitor) -> str | None:
    """Returns the joint that is too far beyond its range, or how far the tool is outside its box; None for neither."""
    bounds = zip(sensors.measured.q.tolist(), settings.joint_lower, settings.joint_upper, strict=True)
    for number, (q, lower, upper) in enumerate(bounds, 1):
        if not lower - ANGLE_ALLOWANCE < q < upper + ANGLE_ALLOWANCE:
            span = f"{math.degrees(lower):.2f} to {math.degrees(upper):.2f} deg"
            return f"joint {number} is at {math.degrees(q):.2f} deg, beyond {span}"
    box = active_box(settings.safety_box)
    excess = 0.0 if box is None or settings.guiding_box is not None else box.excess(sensors.tool.position)
    return f"the tool is {1e3 * excess:.0f} mm outside the safety box" if excess > BOX_ALLOWANCE else None


def describe_refusal(
    request: rci.Request,
    status: rci.Status,
    phase: Phase,
    settings: Settings,
    arm: VirtualArm,
    *,
    safety_stop: rci.SafetyStop,
    faults: Iterable[Fault],
) -> str:
    """Returns why a request was refused, for the log."""
    why: object = None
    if status.name == "INVALID_ARGUMENT":
        why = _describe_argument(request, settings, arm)
    elif isinstance(request, rci.StartMove) and phase is Phase.IDLE and status is rci.StartStatus.NOT_POSSIBLE:
        pair = f"controller mode {request.controller_mode} with motion mode {request.motion_mode}"
        why = f"there is no {pair}" if arm.commanded.is_stationary else _STILL_MOVING
    elif request.code in GROUNDED and Action.APPLY in transition(phase, request.code).actions:
        why = _STILL_MOVING
    elif status is rci.StartStatus.SINGULAR_START_POSE:
        why = arm.model.solver.singularity(arm.commanded.q)
    elif status is rci.RecoveryStatus.REFLEX:
        why = arm.measured_state.find_collision(settings.collision_thresholds)
    elif status is rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED:
        why = f"{find_outside(settings, arm.measured_state)}: power off and on, then move it back"
    why = why or _describe_phase(phase, safety_stop, faults)
    return f"refused {type(request).__name__} ({status.name.lower().replace('_', ' ')}): {why}"


def _describe_phase(phase: Phase, safety_stop: rci.SafetyStop, faults: Iterable[Fault]) -> str:
    """Returns the phase of the robot and, if it was stopped, the cause."""
    match phase:
        case Phase.USER_STOPPED:
            return _STOP_DESCRIPTIONS[safety_stop]
        case Phase.REFLEX:
            return f"the arm was stopped by {name_faults(faults)}"
        case Phase.CUT_OFF:
            return f"the motors were switched off by {name_faults(faults)}"
        case _:
            return _PHASE_DESCRIPTIONS[phase]


def _describe_argument(request: rci.Request, settings: Settings, arm: VirtualArm) -> str:
    """Returns the value of a request that is out of its bounds."""
    match request:
        case rci.SetMotorPower(power=power):
            return f"power {power} does not exist; 0 is off, 1 is on"
        case rci.StartMove(controller_mode=mode) if mode >= ControllerMode.OTHER:
            return f"controller mode {mode} does not exist; there are 0 to {ControllerMode.OTHER - 1}"
        case rci.StartMove(motion_mode=mode):
            return f"motion mode {mode} does not exist; there are 0 to {max(rci.StartMotionMode)}"
        case rci.StartDrag(space=space) if space not in tuple(rci.DragSpace):
            return f"space {space} does not exist; there are 0 to {max(rci.DragSpace)}"
        case rci.StartDrag(type=kind):
            return f"type {kind} does not exist; there are 0 to {max(rci.DragType)}"
        case rci.GetDIState(signal=signal):
            return f"signal {signal} does not exist; there are 0 to {SIGNAL_COUNT - 1}"
        case rci.Connect(udp_port=port):
            return f"UDP port {port} is below {LOWEST_CLIENT_PORT}"
        case _:
            pass
    try:
        apply_request(settings, request, arm.model.description)
    except InvalidValueError as error:
        return str(error)
    return f"a value does not exist: {request}"


def conclude(reply: Reply, phase: Phase) -> rci.RecoveryStatus | None:
    """Returns the status of a recovery that was interrupted before its answer was due; None for any other answer."""
    status = getattr(reply.response, "status", None)
    if reply.when is not When.AT_REST or not isinstance(status, rci.RecoveryStatus):
        return None
    return _RECOVERY_RESULTS.get(phase, rci.RecoveryStatus.ABORTED) or None


_STOP_DESCRIPTIONS = {
    rci.SafetyStop.ESTOP: "an emergency stop is pressed",
    rci.SafetyStop.GSTOP: "the safety gate is open",
}
_STILL_MOVING = "the arm still moves"
_PHASE_DESCRIPTIONS = {
    Phase.OFF: "the motors are off",
    Phase.IDLE: "the robot is idle",
    Phase.STARTING: "a motion is starting",
    Phase.MOVING: "a motion is in progress",
    Phase.STOPPING: "the arm is still stopping after a motion",
    Phase.GUIDING: "the arm is guided by hand",
    Phase.RECOVERING: "an error recovery is in progress",
}
_RECOVERY_RESULTS = {
    Phase.IDLE: rci.RecoveryStatus.SUCCESS,
    Phase.OFF: rci.RecoveryStatus.SUCCESS,
    Phase.USER_STOPPED: rci.RecoveryStatus.USER_STOP,
    Phase.REFLEX: rci.RecoveryStatus.REFLEX,
}
