"""Motion generators: they convert a client's commands to a reference that the arm can follow."""

from __future__ import annotations

from rcilab.sim.actuator import ControlLaw
from rcilab.sim.generators.cartesian import CartesianGenerator
from rcilab.sim.generators.cartesian_velocity import CartesianVelocityGenerator
from rcilab.sim.generators.generator import GeneratorOutput, MotionGenerator
from rcilab.sim.generators.goal import GoalGenerator
from rcilab.sim.generators.joint import JointGenerator
from rcilab.sim.generators.joint_velocity import JointVelocityGenerator
from rcilab.sim.generators.motion_limits import CommandKind, MotionLimits, MotionMode
from rcilab.sim.generators.torque import TorqueAndMotionGenerator, TorqueGenerator

__all__ = ["CommandKind", "GeneratorOutput", "MotionGenerator", "MotionMode", "build_generator"]

_GENERATORS = {
    CommandKind.JOINT_ANGLES: JointGenerator,
    CommandKind.JOINT_VELOCITIES: JointVelocityGenerator,
    CommandKind.POSES: CartesianGenerator,
    CommandKind.TWISTS: CartesianVelocityGenerator,
}


def build_generator(mode: MotionMode, bounds: MotionLimits, q: list[float]) -> MotionGenerator:
    """Returns the generator of a motion that begins now.

    Args:
        mode: Type of command and control law.
        bounds: Filters and limits of the motion.
        q: Reference of the stationary arm, n plain floats, [rad].
    """
    if mode.kind is CommandKind.TORQUES:
        return TorqueGenerator(bounds)
    if mode.kind is CommandKind.JOINT_GOALS:
        return GoalGenerator(bounds, mode.goal_velocity, q)
    motion = _GENERATORS[mode.kind](bounds, q)
    return TorqueAndMotionGenerator(TorqueGenerator(bounds), motion) if mode.law is ControlLaw.TORQUE else motion
