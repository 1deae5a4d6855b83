"""What the parts of a notebook's lab share: the application's state and commands, the robot, the moment shown.

A part is given a model, a session or another part; parts of the same state move together. Goal, plan and settings are
the values of `rcilab.app`, changed by its requests as the page changes them.
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
from rcilab.app.exhibition import exhibit_run
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import GoalActions, PlanGoal
from rcilab.app.goal.target_status import evaluate_joints
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
    from rcilab.app.exhibition import Exhibition
    from rcilab.app.robot_connection import RobotConnection
    from rcilab.app.run.robot_requests import Outcome
    from rcilab.app.session_connection import SessionConnection
    from rcilab.control_process import SupervisorStatus
    from rcilab.execution.session import RobotSession
    from rcilab.motion.motion import Motion
    from rcilab.recording.run import Run

Topic = Literal["goal", "plan", "moment", "robot", "run"]
"""goal: where the arm is wanted; plan: a motion and its report; moment: what time of it is looked at; robot: its
status; run: what came of an execution."""
Way = Literal["joint", "line"]
WAYS: tuple[Way, ...] = ("joint", "line")
_PLANNED = 0.5  # Part of the work when a plan is checked, too; as measured.


class LabState:
    """One arm and what is wanted of it. Safe to use from any thread: one change at a time, each heard by everybody.

    Args:
        model: The arm.
        session: A session to execute in; None leaves it to `RunPanel` to connect.
    """

    def __init__(self, model: RobotModel, session: RobotSession | None = None) -> None:
        require_model(model)
        self._own_limits = model.limits.joint  # Without soft limits set here.
        self.session = session
        self.lock = threading.RLock()
        self.robot: RobotConnection | SessionConnection | None = None
        self._rest: JointVector = readonly_copy(model.home)  # Where the arm is as long as no robot reports it.
        self.store: StateStore[AppState] = StateStore(AppState(model=model, goal=goal_at(model, self._rest)))
        self.goals = GoalActions(self.store, _Arm(self), plans_at_once=False)
        self._handlers: Handlers = {**self.goals.handlers, PlanGoal: lambda _: self.make_plan()}
        self.moment: float | None = None
        """Time of the plan that is looked at, [s]; None looks at the arm as it is."""
        self.exhibition: Exhibition | None = None
        """A fault, or what a cell did, looked at in place of the plan until the next plan, pose or execution."""
        self.outcome: Outcome | None = None
        """How the last execution ended, of the plan or of a cell; None: none yet, or one is in progress."""
        self._as_run: Plan | None = None  # The plan as it was run, where its speed override was changed on the way.
        self._hearers: dict[Topic, list[Callable[[], None]]] = {}

    def hear(self, topic: Topic, act: Callable[[], None]) -> Callable[[], None]:
        """Calls `act` at every change of a topic; returns what ends that."""
        with self.lock:
            self._hearers.setdefault(topic, []).append(act)

        def end() -> None:
            with self.lock:
                if act in self._hearers[topic]:
                    self._hearers[topic].remove(act)

        return end

    def tell(self, *topics: Topic) -> None:
        """Calls the listeners of what has changed."""
        with self.lock:
            for topic in topics:
                for act in list(self._hearers.get(topic, ())):
                    act()

    @property
    def now(self) -> AppState:
        """The values of this moment; of a session with the tool, the load and the soft limits that it has set since."""
        if self.session is not None and self.session.model is not self.store.state.model:
            self.store.update(model=self.session.model)
        return self.store.state

    @property
    def model(self) -> RobotModel:
        """The arm."""
        return self.now.model

    def ask(self, request: Request) -> None:
        """Carries out a request of a feature at once; every part that shows what it changes follows."""
        with self.lock:
            goal = self.now.goal
            self._handlers[type(request)](request)
            if self.now.goal is not goal:
                self._leave_preview()
                self.tell("goal")

    def set_drive(self, **changes: Any) -> None:
        """Changes how motions are executed: fields of `DriveState`."""
        with self.lock:
            self.store.update(drive=replace(self.now.drive, **changes))

    @property
    def status(self) -> SupervisorStatus | None:
        """The status of the robot; None while none is connected."""
        return None if self.robot is None else self.robot.status()

    @property
    def here(self) -> JointVector:
        """Where a plan begins: at the robot's commanded angles, without a robot where the arm was left, [rad]."""
        status = self.status
        return self._rest if status is None or status.q_c is None else readonly_copy(status.q_c)

    @property
    def seen(self) -> Plan | None:
        """What timeline and curves show: the plan, as it was run if it was, or what is on show in its place."""
        return self._played if self.exhibition is None else self.exhibition.plan

    @property
    def seen_arm(self) -> Plan | None:
        """Where the scene shows the arm at a moment."""
        return self._played if self.exhibition is None else self.exhibition.scene

    @property
    def seen_run(self) -> Run | None:
        """What happened beside what is seen."""
        if self.exhibition is not None:
            return self.exhibition.run
        recording = self.now.recording
        return None if recording is None else recording.run

    @property
    def _played(self) -> Plan | None:
        """The plan; as it was run, where its speed override was changed on the way."""
        plan, run = self.now.plan, self.seen_run
        if plan is None or run is None or run.plan is None or not run.has_speed_override:
            return plan
        if self._as_run is None or self._as_run.motion is not run.plan:
            self._as_run = build_plan_view(self.model, run.plan, plan.report, plan.box)
        return self._as_run

    def pose(self, q: ArrayLike) -> None:
        """Sets the goal to joint angles, shape (n,), [rad]; the plan stays until it is planned again.

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
            self.store.remember()
            self.goals.pose(readonly_copy(angles))
            self._leave_preview()
            self.tell("goal")

    def aim(self, target: Pose) -> None:
        """Sets the goal to a pose of the tool in base: the nearest branch, or the reachable pose nearest to it."""
        with self.lock:
            self.store.remember()
            self.goals.aim(target)
            self._leave_preview()
            self.tell("goal")

    def make_plan(self) -> None:
        """Plans from where the arm stands to the goal and checks it, collisions too."""
        self.show(self.planning()(lambda part: None))

    def planning(self) -> Callable[[ProgressCallback], Plan | Message]:
        """Returns what plans from where the arm stands now to the present goal, and checks it, collisions too.

        It takes long, so it is not for a thread that others wait for.
        """
        with self.lock:
            make, mode = self.goals.prepare_plan(self.here), self.now.drive.mode

        def run(progress: ProgressCallback) -> Plan | Message:
            made = make()
            progress(_PLANNED)
            return made.completed(mode) if isinstance(made, Plan) else made

        return run

    def take_motion(self, motion: Motion) -> None:
        """Takes a motion that was planned elsewhere; it is checked as any other."""
        require_motion(motion)
        mode = self.now.drive.mode
        report = check(motion, self.model, mode=mode)
        self.show(replace(build_plan_view(self.model, motion, report), mode=mode, complete=True))

    def follow(self, mode: Mode) -> None:
        """Chooses how motions are commanded; the plan is checked by the conditions of that mode.

        Args:
            mode: One of `rcilab.core.state.MODES`.
        """
        with self.lock:
            choose_mode(self.store, require_mode(mode))
            self.tell("plan")

    def show(self, made: Plan | Message) -> None:
        """Shows a plan, or why none was found."""
        with self.lock:
            self.goals.show(made)
            self.moment, self.exhibition = None, None
            self.tell("plan", "moment")

    def limit_joints(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Takes soft limits that the controller has: reach, plans and checks keep inside; the plan is checked anew.

        Args:
            lower: Shape (n,), [rad].
            upper: Above `lower`, shape (n,), [rad].
        """
        with self.lock:
            if self.session is None:  # A session has them already.
                self.store.update(model=self.model.with_joint_limits(lower, upper))
            goal = self.now.goal
            self.store.update(goal=replace(goal, reach=evaluate_joints(self.model, goal.q)))
            self.tell("goal")
            if self.now.plan is not None:
                self.take_motion(self.now.plan.motion)

    def free_joints(self) -> None:
        """Restores the arm's range from before the soft limits of a controller that is gone."""
        own, now = self._own_limits, self.model.limits.joint
        if now is not own:
            self.limit_joints(own.lower, own.upper)

    def take(self, outcome: Outcome) -> None:
        """Shows how an execution ended: that of the plan beside it, that of a cell in its place."""
        with self.lock:
            run = outcome.run
            if outcome.what == "cell":
                self.exhibit(None if run is None else exhibit_run(run, self.model))
            elif run is not None and run.has_speed_override:  # The times of the plan are others now.
                self.moment = None
                self.tell("plan", "moment")
            self.outcome = outcome  # Last: other threads that see it find what it is about in place.
            self.tell("run")

    def halt(self) -> None:
        """Brings the robot to rest; from any thread, without waiting."""
        robot = self.robot
        if robot is not None:
            robot.stop()

    def look_at(self, moment: float | None) -> None:
        """Looks at a time of what is seen, [s]; None looks at the arm as it is."""
        with self.lock:
            if self.seen is None:
                moment = None
            elif moment is not None:
                moment = min(max(moment, 0.0), self.seen.motion.duration)
            if moment != self.moment:
                self.moment = moment
                self.tell("moment")

    def exhibit(self, exhibition: Exhibition | None) -> None:
        """Looks at a fault, or at what a cell did, in place of the plan; None looks at the plan again."""
        with self.lock:
            if exhibition is None and self.exhibition is None:
                return
            self.exhibition = exhibition
            self.moment = None if exhibition is None else exhibition.moment
            self.tell("plan", "moment")

    def leave_arm(self, q: ArrayLike) -> None:
        """Says where the robot stood when it was disconnected; what is planned stays."""
        with self.lock:
            self._rest = readonly_copy(as_vector(q, self.model.n, "q", "rad"))

    @property
    def is_goal_of_plan(self) -> bool:
        """Whether the plan still leads to the goal."""
        plan, goal = self.now.plan, self.now.goal
        return plan is not None and bool(abs(plan.motion.goal - goal.q).max() < 1e-6)

    def _leave_preview(self) -> None:
        self.exhibit(None)
        if self.moment is not None:
            self.moment = None
            self.tell("moment")


@dataclass(frozen=True, slots=True)
class _Standing:
    q_c: JointVector
    phase: str = "closed"


class _Arm:
    """Where the arm of a lab is, also without a robot."""

    def __init__(self, state: LabState) -> None:
        self._state = weakref.ref(state)

    def status(self) -> ArmStatus:
        """Returns the robot's status; without one the arm is where it was left."""
        state = self._state()
        assert state is not None
        status = state.status
        return status if status is not None and status.q_c is not None else _Standing(state.here)


_of_session: weakref.WeakValueDictionary[int, LabState] = weakref.WeakValueDictionary()
"""By the id of a session, which a state keeps alive for as long as it lives itself."""


def state_of(subject: object) -> LabState:
    """Returns what a part looks at.

    Args:
        subject: A model, a session (all parts of one session share its state), another part, or a state.

    Raises:
        InvalidValueError: It is not one of them.
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
    """Returns whether it is a session, without loading its module: where that is not loaded, there is no session."""
    module = sys.modules.get("rcilab.execution.session")
    return module is not None and isinstance(subject, module.RobotSession)
