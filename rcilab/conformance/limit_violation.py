"""A violation of one condition in one cycle."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from rcilab.core.clearance import LinkPair
from rcilab.core.condition import Condition
from rcilab.core.fault import FaultCode
from rcilab.i18n.rounding import format_pair
from rcilab.i18n.translator import Remark


class LimitViolation(NamedTuple):
    """A violation in a monitor's last step."""

    condition: Condition
    axis: int
    """The joint, from 1; 0 for quantities without an axis, such as a norm or the arm angle."""
    value: float
    """Value, in the condition's unit."""
    bound: float
    """The violated bound."""
    links: LinkPair | None = None
    """The two links of a distance."""

    @property
    def text(self) -> str:
        """The violation as text: "joint 2: commanded velocity 2.3 rad/s passes 2.175 rad/s"."""
        row = self.condition
        if row.is_clearance:
            return f"{self.links}: {row.quantity} {self.value:.4g} m is not above {self.bound:g} m"
        if row.signal == "position":
            return f"{row.location(0)}: {row.quantity} is {self.value:.4g} m outside the safety box"
        if row.signal == "frame":
            return f"{row.location(0)}: {row.quantity} is improper, out of reach or singular"
        if row.signal == "elbow_sign":
            return f"{row.location(0)}: it is flipped to the other side than at the start"
        value, bound = format_pair(self.value, self.bound, min_digits=6)
        return f"{row.location(self.axis)}: {row.quantity} {value} {row.unit} {self._verb} {bound} {row.unit}"

    @property
    def remark(self) -> Remark:
        """The violation as a code with values, for translated user interfaces."""
        row = self.condition
        if row.is_clearance:
            return Remark(self.text)
        if row.signal == "position":
            return Remark(self.text, "outside_box", condition=row.id, away=self.value)
        if row.signal in ("frame", "elbow_sign"):
            return Remark(self.text, "broken", condition=row.id)
        amounts = {"value": self.value, "bound": self.bound, "unit": row.unit}
        if self.axis and row.is_per_joint:
            return Remark(self.text, f"joint_{self._verb}", condition=row.id, joint=self.axis, **amounts)
        return Remark(self.text, self._verb, condition=row.id, **amounts)

    @property
    def _verb(self) -> str:
        """What the value does to its bound, which itself is not allowed."""
        return "reaches" if self.value == self.bound else "passes"


def faults_of(violations: Iterable[LimitViolation]) -> tuple[FaultCode, ...]:
    """Returns the faults that the violations raise, sorted by number, once each."""
    return tuple(sorted({row.fault for row, *_ in violations if row.fault is not None}))
