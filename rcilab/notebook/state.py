"""What the parts of a notebook's lab share: the arm, the goal, the plan, the moment that is looked at, the robot.

A part is given a model, a session or another part; parts of the same state move together. Everything is computed by
the library's own calls; here is only who hears of it.
"""

from __future__ import annotations

import sys
import threading
import weakref
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, TypeGuard

from numpy.typing import ArrayLike

from rcilab.arrays import JointVector, as_vector, frozen
from rcilab.background import Tell
from rcilab.errors import InvalidValueError, KinematicsError, RcilabError
from rcilab.model import RobotModel, require_model
from rcilab.posing.planning import Plan, PlannableLaw, make_plan, picture
from rcilab.posing.reach import Reach, judge_joints, judge_pose
from rcilab.spatial import Pose
from rcilab.state import Mode, require_mode
from rcilab.words.errors import tell
from rcilab.words.text import Message, message

if TYPE_CHECKING:
    from rcilab.client.control_settings import ControlSettings
    from rcilab.client.session import RobotSession
    from rcilab.gallery.exhibition import Exhibition
    from rcilab.motion.motion import Motion
    from rcilab.notebook.cell_run import CellRun
    from rcilab.notebook.robot_side import RobotSide
    from rcilab.recording.run import Run
    from rcilab.supervisor import SupervisorStatus

Topic = Literal["goal", "plan", "moment", "robot", "run"]
"""goal: where the arm is wanted; plan: a motion and its judgement; moment: what time of it is looked at; robot: its
status; run: what came of an execution."""
Way = Literal["joint", "line"]
WAYS: tuple[Way, ...] = ("joint", "line")
_PLANNED = 0.5  # Part of the work when a plan is to be judged; about what was seen.


class LabState:
    """One arm and what is wanted of it. Safe to use from any thread: one change at a time, each heard by everybody.

    Args:
        model: The arm.
        session: A session to execute in; None leaves it to `RunPanel` to connect.
    """

    def __init__(self, model: RobotModel, session: RobotSession | None = None) -> None:
        self._model = require_model(model)
        self._own_limits = self._model.limits.joint  # Without what a controller was told here.
        self.session = session
        self.lock = threading.RLock()
        self.robot: RobotSide | None = None
        self.goal: JointVector = frozen(model.home)
        self.target: Pose = model.forward(self.goal)
        self.reach: Reach = judge_joints(model, self.goal)
        self.plan: Plan | None = None
        self.no_plan: Message | None = None
        self.moment: float | None = None
        """Time of the plan that is looked at, [s]; None looks at the arm as it is."""
        self.exhibition: Exhibition | CellRun | None = None
        """A fault, or what a cell did, looked at in place of the plan until somebody plans, poses or executes."""
        self.run: Run | None = None
        """What came of the last execution."""
        self.is_run_of_plan = True
        """Whether it was one of the plan; a cell may have run something else."""
        self._ran: Plan | None = None  # The plan as it was run, where its pace was changed on the way.
        self.error: RcilabError | None = None
        """Why the last execution did not reach its end; None when it did."""
        self.speed = 0.5
        self.pace = 1.0
        """Part of its planned speed that a motion runs at."""
        self.law: PlannableLaw = "torque_rate_limited"
        self.way: Way = "joint"
        self.mode: Mode = "joint_position"
        """How a motion is commanded; its conditions judge the plan."""
        self.control: ControlSettings | None = None
        """Parameters of the modes as somebody wants them; None: nobody has touched them."""
        self.refusal: Message | None = None
        """Why the controller did not take them."""
        self._rest: JointVector = self.goal  # Where the arm stands as long as no robot says otherwise.
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
        """Tells everybody that something has changed."""
        with self.lock:
            for topic in topics:
                for act in list(self._hearers.get(topic, ())):
                    act()

    @property
    def status(self) -> SupervisorStatus | None:
        """How the robot stands; None while none is connected."""
        return None if self.robot is None else self.robot.status()

    @property
    def here(self) -> JointVector:
        """Where a plan begins: at the robot's commanded angles, without a robot where the arm was left, [rad]."""
        status = self.status
        return self._rest if status is None or status.q_c is None else frozen(status.q_c)

    @property
    def model(self) -> RobotModel:
        """The arm; of a session with the tool, the load and the soft limits that it has set since."""
        return self._model if self.session is None else self.session.model

    @property
    def seen(self) -> Plan | None:
        """What timeline and curves show: the plan, as it was run if it was, or what is on show in its place."""
        return self._ran or self.plan if self.exhibition is None else self.exhibition.plan

    @property
    def seen_arm(self) -> Plan | None:
        """Where the scene shows the arm at a moment."""
        return self._ran or self.plan if self.exhibition is None else self.exhibition.scene

    @property
    def seen_run(self) -> Run | None:
        """What happened beside what is seen."""
        if self.exhibition is not None:
            return self.exhibition.run
        return self.run if self.is_run_of_plan else None

    def start_from(self, q: ArrayLike) -> None:
        """Says where the arm stands while no robot is connected, shape (n,), [rad]."""
        with self.lock:
            self._rest = frozen(as_vector(q, self.model.n, "q", "rad"))
            self.plan, self.no_plan, self.moment, self.exhibition, self._ran = None, None, None, None, None
            self.tell("plan", "moment", "goal")

    def pose(self, q: ArrayLike) -> None:
        """Wants the arm at joint angles, shape (n,), [rad]; the plan stays until somebody plans anew."""
        angles = as_vector(q, self.model.n, "q", "rad")
        limits = self.model.limits.joint
        for joint, (angle, low, high) in enumerate(zip(angles, limits.lower, limits.upper, strict=True), start=1):
            if not low <= angle <= high:
                raise InvalidValueError(
                    f"q of joint {joint}", float(angle), f"must be from {low:.4f} to {high:.4f} rad"
                )
        with self.lock:
            self.goal = frozen(angles)
            self.target = self.model.forward(self.goal)
            self.reach = judge_joints(self.model, self.goal)
            self._look_away()
            self.tell("goal")

    def aim(self, target: Pose, *, psi: float | None = None, near: ArrayLike | None = None) -> None:
        """Wants the tool at a pose; the arm takes the nearest branch, or comes as near as it can.

        Args:
            target: Pose of the tool in base.
            psi: Arm angle to take, [rad]; None keeps the present one.
            near: Joint angles that choose the branch, shape (n,), [rad]; the present goal when absent.
        """
        around = self.goal if near is None else as_vector(near, self.model.n, "near", "rad")
        with self.lock:
            self.reach = judge_pose(self.model, target, around, psi)
            self.goal, self.target = self.reach.q, target
            self._look_away()
            self.tell("goal")

    @property
    def arm_angle(self) -> float | None:
        """Arm angle of the goal, [rad]; None where there is none."""
        if self.model.n != 7:
            return None
        try:
            return self.model.arm_angle(self.goal)
        except KinematicsError:
            return None

    def make_plan(self) -> None:
        """Plans from where the arm stands to the goal and judges it, collisions too."""
        self.show(self.planning()(lambda part: None))

    def planning(self) -> Callable[[Tell], Plan | Message]:
        """Returns what plans from where the arm stands now to the goal of now, and judges it, collisions too.

        It takes its time, so it is not for a thread that somebody waits for.
        """
        with self.lock:
            make = self._line() if self.way == "line" else self._joint()
            mode = self.mode

        def run(progress: Tell) -> Plan | Message:
            made = make()
            progress(_PLANNED)
            return made.completed(mode) if isinstance(made, Plan) else made

        return run

    def take_motion(self, motion: Motion) -> None:
        """Takes a motion that was planned elsewhere; it is judged as any other."""
        from rcilab.conformance.check import check
        from rcilab.motion.motion import require_motion

        require_motion(motion)
        report = check(motion, self.model, mode=self.mode)
        self.show(replace(picture(self.model, motion, report), mode=self.mode, complete=True))

    def follow(self, mode: Mode) -> None:
        """Chooses how motions are commanded; the plan is judged by the conditions of that mode.

        Args:
            mode: One of `rcilab.state.MODES`.
        """
        with self.lock:
            self.mode = require_mode(mode)
            if self.plan is not None:
                self.plan = self.plan.completed(mode)
            self.tell("plan")

    def show(self, made: Plan | Message) -> None:
        """Shows a plan, or why there is none."""
        with self.lock:
            self.plan, self.no_plan = (made, None) if isinstance(made, Plan) else (None, made)
            self.run, self.moment, self.exhibition, self._ran = None, None, None, None
            self.tell("plan", "moment")

    def limit_joints(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Takes soft limits that the controller has: reach, plans and checks keep inside; the plan is checked anew.

        Args:
            lower: Shape (n,), [rad].
            upper: Above `lower`, shape (n,), [rad].
        """
        with self.lock:
            if self.session is None:  # A session has them already.
                self._model = self._model.with_joint_limits(lower, upper)
            self.reach = judge_joints(self.model, self.goal)
            self.tell("goal")
            if self.plan is not None:
                self.take_motion(self.plan.motion)

    def free_joints(self) -> None:
        """Takes the arm's range back that it had before a controller that is gone was told soft limits."""
        own, now = self._own_limits, self._model.limits.joint
        if now is not own:
            self.limit_joints(own.lower, own.upper)

    def take_run(self, run: Run | None, error: RcilabError | None = None) -> None:
        """Shows what came of an execution beside its plan: the run, and why it did not reach its end."""
        with self.lock:
            self.run, self.error, self.is_run_of_plan, before = run, error, True, self._ran
            self._ran = None
            if run is not None and run.paced and run.plan is not None and self.plan is not None:
                self._ran = picture(self.model, run.plan, self.plan.report, self.plan.box)
            if self._ran is not before:  # Its times are others now.
                self.moment = None
                self.tell("plan", "moment")
            self.tell("run")

    def take_cell_run(self, run: Run, error: RcilabError | None = None) -> None:
        """Shows what a cell did in place of the plan, which stays."""
        from rcilab.notebook.cell_run import cell_run_of

        seen = cell_run_of(run, self.model)
        with self.lock:
            self.run, self.error, self.is_run_of_plan, self._ran = run, error, False, None
            self.exhibit(seen)
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

    def exhibit(self, exhibition: Exhibition | CellRun | None) -> None:
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
            self._rest = frozen(as_vector(q, self.model.n, "q", "rad"))

    @property
    def is_goal_of_plan(self) -> bool:
        """Whether the plan still leads to the goal: nobody has moved it since."""
        return self.plan is not None and bool(abs(self.plan.motion.goal - self.goal).max() < 1e-6)

    def _look_away(self) -> None:
        self.exhibit(None)
        if self.moment is not None:
            self.moment = None
            self.tell("moment")

    def _joint(self) -> Callable[[], Plan | Message]:
        start, goal, speed, law, short = self.here, self.goal, self.speed, self.law, self.reach.short

        def make() -> Plan | Message:
            made = make_plan(self.model, start, goal, speed, law)
            return replace(made, short=short) if isinstance(made, Plan) else made

        return make

    def _line(self) -> Callable[[], Plan | Message]:
        start, goal, speed = self.here, self.goal, self.speed

        def make() -> Plan | Message:
            from rcilab.conformance.check import check
            from rcilab.motion.cartesian import plan_line

            try:
                motion = plan_line(self.model, start, self.model.forward(goal), speed=speed)
                return picture(self.model, motion, check(motion, self.model, start=start, distance=None))
            except RcilabError as error:
                return message("plan.failed", error=tell(error))

        return make


_of_session: weakref.WeakValueDictionary[int, LabState] = weakref.WeakValueDictionary()
"""By the id of a session, which a state keeps alive for as long as it lives itself."""


def state_of(subject: object) -> LabState:
    """Returns what a part looks at.

    Args:
        subject: A model, a session (all parts of one session share its state), another part, or a state.

    Raises:
        InvalidValueError: It is none of them.
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
    """Returns whether it is a session, without loading what one is made of: then nobody can have made it."""
    module = sys.modules.get("rcilab.client.session")
    return module is not None and isinstance(subject, module.RobotSession)
