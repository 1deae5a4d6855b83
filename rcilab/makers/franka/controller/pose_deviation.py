"""The largest deviations of Move: of the tool from its commanded motion, on the path and at its end.

The client library sends 10 m, 3.12 rad and 2 pi rad unless its program has others: no arm deviates by that. With
commanded torques there is no path to deviate from.
"""

from __future__ import annotations

from math import dist, hypot, pi, remainder, tau
from typing import NamedTuple

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import rotation_between
from rcilab.i18n.translator import Remark
from rcilab.makers.franka.wire.requests import Move, Numbers
from rcilab.sim.virtual_arm import CycleSignals

_ANY: Numbers = (10.0, pi, pi)
_QUANTITIES = (("position", "m"), ("orientation", "rad"), ("elbow", "rad"))


class PoseDeviations(NamedTuple):
    """Largest deviations of a motion: of the position, the orientation and the elbow, [m, rad, rad]."""

    path: Numbers = _ANY
    goal: Numbers = _ANY

    @classmethod
    def of(cls, request: Move) -> PoseDeviations:
        """Returns those of a Move.

        Raises:
            InvalidValueError: One of them is not zero or more.
        """
        found = cls(request.path_deviation, request.goal_deviation)
        for name, bounds in zip(("path", "goal"), found, strict=True):
            if not all(bound >= 0.0 for bound in bounds):  # Also for NaN.
                raise InvalidValueError(f"{name} deviation", bounds, "must be 0 or more [m, rad, rad]")
        return found


def find_deviation(signals: CycleSignals, bounds: Numbers) -> Remark | None:
    """Returns how much the measured tool is too far from the commanded one, or None.

    Args:
        signals: Of a cycle.
        bounds: Largest deviations of position, orientation and elbow, [m, rad, rad].
    """
    tool, tool_c = signals.tool, signals.tool_c
    if tool.matrix is tool_c.matrix:  # The joints are exactly at their reference.
        return None
    (R, p), (R_c, p_c) = tool.pose.parts, tool_c.pose.parts
    found = dist(p, p_c), hypot(*rotation_between(R, R_c)), abs(remainder(tool.psi - tool_c.psi, tau))
    for value, bound, (name, unit) in zip(found, bounds, _QUANTITIES, strict=True):
        if value > bound:
            sentence = f"the {name} deviates from the commanded one by {value:.4g} {unit}, more than {bound:g} {unit}"
            return Remark(sentence, f"deviation_{name}", value=value, bound=bound, unit=unit)
    return None
