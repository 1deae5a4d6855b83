"""The five controller modes: which pairs of modes StartMove can ask for, and the motion generator of each.

A mode is two things: what the client commands (a generator: joint angles, tool poses, torques), and what the drives
make of it (a `Law`). Pairs that are not in the table are refused as not possible.
"""

from __future__ import annotations

from typing import Final

from rcilab.core.state import ControllerMode
from rcilab.makers.rokae.controller.actuator import Law
from rcilab.makers.rokae.controller.modes.cartesian import CartesianGenerator
from rcilab.makers.rokae.controller.modes.generator import MotionGenerator, Terms
from rcilab.makers.rokae.controller.modes.joint import JointGenerator
from rcilab.makers.rokae.controller.modes.mode import Mode
from rcilab.makers.rokae.controller.modes.torque import TorqueGenerator
from rcilab.makers.rokae.wire import StartMotionMode

__all__ = ["MODES", "Mode", "build_generator"]


C, M = ControllerMode, StartMotionMode

MODES: Final = {
    (C.JOINT_POSITION, M.JOINT): Mode(Law.POSITION, False),
    (C.CARTESIAN_POSITION, M.CARTESIAN): Mode(Law.POSITION, True),
    (C.JOINT_IMPEDANCE, M.JOINT): Mode(Law.JOINT_IMPEDANCE, False),
    (C.CARTESIAN_IMPEDANCE, M.CARTESIAN): Mode(Law.CARTESIAN_IMPEDANCE, True),
    (C.TORQUE, M.IDLE): Mode(Law.TORQUE, False),  # What the vendor's example asks for.
    (C.TORQUE, M.JOINT): Mode(Law.TORQUE, False),
}
"""Controller mode and motion mode of StartMove, and what they run (manual 3.1.1)."""


def build_generator(mode: Mode, terms: Terms, q: list[float]) -> MotionGenerator:
    """Returns the generator of a motion that begins now.

    Args:
        mode: From `MODES`.
        terms: Of the motion.
        q: Where the arm rests, n plain floats, [rad].
    """
    if mode.law is Law.TORQUE:
        return TorqueGenerator(terms)
    return CartesianGenerator(terms, q) if mode.is_cartesian else JointGenerator(terms, q)
