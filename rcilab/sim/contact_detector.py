"""Contacts and collisions from external torques and forces: a lower and an upper threshold for each joint and axis.

While the arm accelerates other thresholds apply, because a model that is not exact sees its errors as forces then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rcilab.sim.arm_parameters import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactThresholds:
    """External torques of n joints, [N m], and forces and moments of 6 axes, [N, N m]. Without a sign."""

    contact_torque: Floats
    """Above it a joint has a contact, while the arm does not accelerate."""
    collision_torque: Floats
    """Above it a joint has a collision, while the arm does not accelerate."""
    contact_torque_accelerating: Floats
    collision_torque_accelerating: Floats
    contact_force: Floats
    collision_force: Floats
    contact_force_accelerating: Floats
    collision_force_accelerating: Floats


class Contacts(NamedTuple):
    """One flag for each joint, or axis of the wrench."""

    joint_contact: tuple[bool, ...]
    cartesian_contact: tuple[bool, ...]
    joint_collision: tuple[bool, ...]
    """A collision is a contact, too."""
    cartesian_collision: tuple[bool, ...]


def find_contacts(
    thresholds: ContactThresholds, tau_ext: Sequence[float], wrench: Sequence[float], *, is_accelerating: bool
) -> Contacts:
    """Returns the contacts and collisions of one cycle.

    Args:
        thresholds: The thresholds.
        tau_ext: External joint torques, n numbers, [N m].
        wrench: External wrench in the axes of the thresholds, force first, 6 numbers, [N, N m].
        is_accelerating: Whether the arm accelerates; see `ReferenceTrajectory.is_accelerating`.
    """
    t = thresholds
    if is_accelerating:
        torque = t.contact_torque_accelerating, t.collision_torque_accelerating
        force = t.contact_force_accelerating, t.collision_force_accelerating
    else:
        torque = t.contact_torque, t.collision_torque
        force = t.contact_force, t.collision_force
    return Contacts(
        _above(tau_ext, torque[0]), _above(wrench, force[0]), _above(tau_ext, torque[1]), _above(wrench, force[1])
    )


def _above(values: Sequence[float], bounds: Sequence[float]) -> tuple[bool, ...]:
    return tuple([abs(value) > bound for value, bound in zip(values, bounds, strict=True)])


class ContactDetector:
    """The contacts of each cycle, and the collisions since the last reset. Owned by the controller's reporter.

    Attributes:
        present: Of the last cycle.
        shown: The same, with every collision since the last `reset`.

    Args:
        thresholds: The thresholds.
    """

    def __init__(self, thresholds: ContactThresholds) -> None:
        joints, axes = (False,) * len(thresholds.contact_torque), (False,) * len(thresholds.contact_force)
        self._none = self.present = self.shown = Contacts(joints, axes, joints, axes)
        self.configure(thresholds)

    def configure(self, thresholds: ContactThresholds) -> None:
        """Sets other thresholds, from the next cycle on."""
        self._thresholds = t = thresholds
        torques = t.contact_torque, t.collision_torque, t.contact_torque_accelerating, t.collision_torque_accelerating
        forces = t.contact_force, t.collision_force, t.contact_force_accelerating, t.collision_force_accelerating
        self._lowest = min(map(min, torques)), min(map(min, forces))

    def reset(self) -> None:
        """Clears the collisions, as an error recovery does."""
        self.shown = self.present = self._none

    def step(self, tau_ext: Sequence[float], wrench: Sequence[float], *, is_accelerating: bool) -> None:
        """Processes the external torques and forces of this cycle; see `find_contacts`."""
        if max(map(abs, tau_ext)) <= self._lowest[0] and max(map(abs, wrench)) <= self._lowest[1]:
            self.present = now = self._none
        else:
            self.present = now = find_contacts(self._thresholds, tau_ext, wrench, is_accelerating=is_accelerating)
        last = self.shown
        if now is self._none is last:
            return
        self.shown = Contacts(
            now.joint_contact,
            now.cartesian_contact,
            _either(last.joint_collision, now.joint_collision),
            _either(last.cartesian_collision, now.cartesian_collision),
        )


def _either(before: tuple[bool, ...], now: tuple[bool, ...]) -> tuple[bool, ...]:
    return tuple([a or b for a, b in zip(before, now, strict=True)])
