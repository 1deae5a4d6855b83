"""What the scene can show besides, each behind a switch: reach of the arm, swept volume of the plan, dexterity."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rcilab.app.goal.elbow import Elbow
from rcilab.app.scene.path_strip import PathStrip
from rcilab.core.arrays import Array
from rcilab.model.kinematics.workspace import Workspace
from rcilab.model.robot_model import RobotModel
from rcilab.views.swept_volume import swept_mesh

if TYPE_CHECKING:
    from rcilab.cell.cell_geometry import ClosestPoints
    from rcilab.motion import Motion
    from rcilab.robots.mesh import Mesh

Extra: TypeAlias = Literal["elbow", "frames", "ellipsoid", "cloud", "swept"]
EXTRAS: tuple[Extra, ...] = ("elbow", "frames", "ellipsoid", "cloud", "swept")

CUT_AXES = ("x", "y", "z")

SHARE = 0.3
"""Length that a tool speed of 1 m/s for joints at 1 rad/s is drawn with, [m]."""

_SAMPLES = 4000
"""Points of the cloud."""
_MOMENTS = 16
"""Moments of a plan whose arms make its swept volume."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Ellipsoid:
    """How fast the tool can go in every direction when the joints' speeds have norm 1 rad/s."""

    position: Array
    """Of the tool, shape (3,), [m]."""
    axes: Array
    """Directions as columns, base axes, shape (3, 3), a proper rotation."""
    radii: Array
    """Along each, shape (3,), [m/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkspaceCut:
    """A plane across the workspace: the part on the side of the first view's camera is not drawn."""

    axis: Literal["x", "y", "z"]
    """Axis of the base that is normal to it."""
    at: float
    """Where it crosses that axis, [m]."""

    def keeps(self, position: Array) -> NDArray[np.bool_]:
        """Returns which of the positions, shape (N, 3), [m], are drawn, shape (N,)."""
        along = position[:, CUT_AXES.index(self.axis)]
        return along >= self.at if self.axis == "y" else along <= self.at


@dataclass(frozen=True, eq=False, kw_only=True)
class SceneState:
    """What was computed for the scene, and what is chosen to be seen of it."""

    extras: frozenset[Extra] = frozenset()
    elbow: Elbow | None = None
    is_elbow_edited: bool = False
    """Whether the elbow's circle is shown because the elbow is edited."""
    ribbon: PathStrip | None = None
    closest: ClosestPoints | None = None
    """Where the plan is too near to an obstacle."""
    peek: int | None = None
    """Which branch of the goal is under the mouse or has the focus, from 0."""
    ellipsoid: Ellipsoid | None = None
    cloud: Workspace | None = field(default=None, repr=False)
    cut: WorkspaceCut | None = None
    swept: Mesh | None = field(default=None, repr=False)


def extras_of(model: RobotModel) -> tuple[Extra, ...]:
    """Returns what the scene can show of an arm besides."""
    return tuple(extra for extra in EXTRAS if extra != "elbow" or model.redundancy.kind == "arm_angle")


def compute_ellipsoid(model: RobotModel, q: Array) -> Ellipsoid:
    """Returns the ellipsoid of linear manipulability at the tool (Yoshikawa 1985)."""
    axes, radii, _ = np.linalg.svd(model.jacobian(q)[:3], full_matrices=False)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return Ellipsoid(position=model.forward(q).position, axes=axes, radii=radii)


def compute_workspace(model: RobotModel) -> Workspace:
    """Returns a cloud of places that the tool can be brought to."""
    return model.sample_workspace(_SAMPLES)


def compute_swept_volume(model: RobotModel, motion: Motion) -> Mesh:
    """Returns the arm at several moments of a motion, as one mesh in base."""
    return swept_mesh(model, np.stack([motion.at(t).q for t in np.linspace(0.0, motion.duration, _MOMENTS)]))
