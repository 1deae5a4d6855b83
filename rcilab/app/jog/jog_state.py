"""Jogging: its settings, how fast and how far one button moves, what prevents it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rcilab.app.arm_features import explain_missing_robot
from rcilab.app.request import Moving
from rcilab.app.setup.configuration_state import setup_obstacle
from rcilab.app.status_text import describe_status
from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.clearance import ADVISED_DISTANCE
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.i18n.translator import Message, message
from rcilab.motion.online import POSITION_MARGIN
from rcilab.motion.twist import DAMPED_BELOW

if TYPE_CHECKING:
    from rcilab.app.planning import Plan
    from rcilab.app.store import Store, UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.execution.jog import JogKind
    from rcilab.model.robot_model import RobotModel

Frame = Literal["base", "tool"]

FRAMES: tuple[Frame, ...] = ("base", "tool")
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
STEPS = (0.0, 0.1, 1.0, 5.0, 10.0)
"""Millimetres or degrees per press; 0: as long as the button is held."""

FASTEST_TOOL = 0.25  # [m/s] Reduced speed of ISO 10218-1; no jog moves the tool tip faster.
FASTEST_TURN = math.radians(45.0)  # [rad/s] Of the tool.
FASTEST_JOINT = math.radians(30.0)  # [rad/s]
SLOWEST = 0.01  # Share of the fastest jog.
STILL = 1e-3  # [rad/s] Below this a jogged joint counts as standing still.

_AT_LIMIT = math.radians(0.05)  # [rad] At a smaller distance a jogged joint has arrived at its limit.
_REACTION = 0.5  # [s] A jog that is not renewed ends in 0.3 s; with its stop it is shorter than this.
_AHEAD = 0.1  # [s] How far ahead distances are evaluated.
_FACE = 1e-3  # [m] Distance at which the tool stops before a face of the safety box.
_APPROACH = 1e-4  # [m/s] A slower approach is ignored.
STANDING = 0.02  # A smaller part of a jog is ignored.

_NO_JOG = {
    "starting": "ready.starting",
    "connecting": "ready.starting",
    "stopping": "ready.moving",
    "fault": "ready.fault",
    "lost": "ready.lost",
    "closed": "ready.closed",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class JogButton(Moving):
    """One of the buttons of the Jog tab."""

    axis: str
    """"joint.0" ... "joint.6", or "x", "y", "z", "roll", "pitch", "yaw"."""
    sign: int
    """1 or -1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldJog(JogButton):
    """It is held; sent ten times a second."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"HoldJog.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class PressJog(JogButton):
    """It was pressed and released."""


@dataclass(frozen=True, kw_only=True)
class JogState:
    """Settings and messages of the jog."""

    robot: bool = False
    """Whether the buttons move the robot; otherwise they move the goal."""
    asked: bool = False
    """Whether a foreign robot was chosen and the second confirmation is awaited."""
    step: float = 0.0
    """One of `STEPS`."""
    frame: Frame = "base"
    speed: float = 0.3
    """Share of the fastest jog, 0 to 1."""
    sentence: Message | None = None
    """Why the last jog stopped or was refused."""
    poses: tuple[str, ...] = ()
    """Names of the stored poses of this arm."""
    pose: str = ""
    """The selected one."""


@dataclass(frozen=True, slots=True)
class Axis:
    """One button: a joint or an axis of the tool, and a direction."""

    name: str
    """"joint.0" ... "joint.6", or one of `AXES`."""
    sign: int
    """1 or -1."""

    @property
    def joint(self) -> int | None:
        """Number of the joint from 0; None for an axis of the tool."""
        return int(self.name[6:]) if self.name.startswith("joint.") else None

    def exists(self, model: RobotModel) -> bool:
        """Returns whether an arm has this joint or axis."""
        names = (*(f"joint.{joint}" for joint in range(model.n)), *AXES)
        return self.name in names and self.sign in (-1, 1)


def jog_velocity(model: RobotModel, q: JointVector, jog: JogState, axis: Axis) -> tuple[JogKind, Array]:
    """Returns the kind and the values of a jog for `Supervisor.jog`: joint velocities or a twist.

    Args:
        model: The arm.
        q: Current joint angles, shape (n,), [rad]; they decide how fast a joint may turn for `FASTEST_TOOL`.
        jog: Speed and frame.
        axis: The joint or axis.
    """
    joint = axis.joint
    if joint is None:
        twist = np.zeros(6)
        index = AXES.index(axis.name)
        twist[index] = axis.sign * jog.speed * (FASTEST_TOOL if index < 3 else FASTEST_TURN)
        return jog.frame, twist
    lever = float(np.linalg.norm(model.jacobian(q)[:3, joint]))  # [m]
    values = np.zeros(model.n)
    values[joint] = axis.sign * jog.speed * min(FASTEST_JOINT, FASTEST_TOOL / max(lever, 1e-3))
    return "joint", values


def inside(model: RobotModel, q: JointVector) -> JointVector:
    """Returns the joint angles nearest to `q` from which a jog can begin, shape (n,), [rad]."""
    limits = model.limits.joint
    return readonly_copy(np.clip(q, limits.lower + POSITION_MARGIN, limits.upper - POSITION_MARGIN))


def at_limit(model: RobotModel, q: JointVector, axis: Axis) -> Message | None:
    """Returns why a button leads no further: a joint at its limit, or the edge of the workspace; None for neither."""
    limits, joint = model.limits.joint, axis.joint
    for number in range(model.n) if joint is None else (joint,):
        for end, bound, is_soft in (
            ("lower", limits.lower[number], limits.is_soft(number + 1, "lower")),
            ("upper", limits.upper[number], limits.is_soft(number + 1, "upper")),
        ):
            is_ahead = joint is None or (end == "upper") == (axis.sign > 0)
            if is_ahead and abs(q[number] - bound) < _AT_LIMIT:
                kind = f"soft_{end}" if is_soft else end
                return message(f"jog.at_{kind}", joint=number + 1, angle=float(bound))
    if joint is None and np.linalg.svd(model.jacobian(q), compute_uv=False)[-1] < DAMPED_BELOW:
        return message("jog.at_edge")
    return None


def safe_share(model: RobotModel, q: JointVector, kind: JogKind, values: Array) -> tuple[float, tuple[int, int]]:
    """Returns the part of a jog, 0 to 1, that keeps links from each other and the floor, and the nearest pair.

    No controller checks this. Within `_REACTION`, the arm may approach by the rest of `ADVISED_DISTANCE`, so that it
    slows down on its way there, and stops in time even without another update.

    Args:
        model: The arm.
        q: Current joint angles, shape (n,), [rad].
        kind: As for `Supervisor.jog`.
        values: As for `Supervisor.jog`.
    """
    dq = _rates(model, q, kind, values)
    found = model.clearance(np.stack([q, q + _AHEAD * dq]))
    now, ahead = found.distance
    closing = float(now - ahead) / _AHEAD  # [m/s]
    first, second = (int(number) for number in found.links[1])
    if closing <= _APPROACH:
        return 1.0, (first, second)
    return min(max(float(now) - ADVISED_DISTANCE, 0.0) / (closing * _REACTION), 1.0), (first, second)


def box_share(model: RobotModel, q: JointVector, kind: JogKind, values: Array, box: SafetyBox | None) -> float:
    """Returns the part of a jog, 0 to 1, that keeps the tool in the safety box: it slows down towards a face.

    Args:
        model: The arm.
        q: Current joint angles, shape (n,), [rad].
        kind: As for `Supervisor.jog`.
        values: As for `Supervisor.jog`.
        box: The safety box; one that is off has no effect.
    """
    bound = active_box(box)
    if bound is None:
        return 1.0
    ahead = q + _AHEAD * _rates(model, q, kind, values)
    now, then = (-bound.excess(model.forward(angles).position.tolist()) for angles in (q, ahead))
    closing = (now - then) / _AHEAD  # [m/s]
    return 1.0 if closing <= _APPROACH else min(max(now - _FACE, 0.0) / (closing * _REACTION), 1.0)


def fastest_tool(plan: Plan) -> float:
    """Returns the highest speed of the tool in a plan, from the points of its path, [m/s]."""
    steps = np.sqrt(np.square(np.diff(plan.path, axis=0)).sum(axis=1))
    return float(steps.max()) * (len(plan.path) - 1) / plan.motion.duration


def _rates(model: RobotModel, q: JointVector, kind: JogKind, values: Array) -> Array:
    """Returns the joint velocities of a jog, shape (n,), [rad/s]."""
    if kind == "joint":
        return values
    R = model.forward(q).rotation if kind == "tool" else np.eye(3)
    return model.joint_velocity(q, np.concatenate([R @ values[:3], R @ values[3:]])).rates


def no_jog(state: UiState, status: SupervisorStatus) -> Message | None:
    """Returns why the buttons cannot move the robot now, or None when they can."""
    missing = explain_missing_robot(state.model, is_virtual=state.target == "virtual")
    if missing is not None:
        return missing
    if status.code == "moving.guided":
        return message("ready.guided")
    if status.phase == "crashed" or (status.phase == "lost" and state.target == "virtual"):
        return describe_status(status)
    if status.phase == "moving" and status.code != "moving.jog":
        return message("ready.moving")
    if status.is_pressed and status.phase in ("idle", "fault"):
        return message("ready.pressed")
    if status.phase in _NO_JOG:
        return message(_NO_JOG[status.phase])
    if not status.powered:
        return message("ready.power")
    return setup_obstacle(state, status)


def change_jog(store: Store, **changes: Any) -> None:
    """Changes settings and messages of the jog."""
    jog = store.state.jog
    changed = replace(jog, **changes)
    if changed != jog:
        store.update(jog=changed)
