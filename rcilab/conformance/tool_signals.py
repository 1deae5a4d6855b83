"""The signals of the tool and the elbow as tables with a row for each cycle: `CartesianMonitor` for all rows."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TypeAlias

import numpy as np

from rcilab.conformance.start import StartState
from rcilab.core.arrays import Array, JointPath
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.spatial import Rotation9, rotation_between
from rcilab.model.robot_model import RobotModel

BEFORE = 3
"""Commands before the first that is checked: a third difference reaches back that far."""

Differences: TypeAlias = tuple[Array, Array, Array, Array]
"""A signal and its first, second and third backward difference, a row a cycle."""

_FLIPPING = 3  # From 0: the elbow flips with joint 4.
_EXACT = 1e-8  # Sine of a turn up to which the sine is the angle; as in `rotation_between`.


class ToolSignals:
    """The tool and the elbow along commanded joint angles.

    Args:
        model: The arm with its tool.
        start: Where the arm comes from.
        path: Joint angles in every checked cycle, shape (N, n), [rad].
    """

    def __init__(self, model: RobotModel, start: StartState, path: JointPath) -> None:
        self._model = model
        self._is_moving = start.moving
        # A moving arm has had its first row already.
        self._rows = np.concatenate((commands_before(start), path[1:] if start.moving else path))
        self._inverse = model.solver

    def differences(self, signal: str) -> Differences:
        """Returns the norms of "translation" or "rotation" with their differences, or the "arm_angle" and its own.

        Each of shape (N, 1). Position and orientation themselves have no bound on a norm: zeros stand for them.
        """
        if signal == "arm_angle":
            return self._arm_angle
        return self._translation if signal == "translation" else self._rotation

    @cached_property
    def singularity(self) -> Array:
        """How near the arm is to a singularity, shape (N, 1): from 1 on it counts as on it."""
        return self._inverse.singularity_path(self._rows[self._first :])[:, np.newaxis]

    @cached_property
    def elbow_side(self) -> Array:
        """+1 where joint 4 is on the side of the elbow's flip on which it starts, -1 beyond, shape (N, 1)."""
        flip = self._model.description.elbow_flip
        assert flip is not None
        sides = np.where(self._rows[:, _FLIPPING] > flip, 1.0, -1.0)
        return (sides[self._first :] * sides[BEFORE - 1])[:, np.newaxis]

    @cached_property
    def start_distance(self) -> float:
        """How far the first commanded position of the tool is from the arm's, [m]."""
        return float(np.linalg.norm(self._poses[self._first, :3, 3] - self._poses[BEFORE - 1, :3, 3]))

    @cached_property
    def start_turn(self) -> float:
        """How far the first commanded arm angle is from the arm's, [rad]."""
        psi = self._inverse.arm_angle_path(self._rows[[BEFORE - 1, self._first]])
        return float(_short_way(np.diff(psi))[0])

    @property
    def _first(self) -> int:
        return BEFORE - 1 if self._is_moving else BEFORE

    @cached_property
    def _poses(self) -> Array:
        return self._model.forward_path(self._rows)

    @cached_property
    def _translation(self) -> Differences:
        return self._norms(np.diff(self._poses[:, :3, 3], axis=0))

    @cached_property
    def _rotation(self) -> Differences:
        return self._norms(turns(self._poses[:, :3, :3]))

    @cached_property
    def _arm_angle(self) -> Differences:
        psi = self._inverse.arm_angle_path(self._rows)
        first, second, third = self._judged(_short_way(np.diff(psi))[:, np.newaxis])
        return psi[self._first :, np.newaxis], first, second, third

    def _norms(self, steps: Array) -> Differences:
        first, second, third = (np.sqrt((values * values).sum(axis=1))[:, np.newaxis] for values in self._judged(steps))
        return np.zeros_like(first), first, second, third

    def _judged(self, steps: Array) -> tuple[Array, Array, Array]:
        """Returns velocity, acceleration and jerk of the checked cycles from the steps between all rows."""
        first = steps / CYCLE_TIME
        second = np.diff(first, axis=0) / CYCLE_TIME
        third = np.diff(second, axis=0) / CYCLE_TIME
        if not self._is_moving:
            return first[2:], second[1:], third
        return first[1:], second, np.concatenate((np.zeros_like(third[:1]), third))


def commands_before(start: StartState) -> JointPath:
    """Returns the three commands that leave an arm in a state, the oldest first, shape (3, n), [rad]."""
    last = start.q - CYCLE_TIME * start.dq
    oldest = last - CYCLE_TIME * (start.dq - CYCLE_TIME * start.ddq)
    return np.stack((oldest, last, start.q))


def turns(rotations: Array) -> Array:
    """Returns the rotation vectors from each orientation to the next, of any angle, in base axes.

    Args:
        rotations: Orientations in base, shape (N, 3, 3).

    Returns:
        Shape (N - 1, 3), [rad].
    """
    R = rotations[1:] @ rotations[:-1].transpose(0, 2, 1)
    sines = 0.5 * np.stack((R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=1)
    sine = np.sqrt((sines * sines).sum(axis=1))
    cosine = 0.5 * (R[:, 0, 0] + R[:, 1, 1] + R[:, 2, 2] - 1.0)
    is_large = sine > _EXACT
    scale = np.where(is_large, np.arctan2(sine, cosine) / np.where(is_large, sine, 1.0), 1.0)
    found = sines * scale[:, np.newaxis]
    for row in np.flatnonzero(~is_large & (cosine < 0.0)).tolist():  # Half a turn: only its axis is to be found.
        found[row] = rotation_between(_nine(rotations[row]), _nine(rotations[row + 1]))
    return found


def _nine(rotation: Array) -> Rotation9:
    a, b, c, d, e, f, g, h, i = rotation.ravel().tolist()
    return a, b, c, d, e, f, g, h, i


def _short_way(steps: Array) -> Array:
    """Returns steps of an angle the short way round, [rad]."""
    return np.where(np.abs(steps) <= math.pi, steps, np.remainder(steps + math.pi, math.tau) - math.pi)
