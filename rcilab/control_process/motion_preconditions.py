"""Preconditions of a motion, checked before it is sent to the control process."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.conformance.certificate import Certificate, require_certificate
from rcilab.control_process.layout import MOTION_ROWS, MOTION_TIME, OPERATOR_TIMEOUT
from rcilab.control_process.status import SupervisorStatus
from rcilab.core.arrays import JointVector
from rcilab.core.errors import CertificateError, UsageError
from rcilab.core.state import Mode, require_mode
from rcilab.execution.start_pose_check import describe_start_mismatch
from rcilab.motion import Motion, require_motion

if TYPE_CHECKING:
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel


def require_admissible(
    motion: Motion,
    certificate: Certificate | None,
    model: RobotModel,
    status: SupervisorStatus,
    *,
    is_operator_overdue: bool,
    box: SafetyBox | None = None,
    mode: Mode = "joint_position",
) -> None:
    """Requires that the motion may begin now.

    Args:
        motion: The motion.
        certificate: Its certificate from `check`.
        model: The arm.
        status: Present status of the arm.
        is_operator_overdue: Whether an operator is expected and absent.
        box: The safety box of the controller.
        mode: How the arm is to be commanded.

    Raises:
        InvalidValueError: The motion or the certificate has another type, such as a report.
        CertificateError: The certificate is missing, or does not fit the motion, the model, or the position of the
            arm.
        UsageError: The arm is moving, no controller is connected, no operator is present, or the motion is too long.
    """
    require_motion(motion)
    require_certificate(certificate)
    require_mode(mode)
    q_c = require_ready(status, is_operator_overdue=is_operator_overdue)
    if certificate is None:
        raise CertificateError("the motion has not been checked: check(motion, model) first", ["certificate"])
    mismatch = describe_start_mismatch(motion.q[0], q_c)
    if mismatch is not None:
        raise CertificateError(mismatch, ["start state"])
    certificate.verify(motion, model, q_c, box, mode=mode)
    if len(motion.q) > MOTION_ROWS:
        raise UsageError(
            f"the motion takes {motion.duration:.1f} s, at most {MOTION_TIME:g} s are possible; split it"
        ).coded("long_motion", duration=f"{motion.duration:.1f}", most=f"{MOTION_TIME:g}")


def require_ready(status: SupervisorStatus, *, is_operator_overdue: bool) -> JointVector:
    """Returns the commanded joint angles, shape (n,), [rad], if the arm may be moved now.

    Args:
        status: Present status of the arm.
        is_operator_overdue: Whether an operator is expected and absent.

    Raises:
        UsageError: The arm is moving, no controller is connected, or no operator is present.
    """
    if status.phase in ("moving", "stopping"):
        raise UsageError("the arm is moving; stop it first, or wait until it has arrived").coded("moving")
    if status.q_c is None or status.phase not in ("idle", "fault"):
        raise UsageError(f"no motion is possible now: {status.message}").coded("not_ready")
    if is_operator_overdue:
        raise UsageError(f"the operator's page does not respond: no heartbeat for {OPERATOR_TIMEOUT:g} s").coded(
            "nobody", seconds=f"{OPERATOR_TIMEOUT:g}"
        )
    return status.q_c
