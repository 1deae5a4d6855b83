"""The session: one arm, connected. The same object for a real robot, `connect`, and a simulated one, `simulate`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

from rcilab.arrays import JointPath
from rcilab.client.address import RobotAddress, parse_address
from rcilab.client.commands import RciCommands
from rcilab.client.control_loop import SILENCE, Callback, ControlLoop
from rcilab.client.identify import identify_robot
from rcilab.client.link import Link
from rcilab.client.punctual import punctual
from rcilab.client.recorder import RECORD_TIME, CycleLog, Recorder
from rcilab.client.run import Run, build_run
from rcilab.client.start_check import describe_start_mismatch
from rcilab.client.transport import SocketTransport
from rcilab.clock import CYCLE_TIME
from rcilab.command import JointPosition
from rcilab.errors import ConnectionLostError, DeadlineError, InvalidValueError, UsageError
from rcilab.protocols.rci import STATE_SIZE
from rcilab.state import ControllerMode, RobotState

if TYPE_CHECKING:
    from rcilab.conformance import Certificate
    from rcilab.model import RobotModel
    from rcilab.motion import Motion

Mode: TypeAlias = Literal["joint_position", "joint_impedance", "cartesian_position", "cartesian_impedance", "torque"]
MODES: tuple[Mode, ...] = get_args(Mode)

Progress: TypeAlias = Callable[[float, float], None]
"""`(t, duration)`, both [s]; called about 20 times a second from inside the loop, so it must be quick."""

RECOVERY_TIMEOUT = 3.0  # [s] for the error bits to go after the controller has agreed to clear them; a choice.
_FRESH = 0.1  # [s] Longest wait for one state while faults are expected to go.
_PROGRESS_CYCLES = 50
_SPARE_CYCLES = 2000  # Room in the recorder for what comes before and after the motion itself.


def connect(address: str, model: RobotModel | None = None, timeout: float = 3.0) -> RobotSession:
    """Returns a session with the robot at an address. Nothing moves and no motor is switched.

    Args:
        address: `rci://HOST:PORT`; `?udp_port=N` when the robot takes commands at another UDP port,
            `?client_port=M` when it sends states to another port of ours.
        model: The arm, with its tool and load; None asks the controller which arm it is.
        timeout: How long to wait for the connection, for the first state, and for every answer, [s].

    Raises:
        ConnectionLostError: Nobody answers there, or states do not arrive; the message says what to check.
        ModelError: No model was given, and the controller's arm is not among the known ones.
        InvalidValueError: The address is none.
    """
    return open_session(address, model, timeout)


def open_session(
    address: str,
    model: RobotModel | None,
    timeout: float,
    *,
    realtime: bool = True,
    silence: float = SILENCE,
    on_close: Callable[[], None] = lambda: None,
) -> RobotSession:
    """Returns a session as `connect` does, with what only a simulation sets; see `RobotSession`."""
    place = parse_address(address)
    transport = SocketTransport(place, STATE_SIZE, timeout)
    try:
        link = Link(transport, 7 if model is None else model.n, str(place), timeout)
        if model is None:
            from rcilab.model import load_model

            model = load_model(identify_robot(RciCommands(link).load_robot_model().dh))
            link.n = model.n
        await_first_state(link, place, transport.local_address, timeout)
        return RobotSession(link, model, realtime=realtime, silence=silence, on_close=on_close)
    except BaseException:
        transport.close()
        raise


def await_first_state(link: Link, place: RobotAddress, local: tuple[str, int], timeout: float) -> None:
    """Returns once a state has arrived.

    Raises:
        ConnectionLostError: None has after `timeout`, [s].
    """
    if not link.poll(timeout):
        raise ConnectionLostError(
            f"{place} accepted the connection but sent no state to {local[0]}:{local[1]} within {timeout:g} s; check "
            "that the teach pendant's RCI page names this computer's address and that no firewall drops UDP; if the "
            "robot sends to another port of ours, add ?client_port=N to its address"
        )


class RobotSession(RciCommands):
    """A connected arm: its state, every RCI command, and motions at 1 kHz. Made by `connect` and `simulate`.

    Use it from one thread; only `stop` may be called from others. A session stays usable after faults: `recover()`.

    Args:
        link: The connection.
        model: The arm.
        realtime: False for a controller in lock-step, where timing means nothing.
        silence: Time without a state, while moving, that counts as a lost connection, [s].
        on_close: Called once when the session is closed, such as to end a private controller.
    """

    def __init__(
        self,
        link: Link,
        model: RobotModel,
        *,
        realtime: bool = True,
        silence: float = SILENCE,
        on_close: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__(link, model.limits)
        self.model = model
        self._realtime = realtime
        self._silence = silence
        self._on_close = on_close
        self._stop_reason: str | None = None
        self._moving = False
        self._closed = False

    @property
    def address(self) -> str:
        """Where the robot is."""
        return self._link.name

    @property
    def state(self) -> RobotState:
        """The state of this very millisecond; inside a callback, the one that it was given."""
        if self._moving and self._link.latest is not None:
            return self._link.latest
        return self.receive_state()

    def receive_state(self, timeout: float = 1.0) -> RobotState:
        """Returns a state that was sent after this call; older ones that waited in the socket are dropped.

        Args:
            timeout: How long to wait for it, [s].

        Raises:
            ConnectionLostError: None came.
            UsageError: The session is closed.
        """
        self._require_open()
        while self._link.poll(0.0):
            pass
        states = self._link.poll(timeout)
        if not states:
            raise ConnectionLostError(
                f"{self._link.name}: no state within {timeout:g} s; look whether the controller runs and the cable is "
                "in, then connect again"
            )
        return states[-1]

    def execute(self, motion: Motion, certificate: Certificate | None = None, progress: Progress | None = None) -> Run:
        """Streams a motion and returns what became of it. Checks it first.

        Args:
            motion: The motion; it must begin at the commanded angles of the arm, `state.q_c`.
            certificate: From an earlier `check(motion, model)`; then only its freshness is verified.
            progress: Told how far it is, about 20 times a second.

        Raises:
            ConformanceError: The motion breaks a condition; nothing moved.
            CertificateError: The certificate is for something else; nothing moved.
            UsageError: The motion starts elsewhere than the arm is; nothing moved.
            ControlError: The controller stopped it; `.faults` and `.record` say why. `recover()` leads on.
            ConnectionLostError: The controller is gone.
        """
        state = self.receive_state()
        mismatch = describe_start_mismatch(motion.q[0], state.q_c)
        if mismatch is not None:
            raise UsageError(mismatch)
        if certificate is None:
            from rcilab.conformance import check

            check(motion, self.model, start=state.q_c).require()
        else:
            certificate.verify(motion, self.model, state.q_c)
        return self._run(follow(motion.q, _reporter(motion, progress)), "joint_position", motion)

    def control(self, callback: Callback, mode: Mode = "joint_position") -> Run:
        """Runs a callback in every controller cycle until it returns a command with `finished=True`.

        The first command must be where the arm is: `JointPosition(state.q_c)`. t counts controller cycles since the
        first call, in seconds, so a lost packet does not stretch time.

        Args:
            callback: `(state, t) -> JointPosition | CartesianPosition | JointTorque`, as the mode asks for.
            mode: How the controller shall follow.

        Raises:
            ControlError: The controller stopped the motion; `.faults` and `.record` say why. `recover()` leads on.
            ConnectionLostError: The controller is gone.
            InvalidValueError: A command was unusable; the arm was brought to rest.
            Exception: Whatever the callback raised; the arm was brought to rest.
        """
        return self._run(callback, mode, None)

    def stop(self) -> None:
        """Brings a running motion to rest within the limits; `execute` or `control` then returns its run.

        May be called from another thread, or from a callback. Does nothing when nothing runs.
        """
        if self._moving:
            self._stop_reason = "on request"

    def recover(self) -> None:
        """Clears the controller's faults and returns once they are gone.

        Raises:
            CommandRejectedError: The controller refuses; the message says what it waits for.
            DeadlineError: It agreed, and the faults stayed.
        """
        self._require_open()
        recover(self, self._link)

    def close(self) -> None:
        """Ends the connection. May be called twice. A motion must be over: it ends with the call that runs it."""
        if not self._closed:
            self._closed = True
            self._link.close()
            self._on_close()

    def __enter__(self) -> RobotSession:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<RobotSession {self.model.name} at {self._link.name}{', closed' if self._closed else ''}>"

    def _run(self, callback: Callback, mode: Mode, plan: Motion | None) -> Run:
        self._require_open()
        if mode not in MODES:
            raise InvalidValueError("mode", mode, f"is unknown; known: {', '.join(MODES)}")
        if self._moving:
            raise UsageError("a motion is running already; let it end, or stop() it first")
        time_needed = RECORD_TIME if plan is None else plan.duration
        recorder = Recorder(self.n, math.ceil(time_needed / CYCLE_TIME) + _SPARE_CYCLES)
        self._stop_reason = None
        loop = ControlLoop(
            self._link,
            self,
            self.model.limits,
            ControllerMode[mode.upper()],
            CycleLog(recorder),
            watch=lambda t: self._stop_reason,
            silence=self._silence,
        )
        self._moving = True
        try:
            with punctual(self._realtime):
                reason = loop.run(callback)
        finally:
            self._moving = False
        return build_run(
            recorder.rows(), plan=plan, stopped=reason, truncated=recorder.truncated, realtime=self._realtime
        )

    def _require_open(self) -> None:
        if self._closed:
            raise UsageError("this session is closed; connect again")


def recover(commands: RciCommands, link: Link) -> None:
    """Clears the controller's faults and returns once no state shows them any more; see `RobotSession.recover`."""
    commands.automatic_error_recovery()
    deadline = time.monotonic() + RECOVERY_TIMEOUT
    faults = link.latest.faults if link.latest is not None else ()
    while time.monotonic() < deadline:
        states = link.poll(_FRESH)
        link.on_states(states)
        if states:
            faults = states[-1].faults
            if not faults:
                return
    names = ", ".join(fault.name for fault in faults)
    raise DeadlineError(
        f"{link.name}: {names or 'the faults'} did not clear within {RECOVERY_TIMEOUT:g} s; remove the cause first"
        + (f": {faults[0].remedy}" if faults else "")
    )


def follow(rows: JointPath, on_cycle: Callable[[int], None] | None = None) -> Callback:
    """Returns the callback that streams prepared joint angles: row k in controller cycle k.

    Args:
        rows: Joint angles, shape (N, n), [rad].
        on_cycle: Told the number of every cycle.
    """
    last = len(rows) - 1

    def callback(state: RobotState, t: float) -> JointPosition:
        cycle = min(round(t / CYCLE_TIME), last)
        if on_cycle is not None:
            on_cycle(cycle)
        return JointPosition(rows[cycle], finished=cycle == last)

    return callback


def _reporter(motion: Motion, progress: Progress | None) -> Callable[[int], None] | None:
    if progress is None:
        return None
    last = len(motion.q) - 1

    def report(cycle: int) -> None:
        if cycle % _PROGRESS_CYCLES == 0 or cycle == last:
            progress(min(cycle * CYCLE_TIME, motion.duration), motion.duration)

    return report
