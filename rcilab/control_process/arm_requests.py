"""What the supervisor is asked for on behalf of the arm: power, motions and their pace, jogs, guiding, set-up."""

from __future__ import annotations

import threading
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from rcilab.control_process.configuration_codec import pack_setup
from rcilab.control_process.configuration_sync import ConfigurationSync
from rcilab.control_process.guiding import GuideKind, GuideSpace, require_guidable
from rcilab.control_process.jog_command import JogKind, build_jog, hold_jog, release_jog
from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.motion_preconditions import require_admissible, require_ready
from rcilab.control_process.pending_request import PendingRequest
from rcilab.control_process.speed_override import LEADS, SpeedOverride
from rcilab.control_process.status import SupervisorStatus
from rcilab.core.errors import UsageError
from rcilab.core.state import Mode
from rcilab.makers.rokae.driver.commands import require_signal
from rcilab.makers.rokae.driver.configuration import RobotConfiguration, require_setup
from rcilab.motion.speed_scaling import SpeedScaledMotion, require_pace

if TYPE_CHECKING:
    from rcilab.conformance import Certificate
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion


class ArmRequests:
    """The requests of a `Supervisor`; each returns a `PendingRequest` at once."""

    model: RobotModel
    """The arm, with the tool and the load that the controller was told of last."""
    _lock: threading.RLock
    _block: ControlBlock | None
    _setup: ConfigurationSync
    _pace: SpeedOverride
    _jogging: PendingRequest | None

    @abstractmethod
    def status(self) -> SupervisorStatus:
        """Returns a snapshot."""

    @abstractmethod
    def _ask(self, what: str, **letter: Any) -> PendingRequest:
        """Sends a request to the control process."""

    @abstractmethod
    def _require_block(self) -> ControlBlock:
        """Returns the shared block."""

    @abstractmethod
    def _is_operator_overdue(self) -> bool:
        """Returns whether somebody ought to be at the controls and is not."""

    @abstractmethod
    def _motion_cycle(self) -> int | None:
        """Returns the cycle of the motion under way; None when there is none."""

    def power_on(self) -> PendingRequest:
        """Asks for motor power."""
        return self._ask("power on", kind="power", on=True)

    def power_off(self) -> PendingRequest:
        """Asks for motor power to be taken away."""
        return self._ask("power off", kind="power", on=False)

    @property
    def stops(self) -> int:
        """How often `stop` has been called since `start`; what was wanted before the last one moves nothing."""
        with self._lock:
            return 0 if self._block is None else self._block.words[Counter.STOPS_ASKED]

    def execute(
        self,
        motion: Motion,
        certificate: Certificate,
        mode: Mode = "joint_position",
        *,
        pace: float = 1.0,
        stops: int | None = None,
    ) -> PendingRequest:
        """Streams a checked motion; the ticket is done when the arm stands still again.

        It is judged once more before it is handed over, which takes up to some 0.2 s; a `stop` meanwhile counts.

        Args:
            motion: The motion.
            certificate: From `check(motion, model, mode=mode).certificate`.
            mode: How the arm is commanded: the same way as joint angles, as poses of the tool, or as torques; see
                `rcilab.execution.command_builder`.
            pace: Part of its planned speed that it runs at from the beginning, 0.1 to 1; `set_pace` changes it later.
            stops: What `stops` was when somebody wanted this; None: they want it now.

        Raises:
            InvalidValueError: The pace is out of range.
            PlanningError: At this pace it would break a condition, or last too long.
            CertificateError: The certificate is missing, or does not fit the motion, the model, or where the arm is.
            UsageError: The arm is moving, no controller is connected, nobody is at the controls, the motion takes more
                than 300 s, the controller has not taken the set-up it was told last, or a stop has come meanwhile.
        """
        from rcilab.conformance.speed_scaling_check import plan_start

        stops = self.stops if stops is None else stops
        require_admissible(
            motion,
            certificate,
            self.model,
            self.status(),
            is_operator_overdue=self._is_operator_overdue(),
            box=self._setup.wanted.box,
            mode=mode,
        )
        paced = plan_start(motion, pace, self.model, mode)
        with self._lock:
            self._require_unstopped(stops)
            self._setup.require_given()
            self._pace.begin(paced, self.model, mode)
            duration = paced.duration if paced.changed else motion.duration  # As planned it may end within a cycle.
            return self._ask("execute", kind="execute", rows=len(paced.q), duration=duration, mode=mode)

    def pause(self) -> PendingRequest:
        """Holds the motion under way, along its way and within all limits; done once that is handed over.

        `resume` goes on; a motion that is held for more than 120 s is given up.

        Raises:
            UsageError: No motion of `execute` is under way.
            PlanningError: It arrives before it could be held.
        """
        return self._change_pace(0.0)

    def resume(self, pace: float = 1.0) -> PendingRequest:
        """Goes on with a motion that is held; see `set_pace`."""
        return self.set_pace(pace)

    def set_pace(self, pace: float) -> PendingRequest:
        """Runs the motion under way at part of its planned speed; done once that is handed over.

        The change is planned here, along the way, and judged by the conditions of the motion's mode before any of it
        is sent; that takes some 10 to 100 ms.

        Args:
            pace: 0.1 to 1.

        Raises:
            InvalidValueError: The pace is out of range.
            UsageError: No motion of `execute` is under way, or this machine is too busy.
            PlanningError: There is no way within the limits to change from here; the motion goes on as it is.
        """
        return self._change_pace(require_pace(pace))

    @property
    def paced(self) -> SpeedScaledMotion | None:
        """The motion of the last `execute` as it was really commanded, with every change of pace; None before."""
        with self._lock:
            self._require_block()
            return self._pace.paced

    def _change_pace(self, pace: float) -> PendingRequest:
        for lead in LEADS:
            changed = self._pace.plan(pace, lead, self._require_cycle())
            with self._lock:
                handed = self._pace.hand_over(changed, self._require_cycle())
                if handed is not None:
                    ticket = self._ask(
                        "change of pace", kind="pace", first=handed.first, place=handed.place, rows=handed.count,
                        holds=changed.holds, duration=changed.duration,
                    )  # fmt: skip
                    self._pace.follow(ticket, changed, handed)
                    return ticket
        raise UsageError(
            "this machine is too busy to change the pace of the motion in time; it goes on as it is"
        ).coded("too_busy")

    def _require_cycle(self) -> int:
        cycle = self._motion_cycle()
        if cycle is None:
            raise UsageError("no motion runs whose pace could change").coded("no_pace")
        return cycle

    def jog(
        self, kind: JogKind, values: ArrayLike, *, goes_on: PendingRequest | None = None, stops: int | None = None
    ) -> PendingRequest:
        """Moves the arm as long as it is held: call it at least five times a second, and `release_jog` at the end.

        The first call begins a jog, the next ones go on with it, whatever direction they ask for: on-line re-planning
        inside every limit of the joints. A jog that is not renewed for 0.3 s comes to rest. It is a motion like any
        other, so the first movement comes when the controller shows its mode, 0.2 to 1 s after the first call; at rest
        it listens for another second.

        Args:
            kind: "joint", or "base" or "tool" for a twist of the tool in these axes.
            values: n joint velocities, [rad/s], or a twist of six numbers, linear first, [m/s, rad/s]; lowered to
                what the limits allow.
            goes_on: Ticket of the jog to go on with: where that has ended meanwhile, as by `stop`, none is begun.
            stops: What `stops` was when somebody wanted to begin a jog; None: they want it now.

        Returns:
            The ticket of the jog; it is done when the arm stands still and nobody jogs any more.

        Raises:
            InvalidValueError: The kind is unknown, or the values are not as many finite numbers as it needs.
            UsageError: Another motion is under way, no controller is connected, nobody is at the controls, or a stop
                has come meanwhile.
        """
        command = build_jog(kind, values, self.model.n)
        with self._lock:
            block = self._require_block()
            is_under_way = self._jogging is not None and not self._jogging.done
            if goes_on is not None and goes_on.done:
                raise UsageError("this jog has ended; begin another one").coded("jog_ended")
            if not is_under_way:
                self._require_unstopped(stops)
                self._setup.require_given()
                require_ready(self.status(), is_operator_overdue=self._is_operator_overdue())
            hold_jog(block.jog, block.words, command)
            if self._jogging is None or not is_under_way:
                self._jogging = self._ask("jog", kind="jog")
            return self._jogging

    def release_jog(self) -> None:
        """Brings a jog to rest at once."""
        with self._lock:
            if self._block is not None:
                release_jog(self._block.words)

    def start_guiding(
        self, space: GuideSpace = "joint", kind: GuideKind = "free", *, stops: int | None = None
    ) -> PendingRequest:
        """Frees the arm for a hand to guide it (startDrag), until `stop_guiding` or `stop`; done once it is free.

        The phase is "moving" meanwhile and the code "moving.guided". It ends like a motion when nobody is at the
        controls any more, and by itself when the controller leaves it, as on a fault.

        Args:
            space: In joint space every joint is free, and `kind` has no effect.
            kind: What stays free in Cartesian space.
            stops: What `stops` was when somebody wanted this; None: they want it now.

        Raises:
            InvalidValueError: There is no such space or kind.
            UsageError: The arm is moving, no controller is connected, nobody is at the controls, or a stop has come
                meanwhile.
        """
        require_guidable(space, kind)
        with self._lock:
            self._require_unstopped(stops)
            require_ready(self.status(), is_operator_overdue=self._is_operator_overdue())
            self._setup.require_given()
            return self._ask("start guiding", kind="start_guiding", space=space, type=kind)

    def stop_guiding(self) -> PendingRequest:
        """Ends hand guiding (stopDrag); done once the arm stands still."""
        return self._ask("stop guiding", kind="stop_guiding")

    def stop(self) -> PendingRequest:
        """Brings a running motion to rest within the limits, or ends guiding; done when the arm stands still."""
        with self._lock:
            block = self._require_block()
            release_jog(block.words)
            block.words[Counter.STOPS_ASKED] += 1
            return self._ask("stop", kind="stop", number=block.words[Counter.STOPS_ASKED])

    def _require_unstopped(self, stops: int | None) -> None:
        """Refuses what was wanted before the last stop, and all while not running; call with the lock."""
        self._require_block()
        if stops is not None and self.stops > stops:
            raise UsageError("a stop came before the arm had begun to move; ask again if it is to move").coded(
                "stopped_before"
            )

    def set_up(self, setup: RobotConfiguration) -> PendingRequest:
        """Tells the controller a tool, a load, a safety box, a force-control frame; done once it has taken all of it.

        From now on motions are checked with it, and it is told again at every new connection.

        Args:
            setup: What to tell; parts that are None stay.

        Raises:
            InvalidValueError: It is no set-up, or the load is heavier than the arm is rated for.
            UsageError: The arm is moving, or no controller is connected.
        """
        model = require_setup(setup).applied_to(self.model)
        with self._lock:
            self._require_block()
            require_ready(self.status(), is_operator_overdue=False)
            ticket = self._ask("set up", kind="set_up", setup=pack_setup(setup))
            self._setup.follow(ticket, setup)
            self.model = model
            return ticket

    def set_output(self, signal: int, level: bool) -> PendingRequest:
        """Sets a digital output, 0 to 5, and reads the inputs again; the status shows both."""
        return self._ask("set output", kind="output", signal=require_signal(signal), level=bool(level))

    def read_inputs(self) -> PendingRequest:
        """Reads the digital inputs; the status shows them."""
        return self._ask("read inputs", kind="inputs")

    def reboot(self) -> PendingRequest:
        """Restarts the controller, which ends the connection; `reconnect` makes the next one, and sets all up again.

        Raises:
            UsageError: The arm is moving, or no controller is connected.
        """
        with self._lock:
            self._require_block()
            require_ready(self.status(), is_operator_overdue=False)
            return self._ask("reboot", kind="reboot")

    def recover(self) -> PendingRequest:
        """Asks the controller to clear its faults (automatic error recovery)."""
        return self._ask("recover", kind="recover")
