"""Blends: the smooth curves that round the corners of a program.

Each of the two segments is cut where the tool is one radius away from the corner, and a quintic joins the cuts with the
segments' own direction and curvature there. Between paths of the tool the quintic is in position, orientation (the
rotation vector relative to the corner, in which both slerps are straight) and arm angle; between two lines it stays in
their plane, inside their triangle. Next to a joint move it is in joint space. In both cases it must stay inside the
sphere around the corner; this is checked, and the cuts are moved closer if necessary.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose, wxyz_from_rotation
from rcilab.model.robot_model import RobotModel
from rcilab.motion.hermite import DIFFERENCE_STEP, State, central_state, evaluate, quintic
from rcilab.motion.path import Path

_SAMPLES = 33
"""Number of points at which half a segment, or a blend, is sampled; tuning value."""
_MIN_TRAVEL = 1e-6
"""A tool that moves less than this only rotates, [m]."""
_RADIUS_MARGIN = 0.999
"""Part of the radius within which the samples must be, so that the curve between them is inside, too."""

LENGTH = 1.0
"""Length of every blend in the spline's parameter s; the corner is in the middle."""


class Side(Protocol):
    """A path that ends, or begins, at a corner, as a function of its share."""

    @property
    def path(self) -> Path | None:
        """Path of the tool; None is a path of the joints."""
        ...

    def positions(self, model: RobotModel, shares: Array) -> Array:
        """Returns positions of the tool, shape (N, 3), [m], at many shares, shape (N,)."""
        ...

    def state(self, model: RobotModel, share: float) -> State:
        """Returns joint angles and their first two derivatives by the share, each of shape (n,)."""
        ...


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Blend:
    """The curve from a point on one segment to a point on the next."""

    exit_share: float
    """Share of the previous segment at which the blend begins, from 1/2 to 1."""
    entry_share: float
    """Share of the next segment at which the blend ends, from 0 to 1/2."""
    radius: float
    """Largest distance of the cuts from the corner, [m]."""
    corner: Pose | None
    """Pose of the tool at the corner; None if the curve is in joint space."""
    powers: tuple[Array, ...]
    """Coefficients of the quintic: joint angles, (n,), or position, rotation vector and arm angle, (7,)."""

    def poses(self, parts: Array) -> tuple[Array, Array]:
        """Returns poses, shape (N, 4, 4), and arm angles, shape (N,), at shares of the blend, shape (N,)."""
        assert self.corner is not None
        values = evaluate(self.powers, parts)
        T = np.zeros((len(parts), 4, 4))
        T[:, 3, 3] = 1.0
        T[:, :3, :3] = self.corner.rotation @ rotations(values[:, 3:6])
        T[:, :3, 3] = values[:, :3]
        return T, values[:, 6]


def build_blend(model: RobotModel, before: Side, after: Side, radius: float) -> Blend:
    """Returns the blend at the end of `before`, with the requested radius, [m], or the largest that fits.

    A blend takes at most half of either segment, as on an industrial controller. The radius is the same on both sides
    of the corner, unless the tool does not move on one of them.
    """
    corner = after.positions(model, np.zeros(1))[0]
    halves = _distances(model, before, corner, -1.0), _distances(model, after, corner, 1.0)
    moving = [float(half.max()) for half in halves if half.max() > _MIN_TRAVEL]
    radius = min([radius, *moving])
    back, ahead = _cut(halves[0], radius), _cut(halves[1], radius)
    while True:
        blend = _blend(model, before, after, 1.0 - back, ahead, radius)
        excess = _largest_distance(model, blend, corner) / (_RADIUS_MARGIN * radius)
        if excess <= 1.0:
            return blend
        closer = max(0.5, 0.99 / excess)
        back, ahead = closer * back, closer * ahead


def rotations(vectors: Array) -> Array:
    """Returns the matrices, shape (N, 3, 3), of rotation vectors, shape (N, 3), [rad], by Rodrigues' formula."""
    square = (vectors * vectors).sum(axis=1)
    angle = np.sqrt(square)
    safe = np.where(angle > 1e-8, angle, 1.0)
    a = np.where(angle > 1e-8, np.sin(safe) / safe, 1.0 - square / 6.0)
    half = np.sin(safe / 2.0) / safe
    b = np.where(angle > 1e-8, 2.0 * half * half, 0.5 - square / 24.0)
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    K = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
    return np.eye(3) + a[:, None, None] * K + b[:, None, None] * (K @ K)


def _distances(model: RobotModel, segment: Side, corner: Array, side: float) -> Array:
    """Returns the tool's distances from the corner, from there to the middle of a segment, shape (N,), [m]."""
    shares = np.linspace(0.0, 0.5, _SAMPLES) if side > 0.0 else np.linspace(1.0, 0.5, _SAMPLES)
    return np.sqrt(((segment.positions(model, shares) - corner) ** 2).sum(axis=1))


def _cut(distances: Array, radius: float) -> float:
    """Returns the share, from the corner, at which the tool is first a radius away; 1/2 if it never is."""
    beyond = np.flatnonzero(distances > radius)
    if not beyond.size:
        return 0.5
    i = int(beyond[0])
    part = (radius - distances[i - 1]) / (distances[i] - distances[i - 1])
    return float(i - 1 + part) * 0.5 / (len(distances) - 1)


def _blend(model: RobotModel, before: Side, after: Side, exit_share: float, entry_share: float, radius: float) -> Blend:
    rates = 2.0 * (1.0 - exit_share) / LENGTH, 2.0 * entry_share / LENGTH
    if before.path is not None and after.path is not None:
        corner = before.path.goal
        left = _scaled(_tool_state(before.path, corner, exit_share), rates[0])
        right = _scaled(_tool_state(after.path, corner, entry_share), rates[1])
        right[0][6] += math.tau * round(
            (left[0][6] - right[0][6]) / math.tau
        )  # The equivalent angle nearest to the other.
    else:
        corner = None
        left, right = (
            _scaled(before.state(model, exit_share), rates[0]),
            _scaled(after.state(model, entry_share), rates[1]),
        )
    powers = quintic(left, right, LENGTH)
    return Blend(exit_share=exit_share, entry_share=entry_share, radius=radius, corner=corner, powers=powers)


def _scaled(state: State, rate: float) -> State:
    return state[0], state[1] * rate, state[2] * rate**2


def _tool_state(path: Path, corner: Pose, share: float) -> State:
    """Returns position, rotation vector from the corner and arm angle, (7,), with two derivatives by the share."""
    if path.circle is None and path.turning is None:
        return _line_state(path, share, is_end=corner is path.goal)
    T, psi = path.sample(share + DIFFERENCE_STEP * np.array([-1.0, 0.0, 1.0]))
    rows = np.zeros((3, 7))
    rows[:, :3] = T[:, :3, 3]
    rows[:, 3:6] = [_rotation_vector(R) for R in corner.rotation.T @ T[:, :3, :3]]
    if psi is not None:
        rows[:, 6] = psi
    for row in (0, 2):  # Half a turn from the corner the vector is ambiguous; keep the one of the middle row.
        if rows[row, 3:6] @ rows[1, 3:6] < 0.0 and (size := float(np.linalg.norm(rows[row, 3:6]))) > math.pi / 2.0:
            rows[row, 3:6] *= 1.0 - math.tau / size
    return central_state(*rows)


def _line_state(path: Path, share: float, *, is_end: bool) -> State:
    """Returns the same for a line with a slerp, whose corner is one of its ends: all of it is linear in the share."""
    start, goal = path.start, path.goal
    slope, value = np.zeros(7), np.zeros(7)
    slope[:3] = goal.position - start.position
    slope[3:6] = _rotation_vector(start.rotation.T @ goal.rotation)
    value[:3] = start.position
    if path.psi_start is not None and path.psi_goal is not None:
        slope[6], value[6] = path.psi_goal - path.psi_start, path.psi_start
    value += share * slope
    value[3:6] = (share - 1.0 if is_end else share) * slope[3:6]
    return value, slope, np.zeros(7)


def _rotation_vector(R: Array) -> Array:
    """Returns the rotation vector of a rotation, shape (3,), [rad], of at most half a turn."""
    a, b, c, d, e, f, g, h, i = R.ravel().tolist()
    w, x, y, z = wxyz_from_rotation((a, b, c, d, e, f, g, h, i))
    w, x, y, z = (-w, -x, -y, -z) if w < 0.0 else (w, x, y, z)
    sine = math.hypot(x, y, z)
    factor = 2.0 * math.atan2(sine, w) / sine if sine > 1e-12 else 2.0
    return np.array([factor * x, factor * y, factor * z])


def _largest_distance(model: RobotModel, blend: Blend, corner: Array) -> float:
    values = evaluate(blend.powers, np.linspace(0.0, 1.0, _SAMPLES))
    positions = values[:, :3] if blend.corner is not None else model.position_path(values)
    return float(np.sqrt(((positions - corner) ** 2).sum(axis=1).max()))
