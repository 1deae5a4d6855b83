"""Signals of the tool and the elbow as tables with one row per cycle, as `CartesianMonitor` computes them."""

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

PREVIOUS_COMMANDS = 3
"""Number of commands before the first checked one: the reach of a third difference."""

Differences: TypeAlias = tuple[Array, Array, Array, Array]
"""A signal and its first, second and third backward difference, one row per cycle."""

_ELBOW_JOINT = 3  # Index, from 0: the elbow flips with joint 4.
_EXACT = 1e-8  # Sine of an angle up to which the sine equals the angle; as in `rotation_between`.


class ToolSignals:
    """The tool and the elbow along commanded joint angles.

    Args:
        model: The arm with its tool.
        start: State of the arm at the start.
        path: Joint angles in every checked cycle, shape (N, n), [rad].
    """

    def __init__(self, model: RobotModel, start: StartState, path: JointPath) -> None:
        self._model = model
        self._is_moving = start.moving
        # A moving arm already has its first row.
        self._rows = np.concatenate((commands_before(start), path[1:] if start.moving else path))
        self._inverse = model.solver

    def differences(self, signal: str) -> Differences:
        """Returns "arm_angle" with its differences, or the norms of the differences of "translation" or "rotation".

        Each of shape (N, 1). Position and orientation themselves have no bound on a norm and are zero.
        """
        if signal == "arm_angle":
            return self._arm_angle
        return self._translation if signal == "translation" else self._rotation

    @cached_property
    def singularity(self) -> Array:
        """Closeness to a singularity, shape (N, 1); singular from 1 on."""
        return self._inverse.singularity_path(self._rows[self._first :])[:, np.newaxis]

    @cached_property
    def elbow_side(self) -> Array:
        """+1 if joint 4 is on the same side of the elbow's flip as at the start, -1 on the other, shape (N, 1)."""
        flip = self._model.description.elbow_flip
        assert flip is not None
        sides = np.where(self._rows[:, _ELBOW_JOINT] > flip, 1.0, -1.0)
        return (sides[self._first :] * sides[PREVIOUS_COMMANDS - 1])[:, np.newaxis]

    @cached_property
    def start_distance(self) -> float:
        """Distance of the first commanded position of the tool from the arm's, [m]."""
        return float(np.linalg.norm(self._poses[self._first, :3, 3] - self._poses[PREVIOUS_COMMANDS - 1, :3, 3]))

    @cached_property
    def start_turn(self) -> float:
        """Difference of the first commanded arm angle from the arm's, [rad]."""
        psi = self._inverse.redundancy_angle_path(self._rows[[PREVIOUS_COMMANDS - 1, self._first]])
        return float(_wrapped(np.diff(psi))[0])

    @property
    def _first(self) -> int:
        return PREVIOUS_COMMANDS - 1 if self._is_moving else PREVIOUS_COMMANDS

    @cached_property
    def _poses(self) -> Array:
        return self._model.forward_path(self._rows)

    @cached_property
    def _translation(self) -> Differences:
        return self._norms(np.diff(self._poses[:, :3, 3], axis=0))

    @cached_property
    def _rotation(self) -> Differences:
        return self._norms(rotation_steps(self._poses[:, :3, :3]))

    @cached_property
    def _arm_angle(self) -> Differences:
        psi = self._inverse.redundancy_angle_path(self._rows)
        first, second, third = self._derivatives(_wrapped(np.diff(psi))[:, np.newaxis])
        return psi[self._first :, np.newaxis], first, second, third

    def _norms(self, steps: Array) -> Differences:
        first, second, third = (
            np.sqrt((values * values).sum(axis=1))[:, np.newaxis] for values in self._derivatives(steps)
        )
        return np.zeros_like(first), first, second, third

    def _derivatives(self, steps: Array) -> tuple[Array, Array, Array]:
        """Returns velocity, acceleration and jerk of the checked cycles from the steps between all rows."""
        first = steps / CYCLE_TIME
        second = np.diff(first, axis=0) / CYCLE_TIME
        third = np.diff(second, axis=0) / CYCLE_TIME
        if not self._is_moving:
            return first[2:], second[1:], third
        return first[1:], second, np.concatenate((np.zeros_like(third[:1]), third))


def commands_before(start: StartState) -> JointPath:
    """Returns the three commands that lead to a state, the oldest first, shape (3, n), [rad]."""
    last = start.q - CYCLE_TIME * start.dq
    oldest = last - CYCLE_TIME * (start.dq - CYCLE_TIME * start.ddq)
    return np.stack((oldest, last, start.q))


def rotation_steps(rotations: Array) -> Array:
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
    for row in np.flatnonzero(~is_large & (cosine < 0.0)).tolist():  # Half a turn: only the axis is unknown.
        found[row] = rotation_between(_nine(rotations[row]), _nine(rotations[row + 1]))
    return found


def _nine(rotation: Array) -> Rotation9:
    a, b, c, d, e, f, g, h, i = rotation.ravel().tolist()
    return a, b, c, d, e, f, g, h, i


def _wrapped(steps: Array) -> Array:
    """Returns steps of an angle wrapped to -pi to pi, [rad]."""
    return np.where(np.abs(steps) <= math.pi, steps, np.remainder(steps + math.pi, math.tau) - math.pi)
