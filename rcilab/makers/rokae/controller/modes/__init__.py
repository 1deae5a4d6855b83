"""The five controller modes: which pairs of modes StartMove can ask for, and the motion generator of each.

A mode is two things: what the client commands (a generator: joint angles, tool poses, torques), and what the drives
make of it (a `ControlLaw`). Pairs that are not in the table are refused as not possible.
"""

from __future__ import annotations

from typing import Final

from rcilab.core.state import ControllerMode
from rcilab.makers.rokae.controller.actuator import ControlLaw
from rcilab.makers.rokae.controller.modes.cartesian import CartesianGenerator
from rcilab.makers.rokae.controller.modes.generator import MotionGenerator, MotionLimits
from rcilab.makers.rokae.controller.modes.joint import JointGenerator
from rcilab.makers.rokae.controller.modes.mode import Mode
from rcilab.makers.rokae.controller.modes.torque import TorqueGenerator
from rcilab.makers.rokae.wire import StartMotionMode

__all__ = ["MODES", "Mode", "build_generator"]


C, M = ControllerMode, StartMotionMode

MODES: Final = {
    (C.JOINT_POSITION, M.JOINT): Mode(ControlLaw.POSITION, False),
    (C.CARTESIAN_POSITION, M.CARTESIAN): Mode(ControlLaw.POSITION, True),
    (C.JOINT_IMPEDANCE, M.JOINT): Mode(ControlLaw.JOINT_IMPEDANCE, False),
    (C.CARTESIAN_IMPEDANCE, M.CARTESIAN): Mode(ControlLaw.CARTESIAN_IMPEDANCE, True),
    (C.TORQUE, M.IDLE): Mode(ControlLaw.TORQUE, False),  # What the vendor's example asks for.
    (C.TORQUE, M.JOINT): Mode(ControlLaw.TORQUE, False),
}
"""Controller mode and motion mode of StartMove, and what they run (manual 3.1.1)."""


def build_generator(mode: Mode, terms: MotionLimits, q: list[float]) -> MotionGenerator:
    """Returns the generator of a motion that begins now.

    Args:
        mode: From `MODES`.
        terms: Of the motion.
        q: Where the arm rests, n plain floats, [rad].
    """
    if mode.law is ControlLaw.TORQUE:
        return TorqueGenerator(terms)
    return CartesianGenerator(terms, q) if mode.is_cartesian else JointGenerator(terms, q)
