"""The measurements in the last cycles of a motion that the controller stopped: the joint, its value and its bound."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rcilab.conformance.common_conditions import compliant_limits
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.conformance.measured_monitor import MeasuredMonitor, find_collision_joint
from rcilab.core.arrays import Array, JointVector
from rcilab.core.errors import KinematicsError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox
from rcilab.core.state import COMPLIANT_MODES, ControllerMode
from rcilab.i18n.translator import Remark
from rcilab.makers.command_findings import find_lost_commands
from rcilab.makers.rokae.conditions import RCI_MEASURED_CONDITIONS
from rcilab.makers.rokae.faults import BOX_FAULTS, RANGE_FAULTS, Fault

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_NEAR_LIMIT = math.radians(1.0)  # [rad] A joint farther inside was not near the known limits.
_CARTESIAN = (ControllerMode.CARTESIAN_POSITION, ControllerMode.CARTESIAN_IMPEDANCE)
YIELDING_MODES = tuple(ControllerMode[mode.upper()] for mode in COMPLIANT_MODES)
"""`COMPLIANT_MODES` as the state reports them."""


class _Measured(NamedTuple):
    """The last cycles, checked as by our virtual controller; a real one may allow less."""

    violations: list[LimitViolation]
    ddq: Array
    """Low-passed joint accelerations, shape (N, n), [rad/s^2]."""


def describe_measured(
    faults: Iterable[Fault],
    record: NDArray[np.void],
    model: RobotModel,
    limits: Limits,
    mode: ControllerMode,
    collision_thresholds: JointVector | None = None,
) -> Iterator[str]:
    """Yields the measurements in the last cycles that belong to the faults.

    Args:
        faults: The reported faults.
        record: The last cycles, see `cycle_dtype`.
        model: The arm with its tool and load.
        limits: Its bounds.
        mode: The command mode.
        collision_thresholds: Those of the controller, shape (n,), [N m]; None: unknown.
    """
    faults = set(faults)
    if not len(record):
        return
    measured = _check_record(record, model, limits, mode)
    remarks = {violation.condition.fault: violation.remark for violation in measured.violations}
    joint = limits.joint
    for fault, condition, values, bounds, unit in (
        (
            Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION,
            "measured.joint.velocity",
            record["dq"],
            joint.velocity,
            "rad/s",
        ),
        (
            Fault.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION,
            "measured.joint.acceleration",
            measured.ddq,
            joint.acceleration,
            "rad/s^2",
        ),
    ):
        if fault in faults and fault not in remarks:
            index = np.unravel_index((np.abs(values) / bounds).argmax(), values.shape)
            number, value, bound = int(index[1]) + 1, float(values[index]), float(bounds[index[1]])
            remarks[fault] = Remark(
                f"joint {number} was measured at {value:.3g} {unit} (commands: {bound:g} {unit})",
                "nearest",
                condition=condition,
                joint=number,
                value=value,
                bound=bound,
                unit=unit,
            )
    yield from (text for fault, text in remarks.items() if fault in faults and fault not in RANGE_FAULTS)
    if RANGE_FAULTS & faults:
        yield _describe_range(faults, record, limits)
    if Fault.COLLISION in faults and np.isfinite(record["tau_ext_in_base"][-1]).all():
        yield _describe_collision(record, model, limits, collision_thresholds)
    lost = find_lost_commands(record) if Fault.INSTABILITY_DETECTION in faults else ""
    if lost:
        yield lost


def describe_passed_face(faults: Iterable[Fault], record: NDArray[np.void], box: SafetyBox | None) -> str:
    """Returns the face of the safety box that the tool exceeded, and by how much; "" if that is unknown.

    For a face that the tool was beyond in the first of these cycles, only the distance that it moved outwards counts.
    """
    if box is None or not BOX_FAULTS & set(faults) or not len(record):
        return ""
    passed = []
    for field in ("command_pose", "T_base_tool"):
        path = record[field][:, :3, 3]
        positions = path[np.isfinite(path).all(axis=1)].tolist()
        if positions:
            entered = EntryBox(box, positions[0])
            passed += map(entered.exceeded_face, positions)
    if not passed:
        return ""
    _, face, beyond = max(passed)
    away = max(beyond, 0.0)
    sentence = f"the tool came {1e3 * away:.1f} mm past the {face} face of the safety box"
    return Remark(sentence, "past_face", away=away, face=face)


def _check_record(record: NDArray[np.void], model: RobotModel, limits: Limits, mode: ControllerMode) -> _Measured:
    monitor = MeasuredMonitor(
        compliant_limits(limits) if mode in YIELDING_MODES else limits, rows=RCI_MEASURED_CONDITIONS
    )
    monitor.reset(record["q"][0].tolist())
    ddq, violations = np.zeros((len(record), model.n)), []
    for row, (q, dq) in enumerate(zip(record["q"], record["dq"], strict=True)):
        twist, psi = None, None
        if mode in _CARTESIAN:
            twist, psi = (model.jacobian(q) @ dq).tolist(), _arm_angle(model, q)
        if monitor.step(q.tolist(), dq.tolist(), (0.0, 0.0, 0.0), twist, psi):
            violations += monitor.violations()
        ddq[row] = monitor.acceleration
    return _Measured(violations, ddq)


def _arm_angle(model: RobotModel, q: Array) -> float | None:
    if not model.redundancy:
        return None
    try:
        return model.arm_angle(q)
    except KinematicsError:
        return None


def _describe_range(faults: set[Fault], record: NDArray[np.void], limits: Limits) -> str:
    joint, is_measured = limits.joint, Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION in faults
    q = record["q"] if is_measured else record["q_c"]
    beyond = np.maximum(joint.lower - q, q - joint.upper)
    index = np.unravel_index(beyond.argmax(), q.shape)
    if beyond[index] < -_NEAR_LIMIT:
        return "every joint was inside the limits of this model: the controller has narrower ones (set_joint_limit)"
    low, high = math.degrees(joint.lower[index[1]]), math.degrees(joint.upper[index[1]])
    was = "measured" if is_measured else "commanded"
    number, value = int(index[1]) + 1, float(q[index])
    return Remark(
        f"joint {number} was {was} at {math.degrees(value):.2f} deg (from {low:.2f} to {high:.2f} deg)",
        "joint_range",
        condition="measured.joint.position" if is_measured else "joint.position",
        joint=number,
        value=value,
        low=float(joint.lower[index[1]]),
        high=float(joint.upper[index[1]]),
    )


def _describe_collision(
    record: NDArray[np.void], model: RobotModel, limits: Limits, thresholds: JointVector | None
) -> str:
    """Returns the external torque at the joint of the collision, from the estimated wrench at the tool."""
    last, known = record[-1], limits.joint.collision_threshold if thresholds is None else thresholds
    wrench = last["tau_ext_in_base"]
    external = np.abs(model.jacobian(last["q"]).T @ wrench)
    joint = find_collision_joint(external.tolist(), known.tolist())
    bound = f"its threshold is {known[joint]:g} N m"
    if thresholds is None:
        bound = f"its threshold is at most {known[joint]:g} N m, set_collision_behavior sets it"
    return Remark(
        f"an external force of {np.linalg.norm(wrench[:3]):.3g} N acts at the tool, which is "
        f"{external[joint]:.3g} N m on joint {joint + 1} ({bound})",
        "collision",
        joint=joint + 1,
        value=float(external[joint]),
        bound=float(known[joint]),
        unit="N m",
    )
