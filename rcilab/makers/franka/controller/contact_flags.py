"""The contact and collision flags of the state: external torques and forces above their thresholds."""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import Array, JointVector
from rcilab.makers.franka.controller.settings import Thresholds


class ContactFlags:
    """Compares external torques and forces with the thresholds of setCollisionBehavior. Owned by the reporter.

    Args:
        thresholds: The thresholds.
    """

    def __init__(self, thresholds: Thresholds) -> None:
        t = thresholds
        self._torque = {
            False: (np.array(t.contact_torque), np.array(t.collision_torque)),
            True: (np.array(t.contact_torque_accelerating), np.array(t.collision_torque_accelerating)),
        }
        self._force = {
            False: (np.array(t.contact_force), np.array(t.collision_force)),
            True: (np.array(t.contact_force_accelerating), np.array(t.collision_force_accelerating)),
        }
        self.has_torque_collision = self.has_force_collision = False

    def step(self, tau_ext: JointVector, wrench: Array, *, is_accelerating: bool) -> tuple[Array, Array, Array, Array]:
        """Returns joint contacts, Cartesian contacts, joint collisions and Cartesian collisions, each 0 or 1.

        Args:
            tau_ext: External joint torques, shape (7,), [N m].
            wrench: External wrench in the stiffness frame, shape (6,), [N, N m].
            is_accelerating: Whether the thresholds of the acceleration phases apply.
        """
        torque, force = np.abs(tau_ext), np.abs(wrench)
        lower, upper = self._torque[is_accelerating]
        joint_contact, joint_collision = torque > lower, torque > upper
        lower, upper = self._force[is_accelerating]
        contact, collision = force > lower, force > upper
        self.has_torque_collision, self.has_force_collision = bool(joint_collision.any()), bool(collision.any())
        return (
            joint_contact.astype(np.float64),
            contact.astype(np.float64),
            joint_collision.astype(np.float64),
            collision.astype(np.float64),
        )
