"""RobotModel: geometry, kinematics and dynamics of one arm with its tool and load, read-only."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_path, as_rows, as_vector, described, require_radians
from rcilab.core.clearance import STANDARD_DISTANCE, ClearanceLimit
from rcilab.core.errors import InvalidValueError, KinematicsError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.model.arm_file import ENDING, load_arm
from rcilab.model.dynamics.friction import JointFriction, simulated_friction
from rcilab.model.dynamics.payload import NO_LOAD, Payload
from rcilab.model.kinematics.frames import Frame
from rcilab.model.kinematics.manipulability import Manipulability, ManipulabilityPath, dexterity_path, manipulability_of
from rcilab.model.kinematics.reaching_arm import ReachingArm
from rcilab.model.kinematics.workspace import Workspace, sample_workspace
from rcilab.robots import RobotDescription, describe_robot
from rcilab.robots.description import MountedTool

if TYPE_CHECKING:
    from rcilab.model.dynamics.rigid_body import RigidBody, TorqueTerms
    from rcilab.model.kinematics.collision import Clearance, CollisionGeometry

_SET_LIMIT = "soft limit, set by a user"

__all__ = ["RobotModel", "load_model", "require_model"]


def load_model(name: str, *, tool: Pose | str | None = None, load: Payload | None = None) -> RobotModel:
    """Returns the model of a robot by name, in any case; `rcilab.robots.ROBOT_NAMES` lists the names.

    Args:
        name: Name of the robot, or the file of one arm, "my_arm.json", as written by `save` of
            `robot.rci.load_robot_model()`.
        tool: Pose of the tool in the flange frame (RCI setCoor), or the name of one of its maker, such as "hand", with
            its mass; the flange itself when absent.
        load: The load at the flange (RCI setLoad), including the tool; when absent, that of a named tool, or none.

    Raises:
        ModelError: No robot has this name; the message lists those that exist.
        InvalidValueError: The file does not exist or is not that of an arm, the tool is not a `Pose` or known by name,
            the load not a `Payload`, or it exceeds the rated payload.
    """
    if isinstance(name, str) and name.lower().endswith(ENDING):
        description = load_arm(name)
    else:
        description = describe_robot(name)
    if isinstance(tool, str):
        tool, body = find_tool(description, tool)
        load = body if load is None else load
    return RobotModel(description, IDENTITY if tool is None else tool, NO_LOAD if load is None else load)


def find_tool(description: RobotDescription, name: str) -> tuple[Pose, Payload]:
    """Returns a tool of an arm's maker: its pose in the flange frame, and its body.

    Raises:
        InvalidValueError: There is no such tool; the message lists those that exist.
    """
    for tool in description.tools:
        if tool.name == name.lower():
            body = Payload(mass=tool.mass, center_of_mass=tool.center_of_mass, inertia=tool.inertia)
            return tool.T_flange_tool, body
    known = ", ".join(tool.name for tool in description.tools)
    hint = f"known: {known}" if known else "its maker has none in rcilab"
    raise InvalidValueError("tool", name, f"is not a tool of the {description.name} by name; {hint}")


def require_model(model: object) -> RobotModel:
    """Returns `model` if it is a robot model; catches its name passed by mistake.

    Raises:
        InvalidValueError: It is a name or something else; the message names the remedy.
    """
    if isinstance(model, RobotModel):
        return model
    if isinstance(model, str):
        raise InvalidValueError("model", model, f"is a name; use load_model({model!r})")
    raise InvalidValueError("model", described(model), "must be a robot model; use load_model")


class RobotModel(ReachingArm):
    """An arm with a tool and a load. Immutable: `with_tool` and `with_load` return another one.

    All joint vectors have shape (n,) and are in [rad]; all poses are in the base frame, of the tool unless a frame is
    named. Forward and differential kinematics are in `MovingArm`, the inverse and the arm angle in `ReachingArm`.
    """

    def __init__(
        self,
        description: RobotDescription,
        tool: Pose = IDENTITY,
        load: Payload = NO_LOAD,
        stiffness_frame: Pose = IDENTITY,
        mounted: MountedTool | None = None,
    ) -> None:
        super().__init__(description, tool, stiffness_frame)
        if not isinstance(load, Payload):
            raise InvalidValueError(
                "load", described(load), "must be a Payload; use Payload(mass=...), or Payload() for no load"
            )
        if load.mass > description.rated_payload:
            bound = f"{description.rated_payload:g} kg for {description.name}"
            problem = f"kg is above {bound}, the payload it is rated for"
            raise InvalidValueError("load mass", load.mass, problem).coded(
                "load_heavy", mass=f"{load.mass:g}", most=f"{description.rated_payload:g}", model=description.name
            )
        self.load = load
        self.mounted = description.find_tool_at(self.T_flange_tool) if mounted is None else mounted
        """The maker's tool at the flange, whose shape collisions include: that of `tool`, or of an earlier one."""

    @property
    def name(self) -> str:
        """Name, spelled as in the manual."""
        return self.description.name

    @property
    def tool(self) -> Pose:
        """Pose of the tool in the flange frame (SetCoor), as given to `load_model`; also `T_flange_tool`."""
        return self.T_flange_tool

    @property
    def limits(self) -> Limits:
        """Every limit, each with its source."""
        return self.description.limits

    @property
    def home(self) -> JointVector:
        """Joint angles away from limits and singularities, shape (n,), [rad]."""
        return self.description.home

    def with_tool(self, tool: Pose | str) -> RobotModel:
        """Returns this arm with another tool, given by its pose in the flange frame (SetCoor).

        A name, such as "hand", is that of a tool of the maker (`description.tools`), whose mass becomes the load and
        whose shape collisions include. Another pose keeps that shape; the flange, `Pose()`, is without it.

        Raises:
            InvalidValueError: It is not a `Pose`, or not known by name.
        """
        if isinstance(tool, str):
            return RobotModel(self.description, *find_tool(self.description, tool), self.T_tool_stiffness)
        mounted = None if isinstance(tool, Pose) and tool.is_close(IDENTITY) else self.mounted
        return RobotModel(self.description, tool, self.load, self.T_tool_stiffness, mounted)

    def with_load(self, load: Payload) -> RobotModel:
        """Returns this arm with another load (SetLoad).

        Raises:
            InvalidValueError: It is not a `Payload`, or exceeds the rated payload.
        """
        return RobotModel(self.description, self.T_flange_tool, load, self.T_tool_stiffness, self.mounted)

    def with_joint_limits(self, lower: ArrayLike, upper: ArrayLike) -> RobotModel:
        """Returns this arm with other bounds of its joint angles, such as soft limits (SetJointLimit).

        Planners, solvers and `check` use them, and a certificate is valid for them only. They may be wider than the
        arm's own, at which its controller stops all the same.

        Args:
            lower: Shape (n,), [rad].
            upper: Above `lower`, shape (n,), [rad].

        Raises:
            InvalidValueError: Not n finite numbers, more than two turns, or a bound is not below its upper one.
        """
        low = require_radians(as_vector(lower, self.n, "lower", "rad"), "lower")
        high = require_radians(as_vector(upper, self.n, "upper", "rad"), "upper")
        for joint in np.flatnonzero(low >= high).tolist():
            raise InvalidValueError(
                f"lower, joint {joint + 1}", float(low[joint]), f"must be below {high[joint]:g} [rad]"
            )
        limits = self.limits
        sources = {**limits.sources, "joint.lower": _SET_LIMIT, "joint.upper": _SET_LIMIT}
        joint = replace(limits.joint, lower=low, upper=high, own=limits.joint.own or limits.joint)
        return self.with_limits(replace(limits, joint=joint, sources=MappingProxyType(sources)))

    def with_limits(self, limits: Limits) -> RobotModel:
        """Returns this arm with other limits, such as those that are set in its controller."""
        if limits is self.limits:
            return self
        description = replace(self.description, limits=limits)
        return RobotModel(description, self.T_flange_tool, self.load, self.T_tool_stiffness, self.mounted)

    def with_stiffness_frame(self, T_tool_stiffness: Pose) -> RobotModel:
        """Returns this arm with another stiffness frame, given by its pose in the tool frame (SetCoor).

        No limit and no plan depends on it; it is available as the frame "stiffness".

        Raises:
            InvalidValueError: It is not a `Pose`.
        """
        return RobotModel(self.description, self.T_flange_tool, self.load, T_tool_stiffness, self.mounted)

    def elbow(self, q: ArrayLike) -> tuple[float, int]:
        """Returns the elbow as Franka defines it: angle of joint 3, [rad], and side of joint 4 relative to its flip.

        The side is +1 above the angle of the stretched arm, and -1 below.

        Raises:
            KinematicsError: The maker of this arm defines no flip.
        """
        flip = self.description.elbow_flip
        if flip is None:
            raise KinematicsError(f"{self.name} has no elbow flip; arm_angle(q) returns its elbow angle")
        angles = self._floats(q)
        return angles[2], 1 if angles[3] > flip else -1

    def dexterity(self, q: ArrayLike) -> Manipulability:
        """Returns manipulability, smallest singular value and condition of the Jacobian."""
        return manipulability_of(self.jacobian(q))

    def dexterity_path(self, q: ArrayLike, frame: Frame = "tool") -> ManipulabilityPath:
        """Returns the measures of `dexterity` along a path, each of shape (N,), for q of shape (N, n), [rad]."""
        return dexterity_path(self.jacobian(as_path(q, self.n, "q", "rad"), frame))

    def sample_workspace(self, count: int = 10_000, *, seed: int = 0, box: SafetyBox | None = None) -> Workspace:
        """Returns tool positions at joint angles that are uniformly random inside the limits.

        Args:
            count: Number of configurations to try, up to 1 000 000.
            seed: The same seed gives the same samples.
            box: Only samples with the tool inside are returned; all when absent.

        Returns:
            `.q`, shape (N, n); `.position`, shape (N, 3), [m] in base; `.dexterity` there.

        Raises:
            InvalidValueError: `count` is out of range, or the box is not valid.
        """
        joint = self.limits.joint
        return sample_workspace(self, joint.lower, joint.upper, count, seed, box)

    def manipulability(self, q: ArrayLike) -> float:
        """Returns sqrt(det(J J^T)) at the tool; 0 at a singularity."""
        return self.dexterity(q).manipulability

    def torque(
        self,
        q: ArrayLike,
        dq: ArrayLike | None = None,
        ddq: ArrayLike | None = None,
        *,
        friction: bool | JointFriction = False,
    ) -> TorqueTerms:
        """Returns the joint torques of the rigid arm with its load, and their terms (GetTau, GetTauNoFriction).

        They are the torques at the output of the gears, without the rotors of the drives.

        Args:
            q: Joint angles, shape (n,) or (N, n), [rad].
            dq: Joint velocities, of q's shape, [rad/s]; zero when absent.
            ddq: Joint accelerations, of q's shape, [rad/s^2]; zero when absent.
            friction: Whether `.full` includes joint friction. True uses that of the arm's file, or else that of the
                MuJoCo plant; other coefficients are a `rcilab.model.dynamics.friction.JointFriction`.

        Returns:
            Terms of q's shape, [N m].

        Raises:
            InvalidValueError: q, dq or ddq has another shape or is not finite, or the friction is for another arm.
        """
        angles = as_rows(q, self.n, "q", "rad")
        zeros = np.zeros(angles.shape)
        speeds = zeros if dq is None else as_rows(dq, self.n, "dq", "rad/s", angles)
        rates = zeros if ddq is None else as_rows(ddq, self.n, "ddq", "rad/s^2", angles)
        terms = (self.rigid_body.torque if angles.ndim == 1 else self.rigid_body.torque_path)(angles, speeds, rates)
        if friction is False:
            return terms
        law = self.friction if friction is True else friction
        if not isinstance(law, JointFriction):
            raise InvalidValueError("friction", described(friction), "must be True, False or a JointFriction")
        return terms.with_friction(law.torque(speeds))

    @property
    def friction(self) -> JointFriction:
        """The joint friction of the arm's file, or else that of the MuJoCo plant."""
        own = self.description.friction
        if own is None:
            return simulated_friction(self.limits.joint)
        viscous, coulomb, offset = own
        return JointFriction(viscous=viscous, coulomb=coulomb, offset=offset)

    def clearance(self, q: ArrayLike, distance: ClearanceLimit = STANDARD_DISTANCE) -> Clearance:
        """Returns the smallest distance between links, or to the floor, and the two links, from their capsules.

        Neighbouring links always touch and are not checked, nor is the tool against the last two links. The capsules
        are those of the URDF; rims of caps and collars protrude from them by at most 12 mm.

        Args:
            q: Joint angles, shape (n,) or (N, n), [rad]; limits are not checked.
            distance: The floor and the tool's radius; its minimum distances have no effect here.

        Returns:
            `.distance`, shape () or (N,), [m], negative for an overlap; `.links`, the numbers of the two.

        Raises:
            InvalidValueError: q has another shape or is not finite.
        """
        from rcilab.model.kinematics.collision import Clearance, ClearanceQuery

        angles = as_rows(q, self.n, "q", "rad")
        found = ClearanceQuery(self.collision_geometry(distance)).path(np.atleast_2d(angles))
        return found if angles.ndim > 1 else Clearance(found.distance[0], found.links[0])

    def collision_geometry(self, distance: ClearanceLimit = STANDARD_DISTANCE) -> CollisionGeometry:
        """Returns the capsules and pairs of `clearance`, for a floor and a tool with or without a body."""
        from rcilab.model.kinematics.collision import collision_geometry

        tool = self.T_flange_tool.parts[1]
        return collision_geometry(self.description, tool, distance.floor_height, distance.tool_radius, self.mounted)

    @cached_property
    def rigid_body(self) -> RigidBody:
        """The rigid-body model behind `torque`."""
        from rcilab.model.dynamics.rigid_body import RigidBody

        return RigidBody(self.description, self.load, self.T_flange_tool)

    @cached_property
    def driven_body(self) -> RigidBody:
        """The rigid-body model that torques of the drives move: with the inertia of the rotors where that is known."""
        from rcilab.model.dynamics.rigid_body import RigidBody

        rotors = self.description.rotor_inertia
        if rotors is None:
            return self.rigid_body
        return RigidBody(self.description, self.load, self.T_flange_tool, rotor_inertia=rotors)

    @cached_property
    def fingerprint(self) -> Mapping[str, str]:
        """Hashes of the inputs of a check: model, limits, tool and load, each a SHA-256 in hex."""
        d = self.description
        joint, cartesian = d.limits.joint, d.limits.cartesian
        geometry = [(row.a, row.alpha, row.d, row.theta_offset) for row in d.dh]
        masses = [(link.mass, *link.center_of_mass, *link.inertia.flat, link.origin_height) for link in d.links]
        names = [name for name in joint.__slots__ if name not in ("own", "near_ends")]
        bounds = [getattr(joint, name).tolist() for name in names]
        if joint.near_ends is not None:
            bounds += [joint.near_ends.offset.tolist(), joint.near_ends.deceleration.tolist()]
        paths = [getattr(cartesian, name) for name in cartesian.__slots__]
        load = (self.load.mass, *self.load.center_of_mass, *self.load.inertia.flat)
        return MappingProxyType(
            {
                "model": _digest(d.name, geometry, [tuple(map(float, row)) for row in masses]),
                "limits": _digest(bounds, paths),
                "tool": _digest(self.T_flange_tool.as_row_major()),
                "load": _digest(tuple(map(float, load))),
            }
        )

    def __repr__(self) -> str:
        tool = f", tool={self.T_flange_tool!r}" if self._has_tool else ""
        load = f", load={self.load.mass:g} kg" if self.load.mass else ""
        calibrated = "" if self.description.nominal is None else ", calibrated"
        return f"RobotModel({self.name}, {self.n} axes{calibrated}{tool}{load})"


def _digest(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()
