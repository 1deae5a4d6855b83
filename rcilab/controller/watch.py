"""What the controller makes of its sensors: where the tool is, what presses on the arm, and whether that is allowed."""

from __future__ import annotations

from collections.abc import Sequence
from operator import gt

from rcilab.conformance.breach import describe_breaches
from rcilab.conformance.measured_conditions import yielding_limits
from rcilab.conformance.measured_monitor import MeasuredMonitor
from rcilab.controller.commanded import CommandedMotion
from rcilab.controller.observer import Observer
from rcilab.controller.plant import Measurement
from rcilab.controller.tool import ToolMotion
from rcilab.faults import Fault
from rcilab.limits import Limits
from rcilab.model import RobotModel
from rcilab.safety_box import EntryBox, SafetyBox
from rcilab.words.text import Remark

_ANYWHERE = (0.0, 0.0, 0.0)
_NO_REASON = Remark("")
_LEAST = 1e-3  # [N m] So that a threshold of zero divides nothing by zero; the client has it too.


class Watch:
    """Follows the measured arm. Owned by the controller's cycle.

    Attributes:
        measured: The last measurement.
        tool: The tool as measured.
        tau_ext: Outside joint torques, shape (n,), [N m].
        wrench: Outside wrench on the tool, base axes, shape (6,), [N, N m].

    Args:
        model: The arm with its tool and load.
        measured: Where it rests.
    """

    def __init__(self, model: RobotModel, measured: Measurement) -> None:
        self.configure(model, measured)

    def configure(self, model: RobotModel, measured: Measurement) -> None:
        """Takes another tool or load, or an arm that was put elsewhere; only at rest."""
        self._model = model
        self.tool = ToolMotion(model, measured.q.tolist())
        self._observer = Observer(model)
        self._observer.reset(measured)
        self.measured = measured
        self.tau_ext, self.wrench = self._observer.step(measured)
        self._monitor: MeasuredMonitor | None = None
        self._thresholds: Sequence[float] = ()
        self._judges_tool = False
        self._tool_version: int = -1
        self._q: list[float] = measured.q.tolist()
        self._dq: list[float] = measured.dq.tolist()

    def begin(
        self,
        limits: Limits,
        box: SafetyBox | EntryBox | None,
        thresholds: Sequence[float],
        *,
        judges_tool: bool,
        yields: bool,
    ) -> None:
        """Begins to judge a motion.

        Args:
            limits: Bounds of the arm, soft limits included.
            box: Where the tool shall stay; None is anywhere.
            thresholds: Outside joint torques that are a collision, n numbers, [N m].
            judges_tool: Whether the motion is one of the tool, so that its speed and the arm angle's count.
            yields: Whether forces move the arm, and not its commands alone.
        """
        self._monitor = MeasuredMonitor(yielding_limits(limits) if yields else limits, box)
        self._monitor.reset(self.measured.q.tolist())
        self._thresholds = thresholds
        self._judges_tool = judges_tool

    def observe(self, measured: Measurement, commanded: CommandedMotion, tool_c: ToolMotion) -> None:
        """Takes the measurement of this cycle; where the arm is exactly where it was told, so is the tool."""
        if measured is not self.measured or commanded.version != self._tool_version:
            self.measured, self._tool_version = measured, commanded.version
            self._q, self._dq = q, dq = measured.q.tolist(), measured.dq.tolist()
            if q == commanded.q and dq == commanded.dq:
                self.tool.coincide(tool_c)
            else:
                self.tool.observe(q, self._model.rigid_body.tool_terms(measured.q, measured.dq))
        self.tau_ext, self.wrench = self._observer.step(measured)

    def judge(self, *, is_commanded: bool = True) -> tuple[tuple[Fault, ...], Remark]:
        """Returns the faults that the measurement of this cycle raises, in wire order, and why.

        Args:
            is_commanded: Whether a client's commands are followed; without, tool speed and arm angle do not count.
        """
        monitor, tool = self._monitor, self.tool
        assert monitor is not None
        twist, psi = (tool.twist, tool.psi) if self._judges_tool and is_commanded else (None, None)
        position = tool.position if monitor.has_box else _ANYWHERE
        faults = monitor.step(self._q, self._dq, position, twist, psi)
        reasons = [describe_breaches(monitor.broken())] if faults else []
        collision = self.find_collision(self._thresholds)
        if collision is not None:
            faults = (*faults, Fault.COLLISION)
            reasons.append(collision)
        return faults, Remark.all(reasons) if reasons else _NO_REASON

    def find_collision(self, thresholds: Sequence[float]) -> Remark | None:
        """Returns which outside torque is farthest above its threshold, in words, or None."""
        torques: list[float] = self.tau_ext.tolist()
        if not any(map(gt, map(abs, torques), thresholds)):
            return None
        # As the client does: several joints pass theirs at once, and both ends name the same one.
        beyond = (i for i, torque in enumerate(torques) if abs(torque) > thresholds[i])
        joint = max(beyond, key=lambda i: abs(torques[i]) / max(thresholds[i], _LEAST))
        torque, threshold = torques[joint], thresholds[joint]
        said = f"joint {joint + 1}: external torque {torque:.3g} N m is above its threshold {threshold:g} N m"
        return Remark(said, "collision", joint=joint + 1, value=f"{torque:.3g} N m", bound=f"{threshold:g} N m")
