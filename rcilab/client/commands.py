"""Every command of the RCI as a method: arguments checked before they are sent, refusals turned into errors."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rcilab.arrays import Array, as_vector
from rcilab.client.link import Link
from rcilab.errors import CommandRejectedError, InvalidValueError
from rcilab.limits import Limits
from rcilab.protocols import rci
from rcilab.spatial import Pose
from rcilab.state import ControllerMode

HIGHEST_FREQUENCY = 1000.0  # [Hz] RCI manual 3.1.9: cut-off frequencies end there; it switches the filter off.
SIGNALS = range(6)  # RCI manual 3.1: digital inputs and outputs 0 to 5.

_ADVICE: dict[tuple[type[rci.Request], IntEnum], str] = {
    (rci.StartMove, rci.StartStatus.NOT_POSSIBLE): "is the motor power on (power_on()), and does nothing move yet?",
    (rci.StartMove, rci.StartStatus.REFLEX): "faults are set: recover() clears them",
    (rci.StartMove, rci.StartStatus.USER_STOP): "an emergency stop is pressed: release it, then recover()",
    (rci.StartMove, rci.StartStatus.SINGULAR_START_POSE): "move away from the singularity in joint space first",
    (rci.AutomaticErrorRecovery, rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED): "see the teach pendant",
    (rci.AutomaticErrorRecovery, rci.RecoveryStatus.USER_STOP): "an emergency stop is pressed: release it first",
}


class RciCommands:
    """The commands of the RCI manual, section 3.1.

    Refusals raise `CommandRejectedError`, a missing answer `DeadlineError`, a broken connection
    `ConnectionLostError`; arguments of the wrong shape, not finite or out of range raise `InvalidValueError` and are
    not sent.

    Args:
        link: The connection.
        limits: Bounds of the arm, to check arguments with; None leaves that to the controller.
    """

    def __init__(self, link: Link, limits: Limits | None = None) -> None:
        self._link = link
        self._limits = limits

    @property
    def n(self) -> int:
        """Number of joints."""
        return self._link.n

    def power_on(self) -> None:
        """Switches the motors on."""
        self._ask(rci.SetMotorPower(1))

    def power_off(self) -> None:
        """Switches the motors off."""
        self._ask(rci.SetMotorPower(0))

    def set_motor_power(self, power: bool) -> None:
        """Switches the motors on or off."""
        if not isinstance(power, bool | int):
            raise InvalidValueError("power", power, "must be True or False")
        self._ask(rci.SetMotorPower(int(power)))

    def get_motor_state(self) -> bool:
        """Returns whether the motors are on."""
        return bool(self._request(rci.GetMotorState()).power)

    def start_move(self, controller_mode: ControllerMode, motion_mode: rci.StartMotionMode) -> None:
        """Begins a motion; commands must follow at once. `execute` and `control` do all of it by themselves."""
        self._ask(rci.StartMove(controller_mode, motion_mode), rci.StartStatus.MOTION_STARTED)

    def stop_move(self, timeout: float | None = None) -> None:
        """Ends a motion.

        Args:
            timeout: How long to wait for the answer, [s]; None: as for every request.
        """
        self._ask(rci.StopMove(), timeout=timeout)

    def set_cartesian_limit(self, size: ArrayLike, center: Pose, active: bool = True) -> None:
        """Sets the safety box that the tool must stay in.

        Args:
            size: Edge lengths, shape (3,), [m], all above 0.
            center: Pose of the box's centre in base.
            active: Whether it is watched.
        """
        edges = as_vector(size, 3, "size", "m")
        if (edges <= 0.0).any():
            raise InvalidValueError("size", edges.tolist(), "needs three lengths above 0 [m]")
        self._ask(rci.SetCartesianLimit(_floats(edges), _pose("center", center).as_row_major(), active))

    def set_joint_limit(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets soft limits of the joint angles, each of shape (n,), [rad], inside the arm's own limits."""
        low, high = as_vector(lower, self.n, "lower", "rad"), as_vector(upper, self.n, "upper", "rad")
        if (low >= high).any():
            raise InvalidValueError("lower", low.tolist(), f"must be below upper {high.tolist()} in every joint [rad]")
        if self._limits is not None:
            joint = self._limits.joint
            _require_range("lower", low, joint.lower, joint.upper, "rad")
            _require_range("upper", high, joint.lower, joint.upper, "rad")
        self._ask(rci.SetJointLimit(_floats(high), _floats(low)))

    def set_collision_behavior(self, thresholds: ArrayLike) -> None:
        """Sets the external torques that count as a collision, shape (n,), [N m]."""
        values = as_vector(thresholds, self.n, "thresholds", "N m")
        if self._limits is not None:
            _require_range("thresholds", values, 0.0, self._limits.joint.collision_threshold, "N m")
        self._ask(rci.SetCollisionBehavior(_floats(values)))

    def set_joint_impedance(self, stiffness: ArrayLike) -> None:
        """Sets the stiffness of joint impedance, shape (n,), [N m/rad]."""
        values = as_vector(stiffness, self.n, "stiffness", "N m/rad")
        if self._limits is not None:
            _require_range("stiffness", values, 0.0, self._limits.joint.stiffness, "N m/rad")
        self._ask(rci.SetJointImpedance(_floats(values)))

    def set_cartesian_impedance(self, stiffness: ArrayLike) -> None:
        """Sets the stiffness of Cartesian impedance, shape (6,): three [N/m], three [N m/rad]."""
        values = as_vector(stiffness, 6, "stiffness", "N/m, N m/rad")
        if self._limits is not None:
            c = self._limits.cartesian
            upper = np.repeat((c.translation_stiffness, c.rotation_stiffness), 3)
            _require_range("stiffness", values, 0.0, upper, "N/m, N m/rad")
        self._ask(rci.SetCartesianImpedance(_floats(values)))

    def set_coor(self, T_flange_tool: Pose) -> None:
        """Sets the tool by its pose in the flange frame."""
        self._ask(rci.SetCoor(_pose("T_flange_tool", T_flange_tool).as_row_major()))

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load at the flange.

        Args:
            mass: [kg].
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2].
        """
        number = float(as_vector([mass], 1, "mass", "kg")[0])
        if number < 0.0:
            raise InvalidValueError("mass", mass, "must not be below 0 [kg]")
        tensor = as_vector(np.asarray(inertia, dtype=np.float64).ravel(), 9, "inertia", "kg m^2")
        center = as_vector(center_of_mass, 3, "center_of_mass", "m")
        self._ask(rci.SetLoad(number, _floats(center), _floats(tensor)))

    def set_cart_imp_desired_tau(self, wrench: ArrayLike) -> None:
        """Sets the force and moment that Cartesian impedance presses with, shape (6,), [N, N m]."""
        values = as_vector(wrench, 6, "wrench", "N, N m")
        if self._limits is not None:
            bound = np.repeat((self._limits.cartesian.force, self._limits.cartesian.moment), 3)
            _require_range("wrench", values, -bound, bound, "N, N m")
        self._ask(rci.SetCartImpDesiredTau(_floats(values)))

    def set_filters(self, joint: float, cartesian: float, torque: float) -> None:
        """Sets the cut-off frequencies of the controller's own filters, [Hz]; 1000 switches one off."""
        values = as_vector([joint, cartesian, torque], 3, "cut-off frequencies", "Hz")
        _require_range("cut-off frequencies", values, 0.0, HIGHEST_FREQUENCY, "Hz")
        self._ask(rci.SetFilters(*_floats(values)))

    def set_torque_filter_cut_off_frequency(self, frequency: float) -> None:
        """Sets the cut-off frequency of the reported torques' filter, [Hz]."""
        values = as_vector([frequency], 1, "frequency", "Hz")
        _require_range("frequency", values, 0.0, HIGHEST_FREQUENCY, "Hz")
        self._ask(rci.SetTorqueFilterCutOffFrequency(float(values[0])))

    def automatic_error_recovery(self) -> None:
        """Asks the controller to clear its faults."""
        self._ask(rci.AutomaticErrorRecovery())

    def load_robot_model(self) -> rci.ModelResponse:
        """Returns the figures of the arm as the controller knows them.

        Raises:
            CommandRejectedError: The controller has none.
        """
        response: rci.ModelResponse = self._request(rci.LoadRobotModel())
        if response.status != rci.GuideStatus.SUCCESS:
            raise CommandRejectedError("LoadRobotModel", response.status)
        return response

    def set_fc_coor(self, frame: Pose, type: rci.ForceFrame = rci.ForceFrame.TOOL) -> None:
        """Sets the force-control frame by its pose in the flange frame, and what its axes follow."""
        self._ask(rci.SetFcCoor(_pose("frame", frame).as_row_major(), type))

    def enable_virtual_guide(self, enable: bool) -> None:
        """Switches the virtual guide."""
        self._ask(rci.EnableVirtualGuide(enable))

    def set_do(self, signal: int, level: bool) -> None:
        """Sets a digital output, 0 to 5."""
        self._ask(rci.SetDO(_signal(signal), level))

    def get_di(self, signal: int) -> bool:
        """Returns the level of a digital input, 0 to 5."""
        return bool(self._request(rci.GetDIState(_signal(signal))).level)

    def start_drag(self, space: rci.DragSpace, type: rci.DragType = rci.DragType.FREE) -> None:
        """Lets a person guide the arm by hand."""
        self._ask(rci.StartDrag(space, type))

    def stop_drag(self) -> None:
        """Ends hand guiding."""
        self._ask(rci.StopDrag())

    def get_safety_stop_state(self) -> rci.SafetyStop:
        """Returns which emergency stop is pressed."""
        return self._request(rci.GetSafetyStopState()).state

    def reboot_robot(self) -> None:
        """Restarts the controller; the connection ends with it."""
        self._ask(rci.RebootRobot())

    def _ask(self, request: rci.Request, also_good: IntEnum | None = None, timeout: float | None = None) -> None:
        status = self._request(request, timeout).status
        if status != 0 and status != also_good:
            raise CommandRejectedError(type(request).__name__, status, _ADVICE.get((type(request), status), ""))

    def _request(self, request: rci.Request, timeout: float | None = None) -> Any:
        """Sends a request and returns the answer; every command comes through here."""
        return self._link.request(request, timeout)


def _require_range(name: str, values: Array, lower: ArrayLike, upper: ArrayLike, unit: str) -> None:
    low, high = np.broadcast_to(lower, values.shape), np.broadcast_to(upper, values.shape)
    for i, value in enumerate(values):
        if not low[i] <= value <= high[i]:
            raise InvalidValueError(f"{name}[{i + 1}]", float(value), f"is outside {low[i]:g} to {high[i]:g} [{unit}]")


def _pose(name: str, value: object) -> Pose:
    if not isinstance(value, Pose):
        raise InvalidValueError(name, value, "must be a Pose")
    return value


def _signal(signal: int) -> int:
    if signal not in SIGNALS:
        raise InvalidValueError("signal", signal, "does not exist; there are 0 to 5")
    return int(signal)


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(values.tolist())
