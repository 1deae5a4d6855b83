"""Every setter of the RCI as a method: arguments are checked before they are sent, with errors that name the axis.

Most need an arm at standstill; otherwise the refusal names the phase of the controller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, described
from rcilab.core.errors import CommandRejectedError, InvalidValueError, ManualRecoveryError
from rcilab.core.safety_box import SafetyBox, require_box
from rcilab.core.spatial import Pose, as_pose
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.bounds import (
    FARTHEST_BOX,
    FILTER_OFF,
    LARGEST_BOX,
    LIMIT_TOLERANCE,
    LONGEST_TOOL,
    LOWEST_FREQUENCY,
)
from rcilab.makers.rokae.driver.connection import RciConnection
from rcilab.makers.rokae.driver.refusal import Refusal, find_refusal
from rcilab.makers.setting_values import bounded_vector
from rcilab.model.dynamics.payload import Payload
from rcilab.robots import RobotDescription

_AXES = ("x", "y", "z", "about x", "about y", "about z")
_ADVICE: dict[tuple[type[rci.Request], IntEnum], str] = {
    (
        rci.StartMove,
        rci.StartStatus.NOT_POSSIBLE,
    ): "the controller has no such pair of modes, or still moves",
    (rci.StartMove, rci.StartStatus.SINGULAR_START_POSE): "move away from the singularity in joint space first",
    (rci.StartMove, rci.StartStatus.REFLEX): Refusal.FAULT.sentence,
    (rci.StartMove, rci.StartStatus.USER_STOP): Refusal.ESTOP.sentence,
    (rci.AutomaticErrorRecovery, rci.RecoveryStatus.NOT_POSSIBLE): "the arm still moves: try again at standstill",
    (rci.AutomaticErrorRecovery, rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED): (
        "the arm is too far outside its soft limits or its safety box: power_off() clears the fault; then power_on(), "
        "and execute(plan_recovery(robot.model, robot.state.q_c, robot.safety_box)) leads joints and tool back inside "
        "what this session has set (set_joint_limit() and set_cartesian_limit() replace what another client has left); "
        "a hand can, too (start_drag())"
    ),
    (rci.AutomaticErrorRecovery, rci.RecoveryStatus.REFLEX): (
        "the cause is still there: look what touches or loads the arm and remove it, set the load (set_load()) or "
        "higher thresholds (set_collision_behavior()), and try again"
    ),
    (rci.AutomaticErrorRecovery, rci.RecoveryStatus.USER_STOP): Refusal.ESTOP.sentence,
    (rci.AutomaticErrorRecovery, rci.RecoveryStatus.ABORTED): "something ended it half-way: try again",
}
"""The remedy if the controller's state does not give the reason either."""
_TEMPORARY = frozenset({"NOT_POSSIBLE", "USER_STOP", "FAILED"})
"""Statuses that refuse a request because of the controller's phase, whatever its values."""

_COUNTED_FROM_1 = (rci.ForceFrame, rci.DragSpace, rci.DragType)
"""Enumerations that the manual counts from 1 (3.1.16, 3.1.17) and the wire from 0."""

_Member = TypeVar("_Member", bound=IntEnum)


class RciSettings:
    """The setters of the RCI manual, section 3.1, and how a command is sent.

    Args:
        link: The connection.
        description: The arm, to check arguments with; None leaves that to the controller.
    """

    def __init__(self, link: RciConnection, description: RobotDescription | None = None) -> None:
        self._link = link
        self._description = description
        self._limits = None if description is None else description.limits

    @property
    def n(self) -> int:
        """Number of joints."""
        return self._link.n

    def set_collision_behavior(self, thresholds: ArrayLike) -> None:
        """Sets the external torques that count as a collision, shape (n,), [N m]; see `limits.joint`."""
        largest = None if self._limits is None else self._limits.joint.collision_threshold
        values = bounded_vector("thresholds", thresholds, self._joints(), "N m", 0.0, largest)
        self._ask(rci.SetCollisionBehavior(_floats(values)))

    def set_cartesian_limit(self, box: SafetyBox) -> None:
        """Sets the safety box for the origin of the tool, and whether it is active."""
        require_box(box)
        bounded_vector("safety box size", box.size, _AXES[:3], "m", 0.0, LARGEST_BOX)
        bounded_vector("safety box centre", box.T_base_box.position, _AXES[:3], "m", -FARTHEST_BOX, FARTHEST_BOX)
        self._ask(rci.SetCartesianLimit(box.size, box.T_base_box.as_row_major(), box.active))

    def set_joint_limit(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets soft limits of the joint angles, each of shape (n,), [rad], inside the arm's own limits.

        The behaviour at them is set on the controller: the manual's `auto_limit` is never sent over the wire.
        """
        joint = None if self._limits is None else self._limits.joint
        least = largest = None
        if joint is not None:
            least, largest = joint.lower - LIMIT_TOLERANCE, joint.upper + LIMIT_TOLERANCE
        low = bounded_vector("lower", lower, self._joints(), "rad", least, largest)
        high = bounded_vector("upper", upper, self._joints(), "rad", least, largest)
        for i in range(self.n):
            if low[i] >= high[i]:
                raise InvalidValueError(f"lower, joint {i + 1}", float(low[i]), f"rad must be below upper {high[i]:g}")
        self._ask(rci.SetJointLimit(_floats(high), _floats(low)))

    def set_joint_impedance(self, stiffness: ArrayLike) -> None:
        """Sets the stiffness of joint impedance, shape (n,), [N m/rad]."""
        largest = None if self._limits is None else self._limits.joint.stiffness
        values = bounded_vector("stiffness", stiffness, self._joints(), "N m/rad", 0.0, largest)
        self._ask(rci.SetJointImpedance(_floats(values)))

    def set_cartesian_impedance(self, stiffness: ArrayLike) -> None:
        """Sets the stiffness of Cartesian impedance, shape (6,): three [N/m], three [N m/rad]."""
        largest = None
        if self._limits is not None:
            c = self._limits.cartesian
            largest = np.repeat((c.translation_stiffness, c.rotation_stiffness), 3)
        self._ask(
            rci.SetCartesianImpedance(
                _floats(bounded_vector("stiffness", stiffness, _AXES, "N/m, N m/rad", 0.0, largest))
            )
        )

    def set_cart_imp_desired_tau(self, wrench: ArrayLike) -> None:
        """Sets the force and moment of Cartesian impedance, shape (6,), [N, N m]."""
        largest = None
        if self._limits is not None:
            largest = np.repeat((self._limits.cartesian.force, self._limits.cartesian.moment), 3)
        least = None if largest is None else -largest
        self._ask(rci.SetCartImpDesiredTau(_floats(bounded_vector("wrench", wrench, _AXES, "N, N m", least, largest))))

    def set_coor(self, T_flange_tool: Pose) -> None:
        """Sets the tool by its pose in the flange frame, at most 2 m long."""
        self._ask(rci.SetCoor(_pose_at_flange("T_flange_tool", T_flange_tool).as_row_major()))

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load at the flange.

        Args:
            mass: [kg], up to the arm's payload.
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2].
        """
        most = None if self._description is None else self._description.rated_payload
        kilograms = float(bounded_vector("mass", [mass], ("",), "kg", 0.0, most)[0])
        center = load_center(center_of_mass)
        try:
            flat = np.asarray(inertia, dtype=np.float64).ravel()
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidValueError("inertia", described(inertia), "is not 3 x 3 numbers [kg m^2]") from error
        names = [f"row {row}, column {column}" for row in (1, 2, 3) for column in (1, 2, 3)]
        values = bounded_vector("inertia", flat, names, "kg m^2")
        # A physically impossible body is refused here.
        Payload(mass=kilograms, center_of_mass=center, inertia=values.reshape(3, 3))
        self._ask(rci.SetLoad(kilograms, _floats(center), _floats(values)))

    def set_filters(self, joint: float, cartesian: float, torque: float) -> None:
        """Sets the cut-off frequencies of the controller's filters of commands, 0.1 to 1000 [Hz]; 1000 is off."""
        names = ("joint", "cartesian", "torque")
        values = bounded_vector(
            "cut-off frequency", [joint, cartesian, torque], names, "Hz", LOWEST_FREQUENCY, FILTER_OFF
        )
        self._ask(rci.SetFilters(*_floats(values)))

    def set_torque_filter_cut_off_frequency(self, frequency: float) -> None:
        """Sets the cut-off frequency of the reported torques' filter, 0.1 to 1000 [Hz]; 1000 switches it off."""
        values = bounded_vector("frequency", [frequency], ("",), "Hz", LOWEST_FREQUENCY, FILTER_OFF)
        self._ask(rci.SetTorqueFilterCutOffFrequency(float(values[0])))

    def set_fc_coor(
        self, T_flange_force: Pose, type: rci.ForceFrame | Literal["world", "tool", "path"] = rci.ForceFrame.WORLD
    ) -> None:
        """Sets the force-control frame: the axes of desired force, stiffness and `state.tau_ext_in_stiff`.

        Args:
            T_flange_force: Its pose in the flange frame.
            type: The reference of its axes: the base ("world"), the tool, or the path.
        """
        kind = member(rci.ForceFrame, "type", type)
        self._ask(rci.SetFcCoor(_pose_at_flange("T_flange_force", T_flange_force).as_row_major(), kind))

    def enable_virtual_guide(self, enable: bool) -> None:
        """Switches the virtual guide: walls at the faces of the safety box during hand guiding and under forces."""
        self._ask(rci.EnableVirtualGuide(flag("enable", enable)))

    def _joints(self) -> list[str]:
        return [f"joint {i + 1}" for i in range(self.n)]

    def _ask(self, request: rci.Request, also_good: IntEnum | None = None, timeout: float | None = None) -> None:
        self.require_done(request, self._request(request, timeout).status, also_good)

    def require_done(self, request: rci.Request, status: Any, also_good: IntEnum | None = None) -> None:
        """Requires a status of an answer that is no refusal.

        Raises:
            CommandRejectedError: The controller refuses the request.
        """
        if status == 0 or status == also_good:
            return
        reason = None
        if getattr(status, "name", "") in _TEMPORARY or status is rci.StartStatus.REFLEX:
            reason = find_refusal(self._request, lambda: self._link.latest)
        advice = _ADVICE.get((type(request), status), "") if reason is None else reason.sentence
        word = "" if reason is None else reason.word
        is_outside = status is rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED
        kind = ManualRecoveryError if is_outside else CommandRejectedError
        raise kind(type(request).__name__, status, advice, reason=word)

    def _request(self, request: rci.Request, timeout: float | None = None) -> Any:
        """Sends a request and returns the answer; every command uses this method."""
        return self._link.request(request, timeout)


def member(kind: type[_Member], name: str, value: object) -> _Member:
    """Returns the member of an enumeration for a value: the member itself, or its name in any case.

    Raises:
        InvalidValueError: There is no such member; the message lists all.
    """
    if isinstance(value, kind):
        return value
    if isinstance(value, str) and value.upper() in kind.__members__:
        return kind[value.upper()]
    known = ", ".join(repr(name.lower()) for name in kind.__members__)
    hint = ""
    if kind in _COUNTED_FROM_1 and isinstance(value, int) and 1 <= value <= len(kind):
        hint = f"; the manual's {value} is {list(kind)[value - 1].name.lower()!r}"
    raise InvalidValueError(name, described(value), f"is unknown; known: {known}{hint}")


def flag(name: str, value: object) -> bool:
    """Returns a switch as a bool; 0 and 1 are accepted.

    Raises:
        InvalidValueError: It is anything else, such as the text "off", which Python takes for true.
    """
    if isinstance(value, bool | np.bool_) or (isinstance(value, int) and value in (0, 1)):
        return bool(value)
    raise InvalidValueError(name, described(value), "must be True or False")


def load_center(center_of_mass: ArrayLike) -> Array:
    """Returns a load's centre of mass in the flange frame, [m], if the controller accepts its distance.

    Raises:
        InvalidValueError: It is not three finite numbers, or farther away.
    """
    center = bounded_vector("center_of_mass", center_of_mass, _AXES[:3], "m")
    _require_near("center_of_mass", center.tolist())
    return center


def _pose_at_flange(name: str, value: object) -> Pose:
    pose = as_pose(value, name)
    _require_near(name, pose.parts[1])
    return pose


def _require_near(name: str, position: Sequence[float]) -> None:
    length = math.hypot(*position)
    if not length <= LONGEST_TOOL:
        problem = f"m from the flange is farther than {LONGEST_TOOL:g} m; give metres"
        raise InvalidValueError(name, round(length, 6), problem)


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(values.tolist())
