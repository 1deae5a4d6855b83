"""What the gallery shows of one fault: what was sent, what the controller reported, why, and how to go on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rcilab.app.fault_lab.signals import Signal
from rcilab.app.text import Text
from rcilab.conformance.explain import explain_formula, explain_source
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

Step: TypeAlias = Literal["release", "network", "recover", "refused", "power_off", "widen", "power_on", "move"]
"""One step of the way out of a fault."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FaultDemo:
    """A fault that a controller has really reported, with the cycles that led to it."""

    fault: FaultCode
    scenario: FaultScenario
    model: RobotModel
    limits: Limits
    """What the arm was checked by, narrowed limits included."""
    reported: tuple[FaultCode, ...]
    """Every error bit that was set in that cycle, in wire order."""
    said: str
    """The controller's own words and numbers."""
    cycles: NDArray[np.void]
    """Recorded cycles from the first command on (`core.cycle_log.cycle_dtype`); the last one shows the fault."""
    after: NDArray[np.void]
    """Recorded cycles after the fault, in which the controller brings the arm to rest; nothing is commanded in them."""
    signal: Signal
    """What broke its condition, cycle by cycle."""
    way_out: tuple[Step, ...]
    """What was done to get out of it, in this order; afterwards the arm moved again."""

    @property
    def sample(self) -> int:
        """The row of `cycles` in which the fault was reported."""
        return len(self.cycles) - 1

    @property
    def time(self) -> float:
        """When it was reported, since the first command, [s]."""
        return float(self.cycles["t"][-1])

    @property
    def moment(self) -> float:
        """The same on the clock of `commanded` and `moved`, in which rows that were dropped are left out, [s]."""
        return self.sample * self._period * CYCLE_TIME

    @property
    def _period(self) -> int:
        """Cycles from one row to the next."""
        return state_cycles(self.cycles)

    @property
    def whole(self) -> NDArray[np.void]:
        """All recorded cycles: up to the fault, and the controlled stop."""
        return np.concatenate((self.cycles, self.after))

    @property
    def q(self) -> JointVector:
        """Where the arm was then, measured, shape (n,), [rad]."""
        return readonly_copy(self.cycles["q"][-1])

    @property
    def condition(self) -> Condition:
        """The condition that was broken: formula, unit, source."""
        return self.signal.condition

    @property
    def value(self) -> float:
        """What broke it, in the condition's unit."""
        return self.signal.value

    @property
    def bound(self) -> float:
        """The bound that it passed."""
        return self.signal.bound

    @property
    def place(self) -> str:
        """Whose value it is: "joint 1", "tool", "elbow", "network"."""
        return self.condition.location(self.signal.axis)

    @property
    def source(self) -> str:
        """Where condition and bound come from."""
        return self.condition.source

    @property
    def commanded(self) -> Motion:
        """The joint angles that were commanded: those sent, the wrong one too; or what the controller made of poses.

        After the fault it is the controller's way to rest. While torques are commanded no angles are: the motion stands
        at the start.
        """
        q, sent = self._every_cycle("q_c"), self.cycles["command"][:-1]
        if self.scenario.mode == "torque":
            q[:] = q[0]
        elif np.isfinite(sent).all():
            q[1 : len(self.cycles)] = sent
        return Motion.from_cycles(q, self._period)

    @property
    def moved(self) -> Motion:
        """Where to look for the arm: as commanded where a command of a place was wrong, otherwise as measured."""
        if self.scenario.is_commanded:
            return self.commanded
        return Motion.from_cycles(self._every_cycle("q"), self._period)

    def _every_cycle(self, name: str) -> Array:
        """Returns joint angles of every cycle, shape (N, n), [rad]; between states that were dropped, interpolated."""
        stop = np.concatenate((self.cycles[-1:], self.after))
        known: Array = np.array(stop["message_id"], np.float64)
        wanted: Array = np.arange(float(known[0]) + self._period, float(known[-1]) + 1.0, self._period)
        angles: Array = np.array(stop[name], np.float64)
        after: list[Array] = [np.interp(wanted, known, angles[:, joint]) for joint in range(angles.shape[1])]
        return np.concatenate((self.cycles[name], np.stack(after, axis=1)))

    def describe(
        self, what: Literal["sent", "explanation", "prevention"], language: Language = "en", units: Units = USUAL
    ) -> str:
        """Returns what was done, why the controller stops for it, or how to avoid it.

        Raises:
            InvalidValueError: There is no such language.
        """
        text = Text(language, units)
        key = f"{what}.{self.fault.key}"
        return text(key) if text.has(key) else {"explanation": self.fault.cause}.get(what, self.fault.remedy)

    def tell_way_out(self, language: Language = "en") -> tuple[str, ...]:
        """Returns the steps that led out of it, in words.

        Raises:
            InvalidValueError: There is no such language.
        """
        text = Text(language)
        return tuple(text(f"demo.step.{step}") for step in self.way_out)

    @property
    def script(self) -> str:
        """Python that does the same."""
        return script(self.fault, self.model.name)

    def explain(self, language: Language = "en") -> str:
        """Returns all of it in a few lines.

        Raises:
            InvalidValueError: There is no such language.
        """
        row, text = self.condition, Text(language)
        formula, source = explain_formula(row, language), explain_source(row, language)
        number = text(
            "demo.number", value=f"{self.value:.4g}", bound=f"{self.bound:.4g}", unit=row.unit,
            time=f"{self.time:.3f}",
        )  # fmt: skip
        return "\n".join(
            (
                f"{self.fault.manual_name}: {self.describe('explanation', language)}",
                f"  {text('demo.head.sent')} {self.describe('sent', language)}",
                f"  {text('demo.head.condition')} {formula}; {self.place}: {number} [{source}]",
                f"  {text('demo.head.remedy')} {self.describe('prevention', language)}",
                f"  {text('demo.head.way_out')} {' → '.join(self.tell_way_out(language))}",
            )
        )

    def __str__(self) -> str:
        return self.explain()

    def __repr__(self) -> str:
        return f"<FaultDemo {self.fault.manual_name} at t = {self.time:.3f} s: {self.said}>"


def script(fault: FaultCode, model: str) -> str:
    """Returns Python that provokes a fault on a private virtual controller and prints what came of it."""
    return (
        "from rcilab.app import fault_lab\n\n"
        f'demo = fault_lab.provoke("{fault.manual_name}", model="{model}")\n'
        "print(demo)\n"
        'print(demo.cycles[["t", "q"]][-3:])  # The flight recorder: the last cycles up to the fault.\n'
    )
