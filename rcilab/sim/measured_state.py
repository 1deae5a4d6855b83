"""Values derived from the sensors: the pose of the tool, the external forces, and violated conditions."""

from __future__ import annotations

from collections.abc import Sequence
from operator import gt

from rcilab.conformance.common_conditions import compliant_limits, unlimited_accelerations
from rcilab.conformance.measured_monitor import MeasuredMonitor, find_collision_joint
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox
from rcilab.i18n.rounding import format_pair
from rcilab.i18n.translator import Remark
from rcilab.model.robot_model import RobotModel
from rcilab.sim.momentum_observer import MomentumObserver
from rcilab.sim.plant import Measurement
from rcilab.sim.reference_trajectory import ReferenceTrajectory
from rcilab.sim.tool_kinematics import ToolKinematics
from rcilab.sim.violations import ArmCondition, ArmViolation, Violations

_ANYWHERE = (0.0, 0.0, 0.0)


class MeasuredStateMonitor:
    """Monitors the measured arm. Owned by the virtual arm.

    Attributes:
        measured: The last measurement.
        tool: The tool as measured.
        tau_ext: External joint torques, shape (n,), [N m].
        wrench: External wrench on the tool, base axes, shape (6,), [N, N m].

    Args:
        model: The arm with its tool and load.
        measured: The measurement at standstill.
    """

    def __init__(self, model: RobotModel, measured: Measurement) -> None:
        self.configure(model, measured)

    def configure(self, model: RobotModel, measured: Measurement) -> None:
        """Sets another tool or load, or another position of the arm; only at standstill."""
        self._model = model
        self.tool = ToolKinematics(model, measured.q.tolist())
        self._observer = MomentumObserver(model)
        self._observer.reset(measured)
        self.measured = measured
        self.tau_ext, self.wrench = self._observer.step(measured)
        self._monitor: MeasuredMonitor | None = None
        self._thresholds: Sequence[float] = ()
        self._checks_tool = False
        self._tool_version: int = -1
        self._q: list[float] = measured.q.tolist()
        self._dq: list[float] = measured.dq.tolist()

    def begin(
        self,
        limits: Limits,
        box: SafetyBox | EntryBox | None,
        thresholds: Sequence[float],
        *,
        checks_tool: bool,
        checks_accelerations: bool = True,
        is_compliant: bool,
    ) -> None:
        """Begins to check a motion.

        Args:
            limits: Bounds of the arm, soft limits included.
            box: Safety box of the tool; None without one.
            thresholds: External joint torques that count as a collision, n numbers, [N m].
            checks_tool: Whether tool poses are commanded, so that tool speed and arm angle are checked.
            checks_accelerations: Whether accelerations and the speed of the arm angle are checked.
            is_compliant: Whether external forces move the arm.
        """
        if not checks_accelerations:
            limits = unlimited_accelerations(limits)
        self._monitor = MeasuredMonitor(compliant_limits(limits) if is_compliant else limits, box)
        self._monitor.reset(self.measured.q.tolist())
        self._thresholds = thresholds
        self._checks_tool = checks_tool

    def observe(self, measured: Measurement, commanded: ReferenceTrajectory, tool_c: ToolKinematics) -> None:
        """Processes the measurement of this cycle; if the joints are exactly at their reference, so is the tool."""
        if measured is not self.measured or commanded.version != self._tool_version:
            self.measured, self._tool_version = measured, commanded.version
            self._q, self._dq = q, dq = measured.q.tolist(), measured.dq.tolist()
            if q == commanded.q and dq == commanded.dq:
                self.tool.coincide(tool_c)
            else:
                self.tool.observe(q, self._model.rigid_body.tool_terms(measured.q, measured.dq))
        self.tau_ext, self.wrench = self._observer.step(measured)

    def check(self, *, is_commanded: bool = True) -> Violations:
        """Returns the violations of this cycle's measurement.

        Args:
            is_commanded: Whether commands are followed; if not, tool speed and arm angle are not checked.
        """
        monitor, tool = self._monitor, self.tool
        assert monitor is not None
        twist, psi = (tool.twist, tool.psi) if self._checks_tool and is_commanded else (None, None)
        position = tool.position if monitor.has_box else _ANYWHERE
        violations: Violations = tuple(monitor.step(self._q, self._dq, position, twist, psi))
        collision = self.find_collision(self._thresholds)
        return violations if collision is None else (*violations, ArmViolation(ArmCondition.NO_COLLISION, collision))

    def find_collision(self, thresholds: Sequence[float]) -> Remark | None:
        """Returns the external torque that is farthest above its threshold, as a remark, or None."""
        torques: list[float] = self.tau_ext.tolist()
        if not any(map(gt, map(abs, torques), thresholds)):
            return None
        joint = find_collision_joint(torques, thresholds)
        torque, threshold = torques[joint], thresholds[joint]
        size, bound = format_pair(abs(torque), threshold)
        sentence = f"joint {joint + 1}: external torque {size} N m is above its threshold {bound} N m"
        return Remark(sentence, "collision", joint=joint + 1, value=torque, bound=threshold, unit="N m")
