"""Motion generators: they convert a client's commands to a reference that the arm can follow."""

from __future__ import annotations

from rcilab.sim.actuator import ControlLaw
from rcilab.sim.generators.cartesian import CartesianGenerator
from rcilab.sim.generators.generator import GeneratorOutput, MotionGenerator
from rcilab.sim.generators.joint import JointGenerator
from rcilab.sim.generators.motion_limits import MotionLimits, MotionMode
from rcilab.sim.generators.torque import TorqueGenerator

__all__ = ["GeneratorOutput", "MotionGenerator", "MotionMode", "build_generator"]


def build_generator(mode: MotionMode, bounds: MotionLimits, q: list[float]) -> MotionGenerator:
    """Returns the generator of a motion that begins now.

    Args:
        mode: Type of command and control law.
        bounds: Filters and limits of the motion.
        q: Reference of the stationary arm, n plain floats, [rad].
    """
    if mode.law is ControlLaw.TORQUE:
        return TorqueGenerator(bounds)
    return CartesianGenerator(bounds, q) if mode.is_cartesian else JointGenerator(bounds, q)
