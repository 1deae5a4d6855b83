"""One broken condition in one cycle, with its numbers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from rcilab.conformance.condition import Condition
from rcilab.faults import Fault

if TYPE_CHECKING:
    from rcilab.kinematics.collision import LinkPair


class Breach(NamedTuple):
    """What a monitor's last step broke."""

    condition: Condition
    axis: int
    """The joint, from 1; 0 for a norm, an arm angle or anything else that has no axis."""
    value: float
    """In the condition's unit."""
    bound: float
    """The bound that it passed."""
    links: LinkPair | None = None
    """Between whom, for a distance."""

    @property
    def text(self) -> str:
        """The fact in words: "joint 2: commanded velocity 2.3 rad/s passes 2.175 rad/s"."""
        row = self.condition
        if row.is_clearance:
            return f"{self.links}: {row.quantity} {self.value:.4g} m is not above {self.bound:g} m"
        if row.signal == "position":
            return f"{row.place(0)}: {row.quantity} is {self.value:.4g} m outside the safety box"
        if row.signal == "frame":
            return f"{row.place(0)}: {row.quantity} is improper, out of reach or singular"
        if row.signal == "elbow_sign":
            return f"{row.place(0)}: it is flipped to the other side than at the start"
        return f"{row.place(self.axis)}: {row.quantity} {self.value:.6g} {row.unit} passes {self.bound:.6g} {row.unit}"


def describe_breaches(breaches: Iterable[Breach]) -> str:
    """Returns all of them in one line."""
    return "; ".join(breach.text for breach in breaches)


def faults_of(breaches: Iterable[Breach]) -> tuple[Fault, ...]:
    """Returns the faults of the RCI that they raise, in wire order and once each."""
    return tuple(sorted({fault for row, *_ in breaches if isinstance(fault := row.fault, Fault)}))
