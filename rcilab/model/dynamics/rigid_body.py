"""Joint torques of the rigid arm, by pinocchio's recursive Newton-Euler algorithm."""

# pyright: reportAttributeAccessIssue=false
# pinocchio defines its names in compiled code at import; pyright does not know them.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]  # Installed through a .pth file.

from rcilab.core.arrays import Array, JointPath, JointVector, Matrix, Vector3, make_readonly
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.dynamics.symmetric_solver import SymmetricSolver
from rcilab.robots.description import Link, RobotDescription
from rcilab.robots.upright import link_frames, upright_flange, upright_joints

GRAVITY = 9.81  # [m/s^2] along -z of the base; the value of the vendor's dynamics library.

Twist: TypeAlias = tuple[float, float, float, float, float, float]
"""Linear and angular velocity, [m/s, rad/s]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TorqueTerms:
    """The joint torques of a motion and their terms, each of shape (n,) or (N, n), [N m]."""

    full: JointVector
    """inertial + coriolis + gravity + friction."""
    inertial: JointVector
    """M(q) ddq."""
    coriolis: JointVector
    """C(q, dq) dq: Coriolis and centrifugal torques."""
    gravity: JointVector
    """g(q): the torques that hold the arm at standstill."""
    friction: JointVector
    """Friction torques; zeros unless requested."""

    def with_friction(self, friction: JointVector) -> TorqueTerms:
        """Returns these terms with friction torques added, of the same shape, [N m]."""
        return replace(self, full=self.full + friction, friction=friction)

    def __repr__(self) -> str:
        if self.full.ndim > 1:
            return f"<TorqueTerms of {len(self.full)} rows: .full, .inertial, .coriolis, .gravity, .friction>"
        full = " ".join(f"{x:.2f}" for x in self.full.tolist())
        return f"<TorqueTerms: full = {full} N m; .inertial, .coriolis, .gravity, .friction>"


class ToolTerms:
    """Pose, twist and Jacobian of the tool of an arm in one state; its arrays must not be written to.

    All control laws of a cycle share one instance, so that terms of the same angles and velocities are computed once.
    Other terms are computed on first use, so an instance belongs to the thread of its `RigidBody`.

    Attributes:
        matrix: Pose of the tool in base as a homogeneous transform, shape (4, 4), [m].
        twist: Its velocity in base axes, linear first, [m/s, rad/s].
        jacobian: At the tool, linear rows first, base axes, shape (6, n).

    Args:
        model: The arm as a pinocchio model.
        data: Working memory of the model.
        tool: Index of the tool's frame.
        q: Joint angles, shape (n,), [rad]; the array must not change afterwards.
        dq: Joint velocities, shape (n,), [rad/s]; likewise.
    """

    __slots__ = ("_args", "_mass_inverse", "_pose", "jacobian", "matrix", "twist")

    def __init__(self, model: pin.Model, data: pin.Data, tool: int, q: JointVector, dq: JointVector) -> None:
        self._args = (model, data, tool, q, dq)
        self.jacobian: Matrix = pin.computeFrameJacobian(model, data, q, tool, pin.LOCAL_WORLD_ALIGNED)
        self.matrix: Matrix = pin.updateFramePlacement(model, data, tool).homogeneous
        self.twist: Twist = tuple(self.jacobian.dot(dq).tolist())
        self._pose: Pose | None = None
        self._mass_inverse: Matrix | None = None

    def is_at(self, q: JointVector, dq: JointVector) -> bool:
        """Returns whether the terms were computed from these array objects."""
        return self._args[3] is q and self._args[4] is dq

    @property
    def pose(self) -> Pose:
        """Pose of the tool in base."""
        found = self._pose
        if found is None:
            found = self._pose = _pose(self.matrix)
        return found

    @property
    def mass_inverse(self) -> Matrix:
        """M^-1, shape (n, n), [1/(kg m^2)]."""
        found = self._mass_inverse
        if found is None:
            model, data, _, q, _ = self._args
            found = self._mass_inverse = pin.computeMinverse(model, data, q).copy()
        return found

    def is_of(self, q: Sequence[float]) -> bool:
        """Returns whether the terms are those of joint angles, n plain floats, [rad]."""
        return self._args[3].tolist() == q

    def acceleration(self, ddq: JointVector) -> Array:
        """Returns the tool's acceleration J ddq + dJ/dt dq, base axes, linear first, shape (6,), [m/s^2, rad/s^2].

        Args:
            ddq: Joint accelerations, shape (n,), [rad/s^2].
        """
        model, data, tool, q, dq = self._args
        pin.forwardKinematics(model, data, q, dq, ddq)
        return pin.getFrameClassicalAcceleration(model, data, tool, pin.LOCAL_WORLD_ALIGNED).vector.copy()


class RigidBody:
    """The rigid-body model of an arm with a load and a tool at the flange. One instance serves one thread at a time.

    Attributes:
        tool_solver: Solver for equations in the six directions of the tool.

    Args:
        description: The arm.
        load: The load at the flange.
        tool: Pose of the tool in the flange; it has no mass.
        rotor_inertia: Rotor inertia at the joints, which accelerations, `motion_torque` and inverse inertias include,
            shape (n,), [kg m^2]; None: none.
    """

    def __init__(
        self,
        description: RobotDescription,
        load: Payload,
        tool: Pose = IDENTITY,
        *,
        rotor_inertia: JointVector | None = None,
    ) -> None:
        model = pin.Model()
        model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
        self._link_frames: list[pin.SE3] | None = None
        if description.nominal is None:
            parent, T_link_flange = _add_upright_links(model, description)
        else:
            parent, T_link_flange, self._link_frames = _add_calibrated_links(model, description)
        if load.mass > 0.0:
            body = pin.Inertia(load.mass, load.center_of_mass.copy(), load.inertia.copy())
            model.appendBodyToJoint(parent, body, pin.SE3(T_link_flange.rotation, T_link_flange.position))
        T_link_tool = T_link_flange @ tool
        T = pin.SE3(T_link_tool.rotation, T_link_tool.position)
        self._tool = model.addFrame(pin.Frame("tool", parent, 0, T, pin.FrameType.OP_FRAME))
        self._model = model
        self._data = model.createData()
        self._weightless = pin.Model(model)
        self._weightless.gravity.linear = np.zeros(3)
        self._falling = model
        if rotor_inertia is not None:
            self._falling = pin.Model(model)
            self._falling.armature = self._weightless.armature = rotor_inertia.copy()
        self.tool_solver = SymmetricSolver(6)
        self._tool_terms: ToolTerms | None = None
        self._shared_args: tuple[JointVector, ...] = ()
        self._shared_torque = np.zeros(0)

    def torque(self, q: JointVector, dq: JointVector, ddq: JointVector) -> TorqueTerms:
        """Returns the torques and their terms; every argument of shape (n,), [rad], [rad/s], [rad/s^2]."""
        model, data = self._model, self._data
        gravity = pin.computeGeneralizedGravity(model, data, q).copy()
        bias = pin.nonLinearEffects(model, data, q, dq).copy()
        full = pin.rnea(model, data, q, dq, ddq).copy()
        return _terms(full, bias, gravity)

    def torque_path(self, q: JointPath, dq: JointPath, ddq: JointPath) -> TorqueTerms:
        """Returns the torques and their terms for every row; arguments and results have shape (N, n)."""
        zeros, model = np.zeros(q.shape), self._model
        full, bias, gravity = (_newton_euler(model, q, *rest) for rest in ((dq, ddq), (dq, zeros), (zeros, zeros)))
        return _terms(full, bias, gravity)

    def full_torque(self, q: JointVector, dq: JointVector, ddq: JointVector) -> JointVector:
        """Returns only the sum of all terms, shape (n,), [N m]."""
        return pin.rnea(self._model, self._data, q, dq, ddq).copy()

    def shared_torque(self, q: JointVector, dq: JointVector, ddq: JointVector) -> JointVector:
        """Returns `full_torque`, read-only and computed once for the same array objects."""
        args = self._shared_args
        if not (args and args[0] is q and args[1] is dq and args[2] is ddq):
            self._shared_args, self._shared_torque = (q, dq, ddq), make_readonly(self.full_torque(q, dq, ddq))
        return self._shared_torque

    def motion_torque(self, q: JointVector, dq: JointVector, ddq: JointVector) -> JointVector:
        """Returns the torques of a motion without gravity: M ddq + C dq, shape (n,), [N m]."""
        return pin.rnea(self._weightless, self._data, q, dq, ddq).copy()

    def motion_torques(self, q: JointPath, dq: JointPath, ddq: JointPath) -> JointPath:
        """Returns `motion_torque` of every row, shape (N, n), [N m].

        Args:
            q: Joint angles, shape (N, n), [rad].
            dq: Joint velocities, shape (N, n), [rad/s].
            ddq: Joint accelerations, shape (N, n), [rad/s^2].
        """
        return _newton_euler(self._weightless, q, dq, ddq)

    def mass_matrix(self, q: JointVector) -> Matrix:
        """Returns the joint-space inertia matrix, shape (n, n), [kg m^2]."""
        upper = np.triu(pin.crba(self._model, self._data, q))
        return upper + np.triu(upper, 1).T

    def mass_inverse(self, q: JointVector) -> Matrix:
        """Returns the inverse of the joint-space inertia matrix, shape (n, n), [1/(kg m^2)]."""
        return pin.computeMinverse(self._weightless, self._data, q).copy()

    def gravity(self, q: JointVector) -> JointVector:
        """Returns g(q), shape (n,), [N m]."""
        return pin.computeGeneralizedGravity(self._model, self._data, q).copy()

    def tilted_gravity(self, q: JointVector, direction: Sequence[float]) -> JointVector:
        """Returns g(q) for an arm that does not stand upright, shape (n,), [N m].

        Args:
            q: Joint angles, shape (n,), [rad].
            direction: Direction of gravity in base, a unit vector.
        """
        J = pin.jacobianCenterOfMass(self._model, self._data, q)
        return -GRAVITY * float(self._data.mass[0]) * (J.T @ np.array(direction))

    def acceleration(self, q: JointVector, dq: JointVector, tau: JointVector) -> JointVector:
        """Returns the joint accelerations that torques cause (forward dynamics), shape (n,), [rad/s^2].

        Args:
            q: Joint angles, shape (n,), [rad].
            dq: Joint velocities, shape (n,), [rad/s].
            tau: Joint torques, gravity included, shape (n,), [N m].
        """
        return pin.aba(self._falling, self._data, q, dq, tau).copy()

    def weightless_acceleration(self, q: JointVector, dq: JointVector, tau: JointVector) -> JointVector:
        """Returns the joint accelerations of torques that are added to gravity compensation; as `acceleration`."""
        return pin.aba(self._weightless, self._data, q, dq, tau).copy()

    def link_jacobian(self, q: JointVector, link: int, point: Vector3) -> Matrix:
        """Returns the Jacobian at a point of a link, linear rows first, base axes, shape (6, n).

        Args:
            q: Joint angles, shape (n,), [rad].
            link: Number of the link, from 1.
            point: In the link's frame, shape (3,), [m].
        """
        model, data = self._model, self._data
        if self._link_frames is not None:
            point = self._link_frames[link - 1].act(point)
        pin.computeJointJacobians(model, data, q)
        J = pin.getJointJacobian(model, data, link, pin.LOCAL_WORLD_ALIGNED)
        x, y, z = (data.oMi[link].rotation @ point).tolist()
        J[:3] -= np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))) @ J[3:]  # omega x arm
        return J

    def link_pose(self, q: JointVector, link: int) -> Pose:
        """Returns the pose of a link's frame in base.

        Args:
            q: Joint angles, shape (n,), [rad].
            link: Number of the link, from 1.
        """
        pin.forwardKinematics(self._model, self._data, q)
        T = self._data.oMi[link]
        return Pose.from_matrix((T if self._link_frames is None else T * self._link_frames[link - 1]).homogeneous)

    def tool_pose(self, q: JointVector) -> Pose:
        """Returns the pose of the tool in base, for joint angles of shape (n,), [rad]."""
        pin.forwardKinematics(self._model, self._data, q)
        return _pose(pin.updateFramePlacement(self._model, self._data, self._tool).homogeneous)

    def tool_jacobian(self, q: JointVector) -> Matrix:
        """Returns the Jacobian at the tool, linear rows first, base axes, shape (6, n)."""
        return pin.computeFrameJacobian(self._model, self._data, q, self._tool, pin.LOCAL_WORLD_ALIGNED)

    def tool_motion(self, q: JointVector, dq: JointVector) -> ToolTerms:
        """Returns the tool's pose, twist and Jacobian in one state; see `ToolTerms` for the arguments."""
        return ToolTerms(self._weightless, self._data, self._tool, q, dq)

    @property
    def last_terms(self) -> ToolTerms | None:
        """The last result of `tool_terms`."""
        return self._tool_terms

    def tool_terms(self, q: JointVector, dq: JointVector) -> ToolTerms:
        """Returns the `tool_motion` of the current state, shared by all control laws of a cycle.

        The last result is cached for the same array objects.

        Args:
            q: Joint angles, shape (n,), [rad]; the array must not change afterwards.
            dq: Joint velocities, shape (n,), [rad/s]; likewise.
        """
        terms = self._tool_terms
        if terms is None or not terms.is_at(q, dq):
            terms = self._tool_terms = self.tool_motion(q, dq)
        return terms


def _add_upright_links(model: pin.Model, description: RobotDescription) -> tuple[int, Pose]:
    """Adds joints and links in upright frames; returns the last joint and the flange in its frame."""
    parent = 0
    for number, (joint, link) in enumerate(zip(upright_joints(description), description.links, strict=True), 1):
        joint_type = _joint_type(joint.axis)
        parent = model.addJoint(parent, joint_type, pin.SE3(np.eye(3), joint.origin.copy()), f"joint{number}")
        model.appendBodyToJoint(parent, _inertia(link), pin.SE3.Identity())
    return parent, upright_flange(description)


def _add_calibrated_links(model: pin.Model, description: RobotDescription) -> tuple[int, Pose, list[pin.SE3]]:
    """Adds joints by Denavit-Hartenberg rows; returns the last joint, flange and links in the frames of their joints.

    Inertias identified on an arm need not be those of a possible body, which pinocchio requires of a link by itself.
    """
    parent, T_joint_dh, frames = 0, pin.SE3.Identity(), []
    rows = zip(description.dh, description.links, link_frames(description), strict=True)
    for number, (row, link, T_dh_link) in enumerate(rows, 1):
        turned = pin.SE3(pin.utils.rotate("z", row.theta_offset), np.zeros(3))
        parent = model.addJoint(parent, pin.JointModelRZ(), T_joint_dh * turned, f"joint{number}")
        T_joint_dh = pin.SE3(pin.utils.rotate("x", row.alpha), np.array((row.a, 0.0, row.d)))
        frames.append(T_joint_dh * pin.SE3(T_dh_link.rotation, T_dh_link.position))
        model.appendBodyToJoint(parent, pin.Inertia.FromDynamicParameters(_parameters(link)), frames[-1])
    return parent, Pose.from_matrix(T_joint_dh.homogeneous), frames


def _parameters(link: Link) -> Array:
    """Returns mass, first moments and moments of inertia about the origin of a link's frame, as pinocchio has them."""
    moment, c = link.mass * link.center_of_mass, link.center_of_mass
    inertia = link.inertia + link.mass * (c @ c * np.eye(3) - np.outer(c, c))
    return np.array((link.mass, *moment, *inertia[np.tril_indices(3)]))


def _pose(matrix: Matrix) -> Pose:
    (a, b, c, x), (d, e, f, y), (g, h, i, z), _ = matrix.tolist()
    return Pose.from_parts((a, b, c, d, e, f, g, h, i), (x, y, z))


def _joint_type(axis: Vector3) -> pin.JointModel:
    """Returns the fastest joint type for an axis."""
    if axis[2] > 0.5:
        return pin.JointModelRZ()
    return pin.JointModelRY() if axis[1] > 0.5 else pin.JointModelRevoluteUnaligned(axis.copy())


def _inertia(link: Link) -> pin.Inertia:
    return pin.Inertia(link.mass, link.center_of_mass.copy(), link.inertia.copy())


def _terms(full: Array, bias: Array, gravity: Array) -> TorqueTerms:
    return TorqueTerms(
        full=full,
        inertial=full - bias,
        coriolis=bias - gravity,
        gravity=gravity,
        friction=np.zeros(full.shape),
    )


def _newton_euler(model: pin.Model, q: JointPath, dq: JointPath, ddq: JointPath) -> JointPath:
    columns = (np.asfortranarray(table.T) for table in (q, dq, ddq))
    return pin.rneaInParallel(1, pin.ModelPool(model, 1), *columns).T.reshape(q.shape)  # (n,) for one row.
