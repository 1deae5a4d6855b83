"""The motions of Move: what is commanded, and the law that follows it."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from rcilab.core.errors import InvalidValueError
from rcilab.core.state import ControllerMode, MotionGeneratorMode
from rcilab.makers.franka.bounds import JOINT_STIFFNESS
from rcilab.makers.franka.controller.settings import Settings
from rcilab.makers.franka.wire.requests import AsyncMove, Move
from rcilab.makers.franka.wire.versions import FciVersion, MoveController, MoveGenerator
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.generators import CommandKind, MotionMode

_KINDS = {
    MoveGenerator.JOINT_POSITION: CommandKind.JOINT_ANGLES,
    MoveGenerator.JOINT_VELOCITY: CommandKind.JOINT_VELOCITIES,
    MoveGenerator.CARTESIAN_POSITION: CommandKind.POSES,
    MoveGenerator.CARTESIAN_VELOCITY: CommandKind.TWISTS,
    MoveGenerator.NONE: CommandKind.TORQUES,
}
_GENERATORS = {
    MoveGenerator.JOINT_POSITION: MotionGeneratorMode.JOINT_POSITION,
    MoveGenerator.JOINT_VELOCITY: MotionGeneratorMode.JOINT_VELOCITY,
    MoveGenerator.CARTESIAN_POSITION: MotionGeneratorMode.CARTESIAN_POSITION,
    MoveGenerator.CARTESIAN_VELOCITY: MotionGeneratorMode.CARTESIAN_VELOCITY,
    MoveGenerator.NONE: MotionGeneratorMode.IDLE,
}
_CONTROLLERS = {
    ControlLaw.POSITION: (ControllerMode.JOINT_POSITION, ControllerMode.CARTESIAN_POSITION),
    ControlLaw.JOINT_IMPEDANCE: (ControllerMode.JOINT_IMPEDANCE, ControllerMode.JOINT_IMPEDANCE),
    ControlLaw.CARTESIAN_IMPEDANCE: (ControllerMode.CARTESIAN_IMPEDANCE, ControllerMode.CARTESIAN_IMPEDANCE),
    ControlLaw.TORQUE: (ControllerMode.TORQUE, ControllerMode.TORQUE),
}


class MotionKind(NamedTuple):
    """A motion as its client asked for it."""

    controller: MoveController
    generator: MoveGenerator
    mode: MotionMode
    """Of the virtual arm."""
    is_stiff: bool
    """Whether the joints have the stiffness after power-up: rcilab's states then name what is commanded."""

    @property
    def description(self) -> str:
        """What is commanded, and what follows it, such as "joint position under joint impedance"."""
        commands, law = (name.lower().replace("_", " ") for name in (self.generator.name, self.controller.name))
        if self.controller is MoveController.EXTERNAL:
            return "torque" if self.generator is MoveGenerator.NONE else f"torque along with {commands}"
        return f"{commands} under {law}" if self.mode.is_streamed else f"joint goals under {law}"

    @property
    def reported_generator(self) -> MotionGeneratorMode:
        """The generator in rcilab's states."""
        return _GENERATORS[self.generator]

    @property
    def reported_controller(self) -> ControllerMode:
        """The controller in rcilab's states."""
        return _CONTROLLERS[ControlLaw.POSITION if self.is_stiff else self.mode.law][self.mode.is_cartesian]


def motion_of(request: Move, version: FciVersion, settings: Settings, *, follows_exactly: bool) -> MotionKind:
    """Returns the motion of a Move.

    Args:
        request: The request.
        version: The version of the interface.
        settings: The client's settings.
        follows_exactly: Whether the joints are on their servos, and yield to nothing, with the stiffness after
            power-up.

    Raises:
        InvalidValueError: Its modes are not of this version, or do not go together.
    """
    controllers, generators = tuple(MoveController), version.generators
    if request.controller_mode >= len(controllers):
        raise InvalidValueError("controller mode", request.controller_mode, f"must be 0 to {len(controllers) - 1}")
    if request.motion_generator_mode not in tuple(generators):
        known = f"must be 0 to {len(generators) - 1} in version {version.number}"
        raise InvalidValueError("motion generator mode", request.motion_generator_mode, known)
    controller, generator = controllers[request.controller_mode], MoveGenerator(request.motion_generator_mode)
    if generator is MoveGenerator.NONE and controller is not MoveController.EXTERNAL:
        raise InvalidValueError("motion generator mode", int(generator), "commands torques: it needs controller mode 2")
    kind, velocity = _KINDS[generator], ()
    if isinstance(request, AsyncMove) and request.is_asynchronous:
        if generator is not MoveGenerator.JOINT_POSITION:
            raise InvalidValueError("motion generator mode", int(generator), "has no asynchronous motions, only 0 has")
        if not all(0.0 < v < inf for v in request.largest_velocity):
            raise InvalidValueError("maximum velocity", request.largest_velocity, "must be above 0 and finite [rad/s]")
        kind, velocity = CommandKind.JOINT_GOALS, request.largest_velocity
    law = ControlLaw.TORQUE
    is_stiff = controller is MoveController.JOINT_IMPEDANCE and settings.joint_stiffness == JOINT_STIFFNESS
    if controller is MoveController.JOINT_IMPEDANCE:
        law = ControlLaw.POSITION if is_stiff and follows_exactly else ControlLaw.JOINT_IMPEDANCE
    elif controller is MoveController.CARTESIAN_IMPEDANCE:
        law = ControlLaw.CARTESIAN_IMPEDANCE
    mode = MotionMode(law, kind, goal_velocity=velocity)
    return MotionKind(controller, generator, mode, is_stiff)
