"""One provoked fault: what was sent, what the controller reported, the cause, and the recovery."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rcilab.app.fault_lab.signals import FaultSignal
from rcilab.app.text import Text
from rcilab.conformance.explain import explain_axis, explain_formula, explain_quantity, explain_source
from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Condition
from rcilab.core.cycle_log import state_cycles
from rcilab.core.fault import FaultCode
from rcilab.core.limits import Limits
from rcilab.i18n.locale import Language
from rcilab.i18n.units import USUAL, Units
from rcilab.makers.scenario import FaultScenario
from rcilab.model.robot_model import RobotModel
from rcilab.motion import Motion

if TYPE_CHECKING:
    from rcilab.motion import Motion

RecoveryStep: TypeAlias = Literal["release", "network", "recover", "refused", "power_off", "widen", "power_on", "move"]
"""One step of the recovery from a fault."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FaultDemo:
    """A fault that a controller has reported, with the cycles that led to it."""

    fault: FaultCode
    scenario: FaultScenario
    model: RobotModel
    limits: Limits
    """The limits of the check, with their scaling."""
    reported: tuple[FaultCode, ...]
    """Every error bit that was set in that cycle, in wire order."""
    sentence: str
    """The controller's own sentence, with its numbers."""
    cycles: NDArray[np.void]
    """Recorded cycles from the first command on (`core.cycle_log.cycle_dtype`); the last one shows the fault."""
    after: NDArray[np.void]
    """Recorded cycles after the fault, in which the controller stops the arm; they contain no commands."""
    signal: FaultSignal | None
    """The quantity that violated its condition, cycle by cycle; None of a request."""
    way_out: tuple[RecoveryStep, ...]
    """The steps of the recovery, in this order; afterwards the arm moved again."""

    @property
    def sample(self) -> int:
        """The row of `cycles` in which the fault was reported."""
        return len(self.cycles) - 1

    @property
    def time(self) -> float:
        """Time of the report, from the first command, [s]; also on the clock of `commanded` and `moved`."""
        return float(self.cycles["t"][-1])

    @property
    def cycle(self) -> int:
        """Cycle of the report, counted from the first command; above `sample` if states were dropped."""
        return round(self.time / CYCLE_TIME)

    @property
    def whole(self) -> NDArray[np.void]:
        """All recorded cycles: up to the fault, and the controlled stop."""
        return np.concatenate((self.cycles, self.after))

    @property
    def q(self) -> JointVector:
        """Measured joint angles at that time, shape (n,), [rad]."""
        return readonly_copy(self.cycles["q"][-1])

    @property
    def condition(self) -> Condition | None:
        """The violated condition: formula, unit, source; None without a signal."""
        return None if self.signal is None else self.signal.condition

    @property
    def value(self) -> float:
        """The value that violated it, in the condition's unit; NaN without a signal."""
        return math.nan if self.signal is None else self.signal.value

    @property
    def bound(self) -> float:
        """The violated bound; NaN without a signal."""
        return math.nan if self.signal is None else self.signal.bound

    @property
    def place(self) -> str:
        """Location of the value: "joint 1", "tool", "elbow", "network"; "" without a signal."""
        return "" if self.signal is None else self.signal.condition.location(self.signal.axis)

    @property
    def source(self) -> str:
        """Source of condition and bound; "" without a signal."""
        return "" if self.signal is None else self.signal.condition.source

    @property
    def commanded(self) -> Motion:
        """The commanded joint angles: those sent, with the wrong one; or the controller's solution of poses.

        After the fault they are the controller's stop. Torque commands have no joint angles: the motion stays at its
        start.
        """
        q, sent = np.array(self.whole["q_c"]), self.cycles["command"][:-1]
        if self.scenario.mode == "torque":
            q[:] = q[0]
        elif np.isfinite(sent).all():
            q[1 : len(self.cycles)] = sent
        return self._as_motion(q)

    @property
    def moved(self) -> Motion:
        """The motion to draw: commanded, if a position command was wrong, otherwise measured."""
        if self.scenario.is_commanded:
            return self.commanded
        return self._as_motion(self.whole["q"])

    def _as_motion(self, q: Array) -> Motion:
        """Returns the joint angles of all rows, shape (N, n), [rad], as a motion; dropped states are interpolated."""
        period, known = state_cycles(self.cycles), self.whole["message_id"].astype(np.float64)
        wanted: Array = np.arange(float(known[0]), float(known[-1]) + 1.0, period)
        every: list[Array] = [np.interp(wanted, known, q[:, joint]) for joint in range(q.shape[1])]
        return Motion.from_cycles(np.stack(every, axis=1), period)

    def describe(
        self, what: Literal["sent", "explanation", "prevention"], language: Language = "en", units: Units = USUAL
    ) -> str:
        """Returns what was sent, why the controller stops for it, or how to avoid it.

        Raises:
            InvalidValueError: The language is not supported.
        """
        text = Text(language, units)
        for key in (f"{what}.{self.fault.key}.{self.model.name}", f"{what}.{self.fault.key}"):
            if text.has(key):
                return text(key)
        return {"explanation": self.fault.cause}.get(what, self.fault.remedy)

    def recovery_steps(self, language: Language = "en") -> tuple[str, ...]:
        """Returns the steps of the recovery as texts.

        Raises:
            InvalidValueError: The language is not supported.
        """
        text = Text(language)
        return tuple(text(f"demo.step.{step}") for step in self.way_out)

    @property
    def script(self) -> str:
        """Python that provokes the same fault."""
        return script(self.fault, self.model.name)

    def explain(self, language: Language = "en") -> str:
        """Returns a summary in a few lines.

        Raises:
            InvalidValueError: The language is not supported.
        """
        text = Text(language)
        return "\n".join(
            (
                f"{self.fault.manual_name}: {self.describe('explanation', language)}",
                f"  {text('demo.head.sent')} {self.describe('sent', language)}",
                *self._explain_condition(text, language),
                f"  {text('demo.head.remedy')} {self.describe('prevention', language)}",
                f"  {text('demo.head.way_out')} {' → '.join(self.recovery_steps(language))}",
            )
        )

    def _explain_condition(self, text: Text, language: Language) -> list[str]:
        row = self.condition
        if row is None:
            return []
        assert self.signal is not None
        number = text(
            "demo.number", quantity=explain_quantity(row, language), value=f"{self.value:.4g}",
            bound=f"{self.bound:.4g}", unit=row.unit, time=f"{self.time:.3f}",
            place=explain_axis(row, self.signal.axis, language),
        )  # fmt: skip
        line = text("joined", first=explain_formula(row, language), second=number)
        return [f"  {text('demo.head.condition')} {line} [{explain_source(row, language)}]"]

    def __str__(self) -> str:
        return self.explain()

    def __repr__(self) -> str:
        return f"<FaultDemo {self.fault.manual_name} at t = {self.time:.3f} s: {self.sentence}>"


def script(fault: FaultCode, model: str) -> str:
    """Returns Python that provokes a fault on a private virtual controller and prints the result."""
    return (
        "from rcilab.app import fault_lab\n\n"
        f'demo = fault_lab.provoke("{fault.manual_name}", model="{model}")\n'
        "print(demo)\n"
        'print(demo.cycles[["t", "q"]][-3:])  # The flight recorder: the last cycles up to the fault.\n'
    )
