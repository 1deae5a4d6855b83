"""What moves the arm: prepared motions, callbacks, and the manual's blocking moves."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Literal, TypeAlias

from numpy.typing import ArrayLike

from rcilab.core.arrays import described
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.limits import Limits
from rcilab.core.spatial import Pose
from rcilab.core.state import Mode, RobotState, require_mode
from rcilab.execution.control_loop import Callback
from rcilab.execution.filters import CommandFilter, LowPass, RateLimiter
from rcilab.execution.motion_callback import Progress, follow, follow_poses, report_progress
from rcilab.execution.motion_progress import MotionProgress
from rcilab.execution.motion_runner import MotionRunner
from rcilab.execution.session_lock import SessionLock
from rcilab.execution.speed_scaled_stream import SpeedScaledStream
from rcilab.execution.start_pose_check import describe_start_mismatch, require_motion
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.makers.rokae.driver.connection import RciConnection
from rcilab.motion.speed_scaling import require_pace
from rcilab.recording.run import Run

if TYPE_CHECKING:
    from rcilab.conformance.certificate import Certificate
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion
    from rcilab.motion.path import Path

RateLimit: TypeAlias = Literal["manual", "sdk"]


class Motions(RciCommands):
    """The motions of a session; see `RobotSession`.

    Args:
        link: The connection.
        limits: Bounds of the arm.
        turns: Whose turn it is on the connection.
        runner: Runs motions on it.
    """

    def __init__(self, link: RciConnection, limits: Limits, turns: SessionLock, runner: MotionRunner) -> None:
        super().__init__(link, limits)
        self._turns = turns
        self._runner = runner
        self._streamed: SpeedScaledStream | None = None
        """What `execute` streams just now."""

    def execute(
        self,
        motion: Motion,
        certificate: Certificate | None = None,
        progress: Progress | None = None,
        *,
        mode: Mode = "joint_position",
        pace: float = 1.0,
    ) -> Run:
        """Streams a motion and returns what became of it. Checks it first, by the conditions of the mode.

        From another thread, `pause`, `resume` and `set_pace` change how fast it runs, and `under_way` tells how far it
        is. In torque mode the arm follows softly, see `rcilab.execution.command_builder`.

        Args:
            motion: The motion; it must begin at the commanded angles of the arm, `state.q_c`.
            certificate: From an earlier `check(motion, model, mode=mode)`; then only its freshness is verified.
            progress: Told how far it is, about 20 times a second.
            mode: How the arm is commanded: the same way as joint angles, as poses of the tool, or as torques.
            pace: Part of its planned speed that it runs at from the beginning, 0.1 to 1; `set_pace` changes it later.

        Raises:
            InvalidValueError: The pace is out of range; nothing moved.
            PlanningError: At this pace it would break a condition that it keeps as planned; nothing moved.
            ConformanceError: The motion breaks a condition; nothing moved.
            CertificateError: The certificate is for something else; nothing moved.
            UsageError: The motion starts elsewhere than the arm is; nothing moved.
            ControlError: The controller stopped it; `.faults` and `.record` say why. `recover()` leads on.
            ConnectionLostError: The controller is gone.
        """
        from rcilab.conformance.speed_scaling_check import plan_start

        require_motion(motion, certificate)
        require_mode(mode)
        require_pace(pace)
        with self._turns.set_out("execute"):
            state = self.receive_state()
            mismatch = describe_start_mismatch(motion.q[0], state.q_c)
            if mismatch is not None:
                raise UsageError(mismatch)
            if certificate is None:
                self._require_allowed(motion, state, mode)
            else:
                certificate.verify(motion, self.model, state.q_c, self.safety_box, mode=mode)
            paced = plan_start(motion, pace, self.model, mode)
            streamed = SpeedScaledStream(paced, mode, self.model, report_progress(paced.as_motion(), progress))
            self._streamed = streamed
            try:
                filters = [RateLimiter(self.model.limits)] if mode == "torque" else []
                return self._runner.run(streamed.stream, mode, self.model, streamed, filters, box=self.safety_box)
            finally:
                self._streamed = None

    @property
    def under_way(self) -> MotionProgress | None:
        """Place and pace of the motion that `execute` runs in another thread; None while it runs none."""
        streamed = self._streamed
        return None if streamed is None else streamed.under_way

    def pause(self) -> None:
        """Holds the motion that `execute` runs in another thread, along its way and within all limits.

        Raises:
            UsageError: No such motion runs.
            PlanningError: It arrives before it could be held.
        """
        self._change_pace(0.0)

    def resume(self, pace: float = 1.0) -> None:
        """Goes on with a motion that is held; see `set_pace`."""
        self.set_pace(pace)

    def set_pace(self, pace: float) -> None:
        """Runs the motion of `execute`, in another thread, at part of its planned speed, judged as the motion was.

        Args:
            pace: 0.1 to 1.

        Raises:
            InvalidValueError: The pace is out of range.
            UsageError: No such motion runs.
            PlanningError: There is no way within the limits to change from here; the motion goes on as it is.
        """
        self._change_pace(require_pace(pace))

    def _change_pace(self, pace: float) -> None:
        streamed = self._streamed
        if streamed is None:
            raise UsageError("no motion of execute() runs whose pace could change").coded("no_pace")
        streamed.change_pace(pace)

    def control(
        self,
        callback: Callback,
        mode: Mode = "joint_position",
        *,
        cut_off: float | None = None,
        rate_limit: RateLimit | None = None,
    ) -> Run:
        """Runs a callback in every controller cycle until it returns a command with `finished=True`.

        The first command must be where the arm is, `JointPosition(state.q_c)` or
        `CartesianPosition(state.T_base_tool_c)`; torques begin within one cycle's rate of zero. t counts controller
        cycles since the first call, in seconds, so a lost packet does not stretch time. With a filter or a limiter the
        motion ends when what is sent has arrived at the last command.

        A tool that starts outside its safety box may only be led into it, as with `execute`: the controller stops a
        motion that goes farther out, or past a face that it did not start beyond.

        Args:
            callback: `(state, t) -> JointPosition | CartesianPosition | JointTorque`, as the mode asks for.
            mode: How the controller shall follow.
            cut_off: Cut-off frequency of a low-pass filter of the commands, [Hz]; the vendor's client has one at 100.
                None sends them as they are.
            rate_limit: Keeps the commands inside the limits of velocity, acceleration, jerk or torque rate: those of
                the manual, or "sdk", the Cartesian ones of the vendor's limiter. Poses keep the tool's limits, which
                need not be enough for the joints. None leaves all of it to the callback.

        Raises:
            ControlError: The controller stopped the motion; `.faults` and `.record` say why. `recover()` leads on.
            ConnectionLostError: The controller is gone.
            InvalidValueError: A command was unusable; the arm was brought to rest.
            Exception: Whatever the callback raised; the arm was brought to rest.
        """
        require_mode(mode)
        filters: list[CommandFilter] = [] if cut_off is None else [LowPass(cut_off)]
        if rate_limit is not None:
            from rcilab.makers.rokae.limit_tables import cartesian_limits

            filters.append(RateLimiter(cartesian_limits(self.model.limits, rate_limit)))
        if not callable(callback):
            raise InvalidValueError("callback", described(callback), "is no function (state, t) -> command")
        with self._turns.set_out("control"):
            return self._runner.run(callback, mode, self.model, filters=filters, box=self.safety_box)

    def move_j(self, goal: ArrayLike, speed: float = 0.2, progress: Progress | None = None) -> Run:
        """Moves to joint angles by the manual's S profile and returns when the arm is there: the vendor's MOVEJ.

        From the commanded angles, not from a start that the caller has to know; a move to where the arm is ends at
        once; the speed has a range; the motion is checked before it begins.

        Args:
            goal: Joint angles, shape (n,), [rad].
            speed: Part of 1 rad/s (1.25 for the last three joints) and 2.5 rad/s^2, 0.001 to 1.
            progress: Told how far it is, about 20 times a second.

        Raises:
            PlanningError: The goal, or the arm, is outside the joint limits.
            ConformanceError: The motion breaks a condition; nothing moved.
            ControlError: The controller stopped it. `recover()` leads on.
        """
        from rcilab.motion import plan_joint

        with self._turns.set_out("move_j"):
            state = self.receive_state()
            motion = plan_joint(self.model, state.q_c, goal, speed=speed, law="s_profile")
            self._require_allowed(motion, state)
            callback = follow(motion.q, report_progress(motion, progress))
            return self._runner.run(callback, "joint_position", self.model, motion, box=self.safety_box)

    def move_l(self, goal: Pose, speed: float = 0.2, psi: float | None = None, progress: Progress | None = None) -> Run:
        """Moves the tool straight to a pose by the manual's S profile, and returns when it is there: MOVEL.

        The wire carries poses, the controller computes the joints (Cartesian position mode). Position, orientation and
        arm angle run in proportion, so a large turn on a short way is fast. Where the tool only turns, the way is the
        angle about any axis; the vendor's agrees for base z only. Identical start and goal, on which the vendor's never
        returns, end at once. What the joints would do is planned and checked first.

        Args:
            goal: Pose of the tool in base.
            speed: Part of 1 m/s and 2.5 m/s^2, 0.001 to 1; of 1 rad/s and 2.5 rad/s^2 where the tool only turns.
            psi: Arm angle of a 7-axis arm at the goal, [rad], 0 too; None leaves it to the controller, which holds it.
            progress: Told how far it is, about 20 times a second.

        Raises:
            PlanningError: A pose on the way is out of reach or singular; the message says where and why.
            ConformanceError: The joints would break a condition; nothing moved.
            ControlError: The controller stopped it. `recover()` leads on.
        """
        from rcilab.motion.cartesian import arm_angles
        from rcilab.motion.path import build_line

        with self._turns.set_out("move_l"):
            state = self.receive_state()
            angles = arm_angles(self.model, state.q_c, psi)
            path = build_line(self.model.forward(state.q_c), goal, *angles)
            return self._move_along(path, state, speed, psi is not None, progress)

    def move_c(
        self, via: Pose, goal: Pose, speed: float = 0.2, psi: float | None = None, progress: Progress | None = None
    ) -> Run:
        """Moves the tool on the arc over `via` to a pose by the manual's S profile; returns when it is there: MOVEC.

        As the vendor's, the orientation turns from start to goal and that of `via` is ignored. Three positions on a
        line are an error here, not a return value. For the rest see `move_l`.

        Args:
            via: A pose whose position lies on the arc.
            goal: Pose of the tool in base.
            speed: Part of 1 m/s and 2.5 m/s^2, 0.001 to 1.
            psi: Arm angle of a 7-axis arm at the goal, [rad]; None leaves it to the controller, which holds it.
            progress: Told how far it is, about 20 times a second.

        Raises:
            PlanningError: The positions make no circle, or a pose on the way is out of reach or singular.
            ConformanceError: The joints would break a condition; nothing moved.
            ControlError: The controller stopped it. `recover()` leads on.
        """
        from rcilab.motion.cartesian import arm_angles
        from rcilab.motion.path import build_arc

        with self._turns.set_out("move_c"):
            state = self.receive_state()
            angles = arm_angles(self.model, state.q_c, psi)
            path = build_arc(self.model.forward(state.q_c), via, goal, *angles)
            return self._move_along(path, state, speed, psi is not None, progress)

    @property
    @abstractmethod
    def model(self) -> RobotModel:
        """The arm, with its tool and load."""

    @property
    @abstractmethod
    def safety_box(self) -> SafetyBox | None:
        """The box that the tool must stay in, as far as this session has set one."""

    @abstractmethod
    def receive_state(self) -> RobotState:
        """Returns a fresh state."""

    def _require_allowed(self, motion: Motion, state: RobotState, mode: Mode = "joint_position") -> None:
        from rcilab.conformance.check import check

        check(motion, self.model, start=state.q_c, box=self.safety_box, mode=mode).require()

    def _move_along(
        self, path: Path, state: RobotState, speed: float, with_psi: bool, progress: Progress | None
    ) -> Run:
        """Streams a path in Cartesian position mode once its joint motion is found good."""
        from rcilab.motion.cartesian import follow_path, schedule

        motion = follow_path(self.model, state.q_c, path, speed)
        self._require_allowed(motion, state, "cartesian_position")
        callback = follow_poses(path, schedule(path, speed), with_psi, report_progress(motion, progress))
        return self._runner.run(callback, "cartesian_position", self.model, motion, box=self.safety_box)
