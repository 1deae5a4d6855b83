"""Requests that set the goal: solve, plan, check. Owned by the dispatcher's thread."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, Protocol, TypeAlias

import numpy as np

from rcilab.app.app_state import AppState
from rcilab.app.arm_features import start_of_plans
from rcilab.app.goal.elbow import in_branch, nearest_free
from rcilab.app.goal.goal import POSE_FIELDS, Goal, goal_at, goal_toward, with_pose_field
from rcilab.app.planning import PATH_TYPES, Plan, make_plan, make_recovery
from rcilab.app.request import Handlers, Request, TypeField
from rcilab.app.run.plan_readiness import ArmStatus, is_done, is_moving
from rcilab.app.state_store import StateStore
from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.background_job import BackgroundJob, ProgressCallback
from rcilab.core.errors import RcilabError
from rcilab.core.spatial import Pose
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.number_parsing import parse_number, parse_quaternion
from rcilab.i18n.translator import Message, message
from rcilab.motion.joint import JOINT_LAWS

QUATERNION = "wxyz"
"""Name of the field that takes all four numbers of the orientation."""
FURTHEST = 3.0  # [m] More than twice the reach of any arm, and the gizmo stays visible.
SLOWEST = 0.01  # Lowest speed of plans, as a share of the limits.
SETTLED = 0.15  # [s] A goal that has not changed for this time is taken as final.
_FIELDS = ("joint.", "pose.", "psi")  # Beginnings of the names of the fields that a goal is typed into.
_ANGLES = ("pose.roll", "pose.pitch", "pose.yaw")
_REPLACED = {f"pose.{QUATERNION}": _ANGLES, **dict.fromkeys(_ANGLES, (f"pose.{QUATERNION}",))}
"""Fields of the same orientation: a rejected text in them is about the previous one."""
_DRAW_FIRST = 5e-4  # [s] For the threads of the view to start; a tuning value.
_ONE_DRAG = 1.0  # [s] Changes within this time belong to one drag, or one use of a slider's keys.
RESTED = 0.6  # [s] The same for a gizmo that is still held: the operator may only pause.


PoseName: TypeAlias = Literal["zero", "home", "here", "start", "undo", "redo"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveJoint(Request):
    """Set one joint of the goal."""

    joint: int
    """From 0."""
    angle: float
    """[rad]."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"joint.{self.joint}.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseGoal(Request):
    """Set the goal to a named pose."""

    name: PoseName
    """"start" is the start of the plan, or of its program."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveTarget(Request):
    """The gizmo was moved."""

    position: tuple[float, ...]
    """[m]."""
    wxyz: tuple[float, ...]
    ended: bool = False
    """Whether the mouse was released."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return None if self.ended else f"target.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SetArmAngle(Request):
    """Turn the elbow of a 7-axis arm."""

    psi: float
    """[rad]."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"SetArmAngle.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseBranch(Request):
    """Choose another analytic solution for the same pose."""

    index: int
    """From 0, in the order of the list."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetPathType(Request):
    """Path type to the goal; None leaves a value unchanged."""

    kind: str | None = None
    """"joint", "line", "arc" or "free"."""
    via: bool = False
    """Whether the current target becomes the via point of the arc."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanGoal(Request):
    """Plan from the arm's position to the goal, and check it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelSearch(Request):
    """Cancel the search for a path around obstacles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRecovery(Request):
    """Plan from the arm's position, outside a joint's range, back inside."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetSpeed(Request):
    """Share of the velocity and acceleration limits to plan with."""

    speed: float
    """0 to 1."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"SetSpeed.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SetLaw(Request):
    """Choose the time law."""

    law: str


class StatusSource(Protocol):
    """Provides the arm's position."""

    def status(self) -> ArmStatus:
        """Returns the status; a plan begins at its `q_c`."""
        ...


class GoalActions:
    """The goal: joint angles, target pose, typed numbers, speed.

    Args:
        store: The state.
        robot: Provides the arm's position.
        plans_at_once: Whether every change is planned at once; otherwise only on request.
    """

    def __init__(self, store: StateStore[AppState], robot: StatusSource, *, plans_at_once: bool = True) -> None:
        self._store, self._robot, self._plans_at_once = store, robot, plans_at_once
        self._stale = False  # The goal has changed during a motion.
        self._planned = 0.0  # [s] Time of the last plan.
        self._due: float | None = None  # [s] Time at which a tool path is to be planned.
        self._search: BackgroundJob[None, Plan | Message] = BackgroundJob("search")
        self._is_held = False  # The gizmo is being dragged.
        self._rested = 0.0  # [s] Time before which a change of the cell is not checked.
        self._dragged, self._dragged_at = "", 0.0  # What was dragged last, and when, [s].

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            MoveJoint: self.move_joint,
            PoseGoal: self.pose_goal,
            MoveTarget: self.move_target,
            SetArmAngle: self.set_arm_angle,
            ChooseBranch: self.choose_branch,
            SetPathType: self.set_path_type,
            PlanGoal: self.plan,
            CancelSearch: self.cancel_search,
            PlanRecovery: self.plan_recovery,
            SetSpeed: self.set_speed,
            SetLaw: self.set_law,
        }

    def move_joint(self, request: MoveJoint) -> None:
        """Sets one joint of the goal."""
        model = self._store.state.model
        if not (0 <= request.joint < model.n and math.isfinite(request.angle)):
            return
        q = np.array(self._store.state.goal.q)
        limits = model.limits.joint
        self._push_undo_once(f"joint {request.joint}")
        q[request.joint] = request.angle
        self.set_joints(readonly_copy(np.clip(q, limits.lower, limits.upper)))  # All joints: soft limits may be new.

    def pose_goal(self, request: PoseGoal) -> None:
        """Sets the goal to a named pose."""
        state, self._dragged = self._store.state, ""
        if request.name in ("undo", "redo"):
            goal = self._store.undo() if request.name == "undo" else self._store.redo()
            if goal is not None:
                self._store.clear_problems(*_FIELDS)
                self._store.update(goal=goal)
                self.plan()
            return
        self._store.push_undo()
        here = self._robot.status().q_c
        named = {
            "zero": np.zeros(state.model.n),
            "home": state.model.home,
            "here": state.goal.q if here is None else here,
            "start": state.goal.q if state.plan is None else _beginning(state.plan),
        }
        self.set_joints(readonly_copy(named[request.name]))

    def move_target(self, request: MoveTarget) -> None:
        """Follows the gizmo."""
        numbers = (*request.position, *request.wxyz)
        if len(numbers) != 7 or not all(math.isfinite(number) for number in numbers):
            return
        if math.hypot(*request.wxyz) < 1e-6:
            return
        position = [min(max(number, -FURTHEST), FURTHEST) for number in request.position]
        self._push_undo_once("target")
        self._is_held = not request.ended
        self.set_target(Pose(position, request.wxyz))

    def _push_undo_once(self, what: str) -> None:
        """Stores the goal for undo, once per drag."""
        now = time.monotonic()
        if what != self._dragged or now - self._dragged_at > _ONE_DRAG:
            self._store.push_undo()
        self._dragged, self._dragged_at = what, now

    def set_arm_angle(self, request: SetArmAngle, branch: int | None = None) -> None:
        """Turns the elbow about the shoulder-wrist line while the tool is held, as far as the limits allow."""
        if math.isfinite(request.psi) and self._store.state.model.redundancy:
            state = self._store.state
            goal, wanted = state.goal, math.remainder(request.psi, math.tau)
            psi, snapped = nearest_free(state.model, goal.target, wanted, branch, state.box)
            near = None if branch is None else in_branch(state.model, goal.target, psi, goal.q, branch)
            self.set_target(goal.target, psi, near, snapped)

    def choose_branch(self, request: ChooseBranch) -> None:
        """Chooses another analytic solution of the same pose."""
        goal = self._store.state.goal
        solutions = goal.reach.solutions
        if solutions is None or not 0 <= request.index < len(solutions):
            return
        self._store.push_undo()
        self.set_target(goal.target, None, near=solutions[request.index])

    def set_waypoint_target(self, target: Pose, psi: float | None, q: JointVector | None) -> None:
        """Sets the goal to that of a waypoint: joint angles, or a pose with an arm angle."""
        self._store.push_undo()
        if q is None:
            self.set_target(target, psi)
        else:
            self.set_joints(q)

    def type_field(self, request: TypeField) -> None:
        """Takes a typed number, or shows the problem next to its field."""
        state = self._store.state
        kind, _, name = request.field.partition(".")
        if kind == "joint" and name in map(str, range(state.model.n)):
            low, high = np.degrees(state.model.limits.joint.lower), np.degrees(state.model.limits.joint.upper)
            number = int(name)
            parsed = parse_number(
                request.text,
                round(float(low[number]), 6),
                round(float(high[number]), 6),
                "deg",
                soft_low=state.model.limits.joint.is_soft(number + 1, "lower"),
                soft_high=state.model.limits.joint.is_soft(number + 1, "upper"),
            )
            value = parsed.value
            act = None if value is None else lambda: self.move_joint(
                MoveJoint(joint=number, angle=math.radians(value))
            )  # fmt: skip
        elif kind == "pose" and name in POSE_FIELDS:
            index = POSE_FIELDS.index(name)
            bound, unit = (FURTHEST * 1000.0, "mm") if index < 3 else (360.0, "deg")
            parsed = parse_number(request.text, -bound, bound, unit)
            value = parsed.value
            act = None if value is None else lambda: self.set_target(with_pose_field(state.goal.target, name, value))
        elif kind == "pose" and name == QUATERNION:
            parsed = parse_quaternion(request.text)
            wxyz = parsed.value
            act = None if wxyz is None else lambda: self.set_target(Pose(state.goal.target.position, wxyz))
        elif request.field == "speed":
            parsed = parse_number(request.text, 100.0 * SLOWEST, 100.0, "%")
            value = parsed.value
            act = None if value is None else lambda: self.set_speed(SetSpeed(speed=value / 100.0))
        elif kind == "psi" and state.model.redundancy:
            parsed = parse_number(request.text, -180.0, 180.0, "deg")
            value = parsed.value
            act = None if value is None else lambda: self.set_arm_angle(SetArmAngle(psi=math.radians(value)))
        else:
            return
        if act is None:
            assert parsed.problem is not None
            self._store.set_problem(request.field, parsed.problem)
            return
        self._store.push_undo()
        self._store.clear_problems(request.field, *_REPLACED.get(request.field, ()))
        others = self._store.state.problems  # The texts of other fields stay there, to be corrected.
        act()
        self._store.update(problems=others)

    def set_speed(self, request: SetSpeed) -> None:
        """Changes the speed of plans."""
        if math.isfinite(request.speed):
            self._store.update(speed=min(max(request.speed, SLOWEST), 1.0))
            self._store.clear_problems("speed")
            self.plan()

    def set_law(self, request: SetLaw) -> None:
        """Changes the time law."""
        if request.law in JOINT_LAWS:
            self._store.update(law=request.law)
            self.plan()

    def set_path_type(self, request: SetPathType) -> None:
        """Changes the path type, or the via point of an arc."""
        kind = next((kind for kind in PATH_TYPES if kind == request.kind), self._store.state.path_type)
        via = self._store.state.goal.target if request.via else self._store.state.via
        self._store.update(path_type=kind, via=via)
        self.plan()

    def plan(self, request: PlanGoal | None = None) -> None:
        """Plans from the arm's position to the goal; during a motion, once the arm stands still.

        A tool path takes too long for a drag: it is planned once the goal does not change any more.
        """
        if request is None and not self._plans_at_once:
            return
        state, status = self._store.state, self._robot.status()
        self._due = None
        self._drop_search()
        if is_moving(status):
            self._stale = True
            return
        self._stale = False
        start = start_of_plans(state.model, status)
        if start is None:
            if request is not None:  # Nothing has changed: the plan is kept.
                self._store.notify("warn", message("plan.no_arm"))
            elif state.recording is None:  # A displayed run stays, whatever the goal is.
                self._show_without_plan(message("plan.no_arm"))
            return
        if state.path_type != "joint" and request is None:
            self._due = time.monotonic() + SETTLED
            self._show_without_plan(message("plan.soon"))
            return
        self._make(state, readonly_copy(start), is_asked=request is not None)

    def _make(self, state: AppState, start: JointVector, *, is_asked: bool) -> None:
        if state.path_type == "free":
            self._search.start(None, self.prepare_plan(start))
            self._store.update(search=0.0)
            self._show_without_plan(message("plan.searching"))
            return
        made = self.prepare_plan(start)(_ignore)
        self._planned = time.monotonic()
        is_program = state.plan is not None and state.plan.program is not None
        if is_program and not is_asked and state.plan is not None and not is_done(state.plan, start):
            self._store.notify("warn", message("plan.replaced"))
        self.show(made)

    def prepare_plan(self, start: JointVector) -> Callable[[ProgressCallback], Plan | Message]:
        """Returns a function that plans from joint angles, [rad], to the current goal; any thread may call it."""
        state = self._store.state
        box, missed_by, cell = state.box, state.goal.reach.missed_by, state.cell_for(state.model)

        def make(progress: ProgressCallback) -> Plan | Message:
            made = make_plan(
                state.model,
                start,
                state.goal.q,
                state.speed,
                state.law,
                box,
                state.path_type,
                state.via,
                cell,
                progress,
            )
            return replace(made, missed_by=missed_by) if isinstance(made, Plan) else made

        return make

    def plan_recovery(self, request: PlanRecovery) -> None:
        """Plans from the arm's position, outside a joint's range, back inside; the goal is kept for the next plan."""
        state, status = self._store.state, self._robot.status()
        if status.q_c is None or is_moving(status):
            return
        self._stale, self._due = False, None
        self._planned = time.monotonic()
        self.show(make_recovery(state.model, readonly_copy(status.q_c), state.box))

    def show(self, made: Plan | Message) -> None:
        """Shows a plan from its start, or why planning failed."""
        if isinstance(made, Plan):
            self._store.update(plan=made, no_plan=None, recording=None, playhead=0.0, playing=False)
            return
        if self._store.state.watched and made.code == "plan.here":
            made = message("plan.watched")
        self._show_without_plan(made)

    def _show_without_plan(self, why: Message) -> None:
        self._store.update(plan=None, no_plan=why, recording=None, playhead=0.0, playing=False)

    def cancel_search(self, request: CancelSearch) -> None:
        """Cancels the search for a path around obstacles."""
        if self._search.progress is not None:
            self._drop_search()
            self._show_without_plan(message("plan.search_cancelled"))

    def close(self) -> None:
        """Cancels the search."""
        self._search.cancel()

    def _drop_search(self) -> None:
        if self._search.progress is not None:
            self._search.cancel()
            self._store.update(search=None)

    def _follow_search(self) -> None:
        """Shows the progress or the result of the search, unless another plan has been shown meanwhile."""
        no_plan = self._store.state.no_plan
        if self._store.state.plan is not None or no_plan is None or no_plan.code != "plan.searching":
            self._drop_search()
        elif self._search.is_done:
            _, made = self._search.pop_result()
            self._store.update(search=None)
            self._planned = time.monotonic()
            self.show(message("plan.failed", error=describe_error(made)) if isinstance(made, RcilabError) else made)
        elif self._search.progress != self._store.state.search:
            self._store.update(search=self._search.progress)

    def settle(self) -> None:
        """Checks for collisions, too, once the goal has not changed for a moment; follows a search."""
        if self._search.progress is not None:
            self._follow_search()
        state = self._store.state
        if self._due is not None and time.monotonic() >= self._due:
            self.plan(PlanGoal())
            state = self._store.state
        if state.plan is None or time.monotonic() - self._planned < (RESTED if self._is_held else SETTLED):
            return
        cell = state.plan.cell if state.plan.is_recorded else state.cell_for(state.plan.model)
        if cell is not state.plan.cell and time.monotonic() < self._rested:
            return
        began = time.monotonic()
        checked = state.plan.completed(state.drive.mode, cell)
        if checked is not state.plan:
            self._rested = 2.0 * time.monotonic() - began  # An obstacle is dragged: half the time is for requests.
            self._store.update(plan=checked)

    def catch_up(self) -> None:
        """Plans what was postponed during a motion."""
        if self._stale:
            self.plan()

    def follow(self, q: JointVector) -> Goal:
        """Sets the goal to the position of the moving arm and returns it; it is planned once the arm stands still."""
        goal = goal_at(self._store.state.model, q)
        self._store.update(goal=goal)
        self._stale = True
        return goal

    def set_joints(self, q: JointVector) -> None:
        """Sets the goal to joint angles; rejected texts were about the previous one."""
        self._store.clear_problems(*_FIELDS)
        self._show_goal(goal_at(self._store.state.model, q))
        self.plan()

    def set_target(
        self,
        target: Pose,
        psi: float | None = None,
        near: JointVector | None = None,
        snapped: Message | None = None,
    ) -> None:
        """Sets the goal to a target pose, see `goal_toward`; `near` defaults to the current goal.

        Rejected texts were about the previous goal.
        """
        self._store.clear_problems(*_FIELDS)
        state = self._store.state
        around, kept = (state.goal.q, state.goal.kept_psi) if near is None else (near, None)
        self._show_goal(goal_toward(state.model, target, around, psi, snapped, kept))
        self.plan()

    def _show_goal(self, goal: Goal) -> None:
        """Sets the goal; the view draws the arm before planning, which keeps the interpreter busy for milliseconds."""
        self._store.update(goal=goal)
        if self._plans_at_once:
            self._store.changed.set()
            time.sleep(_DRAW_FIRST)


def _ignore(share: float) -> None:
    """Takes the progress of a plan that is ready at once."""


def _beginning(plan: Plan) -> JointVector:
    """Returns where a plan begins; for a program its start, not that of the approach, shape (n,), [rad]."""
    return plan.motion.start if plan.program is None else np.array(plan.program.start)
