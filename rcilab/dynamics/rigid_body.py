"""Joint torques of the rigid arm, by pinocchio's recursive Newton-Euler algorithm."""

# pyright: reportAttributeAccessIssue=false
# pinocchio's names are put into its module by compiled code when it is loaded, where pyright cannot see them.

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]  # It lives behind a .pth file.

from rcilab.arrays import JointVector, Matrix
from rcilab.dynamics.payload import Payload
from rcilab.robots.description import Link, RobotDescription
from rcilab.robots.upright import upright_joints

GRAVITY = 9.81  # [m/s^2] along -z of the base; the figure the vendor's dynamics library computes with.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TorqueTerms:
    """The joint torques of a motion and what they are made of, each of shape (n,), [N m]."""

    full: JointVector
    """inertial + coriolis + gravity."""
    inertial: JointVector
    """M(q) ddq."""
    coriolis: JointVector
    """C(q, dq) dq: Coriolis and centrifugal torques."""
    gravity: JointVector
    """g(q): what holds the arm still."""


class RigidBody:
    """The rigid-body model of an arm with a load at the flange. One instance serves one thread at a time."""

    def __init__(self, description: RobotDescription, load: Payload) -> None:
        model = pin.Model()
        model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
        parent = 0
        for number, (joint, link) in enumerate(zip(upright_joints(description), description.links, strict=True), 1):
            kind = pin.JointModelRZ() if joint.axis[2] > 0.5 else pin.JointModelRY()
            parent = model.addJoint(parent, kind, pin.SE3(np.eye(3), joint.origin.copy()), f"joint{number}")
            model.appendBodyToJoint(parent, _inertia(link), pin.SE3.Identity())
        if load.mass > 0.0:
            body = pin.Inertia(load.mass, load.center_of_mass.copy(), load.inertia.copy())
            model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        self._model = model
        self._data = model.createData()

    def torque(self, q: JointVector, dq: JointVector, ddq: JointVector) -> TorqueTerms:
        """Returns the torques and their terms; every argument of shape (n,), [rad], [rad/s], [rad/s^2]."""
        model, data = self._model, self._data
        gravity = pin.computeGeneralizedGravity(model, data, q).copy()
        bias = pin.nonLinearEffects(model, data, q, dq).copy()
        full = pin.rnea(model, data, q, dq, ddq).copy()
        return TorqueTerms(full=full, inertial=full - bias, coriolis=bias - gravity, gravity=gravity)

    def full_torque(self, q: JointVector, dq: JointVector, ddq: JointVector) -> JointVector:
        """Returns only the sum of all terms, shape (n,), [N m]."""
        return pin.rnea(self._model, self._data, q, dq, ddq).copy()

    def mass_matrix(self, q: JointVector) -> Matrix:
        """Returns the joint-space inertia matrix, shape (n, n), [kg m^2]."""
        upper = np.triu(pin.crba(self._model, self._data, q))
        return upper + np.triu(upper, 1).T


def _inertia(link: Link) -> pin.Inertia:
    return pin.Inertia(link.mass, link.center_of_mass.copy(), link.inertia.copy())
