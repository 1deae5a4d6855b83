"""The shared state of a lab's parts: the application's state and requests, the robot, the displayed time.

A part gets a model, a session or another part; parts of the same state change together. Goal, plan and settings are
values of `rcilab.app`, changed by its requests as on the page.
"""

from __future__ import annotations

import sys
import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypeGuard

from numpy.typing import ArrayLike

from rcilab.app.app_state import AppState
from rcilab.app.displayed_motion import display_run
from rcilab.app.goal.goal import evaluate_joints, goal_at
from rcilab.app.goal.goal_actions import GoalActions, PlanGoal
from rcilab.app.planning import Plan, build_plan_view
from rcilab.app.request import Handlers, Request
from rcilab.app.run.drive_state import choose_mode
from rcilab.app.run.plan_readiness import ArmStatus
from rcilab.app.state_store import StateStore
from rcilab.conformance.check import check
from rcilab.core.arrays import JointVector, as_vector, readonly_copy
from rcilab.core.background_job import ProgressCallback
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.core.state import Mode, require_mode
from rcilab.i18n.translator import Message
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.motion import require_motion

if TYPE_CHECKING:
    from rcilab.app.displayed_motion import DisplayedMotion
    from rcilab.app.robot_connection import RobotConnection
    from rcilab.app.run.robot_requests import Outcome
    from rcilab.app.session_connection import SessionConnection
    from rcilab.control_process import SupervisorStatus
    from rcilab.execution.session import RobotSession
    from rcilab.motion.motion import Motion
    from rcilab.recording.run import Run

Topic = Literal["goal", "plan", "moment", "robot", "run"]
"""goal: joint angles or pose; plan: a motion and its report; moment: the displayed time of the plan; robot: its
status; run: the result of an execution."""
_PLANNED = 0.5  # Progress at the end of planning, before the check; as measured.


class LabState:
    """One arm, and the goal, plan and run of the notebook. Safe to use from any thread: changes are made one at a time.

    Args:
        model: The arm.
        session: The session that executes; None: `RunPanel` connects.
    """

    def __init__(self, model: RobotModel, session: RobotSession | None = None) -> None:
        require_model(model)
        self._own_limits = model.limits.joint  # The arm's own, without soft limits set here.
        self.session = session
        self.lock = threading.RLock()
        self.robot: RobotConnection | SessionConnection | None = None
        self._last_position: JointVector = readonly_copy(model.home)  # Position of the arm while no robot reports one.
        self.store: StateStore[AppState] = StateStore(AppState(model=model, goal=goal_at(model, self._last_position)))
        self.goals = GoalActions(self.store, _Arm(self), plans_at_once=False)
        self._handlers: Handlers = {**self.goals.handlers, PlanGoal: lambda _: self.make_plan()}
        self.moment: float | None = None
        """The displayed time of the plan, [s]; None shows the arm's position."""
        self.displayed: DisplayedMotion | None = None
        """A fault, or the run of a cell, displayed in place of the plan until the next plan, goal or execution."""
        self.outcome: Outcome | None = None
        """The end of the last execution, of the plan or of a cell; None: none yet, or one is in progress."""
        self._cached_executed_plan: Plan | None = (
            None  # The plan as it was run, if its speed override was changed during the run.
        )
        self._subscribers: dict[Topic, list[Callable[[], None]]] = {}

    def subscribe(self, topic: Topic, act: Callable[[], None]) -> Callable[[], None]:
        """Calls `act` after every change of a topic; returns a function that ends the subscription."""
        with self.lock:
            self._subscribers.setdefault(topic, []).append(act)

        def end() -> None:
            with self.lock:
                if act in self._subscribers[topic]:
                    self._subscribers[topic].remove(act)

        return end

    def notify(self, *topics: Topic) -> None:
        """Calls the subscribers of topics."""
        with self.lock:
            for topic in topics:
                for act in list(self._subscribers.get(topic, ())):
                    act()

    @property
    def now(self) -> AppState:
        """The current values; with a session, tool, load, soft limits and cell are its current ones."""
        session, state = self.session, self.store.state
        if session is not None and (session.model is not state.model or session.cell is not state.session_cell):
            self.store.update(model=session.model, session_cell=session.cell)
        return self.store.state

    @property
    def model(self) -> RobotModel:
        """The arm."""
        return self.now.model

    def ask(self, request: Request) -> None:
        """Carries out a request of the application immediately; all parts that show its result follow."""
        with self.lock:
            goal = self.now.goal
            self._handlers[type(request)](request)
            if self.now.goal is not goal:
                self._end_preview()
                self.notify("goal")

    def set_drive(self, **changes: Any) -> None:
        """Changes settings of the execution: fields of `DriveState`."""
        with self.lock:
            self.store.update(drive=replace(self.now.drive, **changes))

    @property
    def status(self) -> SupervisorStatus | None:
        """The status of the robot; None without a connection."""
        return None if self.robot is None else self.robot.status()

    @property
    def here(self) -> JointVector:
        """Start of plans: the robot's commanded angles, or without a robot the arm's last position, [rad]."""
        status = self.status
        return self._last_position if status is None or status.q_c is None else readonly_copy(status.q_c)

    @property
    def shown_plan(self) -> Plan | None:
        """The plan of timeline and curves: as it was run, or what is displayed in its place."""
        return self._executed_plan if self.displayed is None else self.displayed.plan

    @property
    def shown_scene_plan(self) -> Plan | None:
        """The plan whose position at the displayed time the scene shows."""
        return self._executed_plan if self.displayed is None else self.displayed.scene

    @property
    def shown_run(self) -> Run | None:
        """The run that belongs to the displayed plan."""
        if self.displayed is not None:
            return self.displayed.run
        recording = self.now.recording
        return None if recording is None else recording.run

    @property
    def _executed_plan(self) -> Plan | None:
        """The plan; as it was run, if its speed override was changed during the run."""
        plan, run = self.now.plan, self.shown_run
        if plan is None or run is None or run.plan is None or not run.has_speed_override:
            return plan
        if self._cached_executed_plan is None or self._cached_executed_plan.motion is not run.plan:
            self._cached_executed_plan = build_plan_view(self.model, run.plan, plan.report, plan.box)
        return self._cached_executed_plan

    def pose(self, q: ArrayLike) -> None:
        """Sets the goal to joint angles, shape (n,), [rad]; the plan is kept until the next one.

        Raises:
            InvalidValueError: An angle is outside its limits.
        """
        angles = as_vector(q, self.model.n, "q", "rad")
        limits = self.model.limits.joint
        for joint, (angle, low, high) in enumerate(zip(angles, limits.lower, limits.upper, strict=True), start=1):
            if not low <= angle <= high:
                raise InvalidValueError(
                    f"q of joint {joint}", float(angle), f"must be from {low:.4f} to {high:.4f} rad"
                )
        with self.lock:
            self.store.push_undo()
            self.goals.set_joints(readonly_copy(angles))
            self._end_preview()
            self.notify("goal")

    def aim(self, target: Pose) -> None:
        """Sets the goal to a pose of the tool in base: the nearest branch, or the nearest reachable pose."""
        with self.lock:
            self.store.push_undo()
            self.goals.set_target(target)
            self._end_preview()
            self.notify("goal")

    def make_plan(self) -> None:
        """Plans from the arm's position to the goal and checks the plan, with collisions."""
        self.show(self.planning()(lambda part: None))

    def planning(self) -> Callable[[ProgressCallback], Plan | Message]:
        """Returns a function that plans from the arm's position to the present goal, and checks, with collisions.

        The function takes long: do not call it in a thread that others wait for.
        """
        with self.lock:
            now = self.now
            make, mode, cell = self.goals.prepare_plan(self.here), now.drive.mode, now.cell_for(now.model)

        def run(progress: ProgressCallback) -> Plan | Message:
            made = make(progress)
            progress(_PLANNED)
            return made.completed(mode, cell) if isinstance(made, Plan) else made

        return run

    def take_motion(self, motion: Motion) -> None:
        """Takes a motion that was planned elsewhere; it is checked like any other."""
        require_motion(motion)
        now = self.now
        mode, cell = now.drive.mode, now.cell_for(now.model)
        report = check(motion, now.model, cell=cell, mode=mode)
        self.show(replace(build_plan_view(now.model, motion, report), cell=cell, mode=mode, complete=True))

    def follow(self, mode: Mode) -> None:
        """Chooses the command mode; the plan is checked by the conditions of that mode.

        Args:
            mode: One of `rcilab.core.state.MODES`.
        """
        with self.lock:
            choose_mode(self.store, require_mode(mode))
            self.notify("plan")

    def show(self, made: Plan | Message) -> None:
        """Shows a plan, or why planning failed."""
        with self.lock:
            self.goals.show(made)
            self.moment, self.displayed = None, None
            self.notify("plan", "moment")

    def limit_joints(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Takes the controller's soft limits: workspace, plans and checks use them; the plan is checked again.

        Args:
            lower: Shape (n,), [rad].
            upper: Above `lower`, shape (n,), [rad].
        """
        with self.lock:
            if self.session is None:  # A session has them already.
                self.store.update(model=self.model.with_joint_limits(lower, upper))
            goal = self.now.goal
            self.store.update(goal=replace(goal, reach=evaluate_joints(self.model, goal.q)))
            self.notify("goal")
            if self.now.plan is not None:
                self.take_motion(self.now.plan.motion)

    def free_joints(self) -> None:
        """Restores the arm's own joint limits, without the soft limits of a disconnected controller."""
        own, now = self._own_limits, self.model.limits.joint
        if now is not own:
            self.limit_joints(own.lower, own.upper)

    def take(self, outcome: Outcome) -> None:
        """Shows the end of an execution: with the plan, or for a cell, in place of the plan."""
        with self.lock:
            run = outcome.run
            if outcome.what == "cell":
                self.display(None if run is None else display_run(run, self.model))
            elif run is not None and run.has_speed_override:  # The times of the plan have changed.
                self.moment = None
                self.notify("plan", "moment")
            self.outcome = outcome  # Last: another thread that reads it finds the rest in place.
            self.notify("run")

    def halt(self) -> None:
        """Stops the robot; from any thread, without waiting."""
        robot = self.robot
        if robot is not None:
            robot.stop()

    def look_at(self, moment: float | None) -> None:
        """Displays a time of the plan, [s]; None displays the arm's position."""
        with self.lock:
            if self.shown_plan is None:
                moment = None
            elif moment is not None:
                moment = min(max(moment, 0.0), self.shown_plan.motion.duration)
            if moment != self.moment:
                self.moment = moment
                self.notify("moment")

    def display(self, displayed: DisplayedMotion | None) -> None:
        """Displays a fault, or the run of a cell, in place of the plan; None displays the plan again."""
        with self.lock:
            if displayed is None and self.displayed is None:
                return
            self.displayed = displayed
            self.moment = None if displayed is None else displayed.moment
            self.notify("plan", "moment")

    def store_position(self, q: ArrayLike) -> None:
        """Takes the robot's position at its disconnection; the plan is kept."""
        with self.lock:
            self._last_position = readonly_copy(as_vector(q, self.model.n, "q", "rad"))

    @property
    def is_goal_of_plan(self) -> bool:
        """Whether the plan leads to the goal."""
        plan, goal = self.now.plan, self.now.goal
        return plan is not None and bool(abs(plan.motion.goal - goal.q).max() < 1e-6)

    def _end_preview(self) -> None:
        self.display(None)
        if self.moment is not None:
            self.moment = None
            self.notify("moment")


@dataclass(frozen=True, slots=True)
class _StationaryArm:
    q_c: JointVector
    phase: str = "closed"


class _Arm:
    """The position of the arm of a lab, also without a robot."""

    def __init__(self, state: LabState) -> None:
        self._state = weakref.ref(state)

    def status(self) -> ArmStatus:
        """Returns the robot's status; without a robot, the last position."""
        state = self._state()
        assert state is not None
        status = state.status
        return status if status is not None and status.q_c is not None else _StationaryArm(state.here)


_of_session: weakref.WeakValueDictionary[int, LabState] = weakref.WeakValueDictionary()
"""By the id of a session, which the state keeps alive as long as itself."""


def state_of(subject: object) -> LabState:
    """Returns the state of a subject.

    Args:
        subject: A model, a session (all its parts share a state), another part, or a state.

    Raises:
        InvalidValueError: It has another type.
    """
    if isinstance(subject, LabState):
        return subject
    if _is_session(subject):
        shared = _of_session.get(id(subject))
        if shared is None:
            shared = _of_session[id(subject)] = LabState(subject.model, subject)
        return shared
    shared = getattr(subject, "state", None)
    return shared if isinstance(shared, LabState) else LabState(require_model(subject))


def _is_session(subject: object) -> TypeGuard[RobotSession]:
    """Returns whether it is a session, without loading the module of sessions: before that, no session exists."""
    module = sys.modules.get("rcilab.execution.session")
    return module is not None and isinstance(subject, module.RobotSession)
