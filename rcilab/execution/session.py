"""The session: one arm, connected. The same object for a real robot, `connect`, and a simulated one, `simulate`."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from rcilab.core.arrays import as_number, as_vector
from rcilab.core.closeable import Closeable
from rcilab.core.errors import ConnectionLostError, InvalidValueError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotState
from rcilab.execution.control_loop import SILENCE, SILENCE_HERE
from rcilab.execution.motion_runner import Ear, MotionRunner
from rcilab.execution.motions import Motions
from rcilab.execution.open_sessions import enlist
from rcilab.execution.session_lock import SessionLock
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.rokae.driver.address import parse_address
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.makers.rokae.driver.connection import RciConnection
from rcilab.makers.rokae.driver.handshake import await_first_state, require_arm_there, require_timeout, with_tool_of
from rcilab.makers.rokae.driver.identify import dh_lengths, identify_robot
from rcilab.makers.rokae.driver.recovery import recover
from rcilab.makers.rokae.driver.settings import load_center
from rcilab.makers.rokae.driver.transport import SocketTransport
from rcilab.makers.rokae.wire import STATE_SIZE, Request, SetMotorPower
from rcilab.makers.rokae.wire.statuses import WHILE_MOVING

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel


def connect(
    address: str, model: RobotModel | None = None, timeout: float = 3.0, *, record_all: bool = False
) -> RobotSession:
    """Returns a session with the robot at an address. Nothing moves and no motor is switched.

    Args:
        address: `rci://HOST:PORT`; `?udp_port=N` when the robot takes commands at another UDP port,
            `?client_port=M` when it sends states to another port of ours; `?world_port=W` for `world`.
        model: The arm, with its tool and load; None takes the arm that the controller says it is. The tool is the
            controller's: where it has another one, a warning says so, and `robot.set_coor` sets yours.
        timeout: How long to wait for the connection, for the first state, and for every answer, [s].
        record_all: Whether runs hold everything that the state has, three times as much; see `Run.cycles`.

    Raises:
        ConnectionLostError: Nobody answers there, or states do not arrive; the message says what to check.
        ModelError: The model is another arm than the controller's, or none was given and that one is not known.
        InvalidValueError: The address, the model or the timeout is none.
    """
    return open_session(address, model, timeout, record_all=record_all)


def open_session(
    address: str,
    model: RobotModel | None,
    timeout: float,
    *,
    record_all: bool = False,
    realtime: bool = True,
    silence: float | None = None,
    on_close: Callable[[], None] = lambda: None,
    world: SimulationControl | None = None,
    partner: int | None = None,
) -> RobotSession:
    """Returns a session as `connect` does, with what only a simulation sets.

    Args:
        address: See `connect`, as the next three.
        model: The arm.
        timeout: [s].
        record_all: Also as of `connect`.
        realtime: False for a controller in lock-step, where timing means nothing.
        silence: Time without a state, while moving, that counts as a lost connection, [s]; None is `SILENCE`, or
            `SILENCE_HERE` for a controller on this machine: there is no cable to lose, and a busy machine pauses it.
        on_close: Called once when the session is closed, such as to end a private controller.
        world: What surrounds a virtual robot; None where nothing of the kind is known.
        partner: Process id of a controller on this machine that is in lock-step with us; None: it is not.
    """
    place = parse_address(address)
    require_timeout(timeout)
    if model is not None:
        from rcilab.makers.maker import require_driver
        from rcilab.model.robot_model import require_model

        require_driver(require_model(model))
    transport = SocketTransport(place, STATE_SIZE, timeout)
    try:
        link = RciConnection(transport, 7 if model is None else model.n, str(place), timeout)
        if model is None:
            from rcilab.model.robot_model import load_model

            model = load_model(identify_robot(RciCommands(link).load_model().dh))
            link.n = model.n
        else:
            require_arm_there(RciCommands(link), model.name, dh_lengths(model.description.dh), str(place))
        await_first_state(link, place, transport.local_address, timeout)
        model = with_tool_of(link, model)
        if world is None and place.world_port is not None:
            world = SimulationControl(place.host, place.world_port)
        closing = ExitStack()
        closing.callback(on_close)
        if world is not None:
            closing.callback(world.close)
        closing.callback(link.close)
        turns = SessionLock(closing.close)
        if silence is None:
            silence = SILENCE_HERE if place.is_here else SILENCE
        runner = MotionRunner(link, turns, realtime=realtime, silence=silence, partner=partner, record_all=record_all)
        return RobotSession(link, model, turns, runner, world)
    except BaseException:
        transport.close()
        raise


class RobotSession(Motions, Closeable):
    """A connected arm: its state, every RCI command, and motions at 1 kHz. Made by `connect` and `simulate`.

    While a motion runs, `stop`, `close`, `state` and what a controller answers then may be called, from any thread and
    from a callback: `set_do`, `get_di`, `safety_stop`, `motor_state`, `load_model`, `set_cart_imp_desired_tau`, and
    `power_off`, which ends the motion. In a callback such a request takes about a millisecond. All else is refused and
    does not disturb the motion. A session stays usable after faults: `recover()`.

    Args:
        link: The connection.
        model: The arm.
        turns: Whose turn it is on the connection; ends it when the session is closed.
        runner: Runs motions on it.
        world: What surrounds a virtual robot; None where nothing of the kind is known.
    """

    def __init__(
        self,
        link: RciConnection,
        model: RobotModel,
        turns: SessionLock,
        runner: MotionRunner,
        world: SimulationControl | None,
    ) -> None:
        from rcilab.model.robot_model import load_model

        own = load_model(model.name).limits  # A model may have soft limits: they bound motions, not what may be set.
        super().__init__(link, own, turns, runner)
        self._model = model
        self._safety_box: SafetyBox | None = None
        self._world = world
        enlist(self)

    @property
    def model(self) -> RobotModel:
        """The arm, with the tool, the load and the soft limits that this session has set."""
        return self._model

    @property
    def safety_box(self) -> SafetyBox | None:
        """The box that the tool must stay in, as far as this session has set one; motions are checked with it."""
        return self._safety_box

    @property
    def address(self) -> str:
        """Where the robot is."""
        return self._link.name

    @property
    def world(self) -> SimulationControl:
        """What surrounds a virtual robot: `robot.world.push([0, 0, -20, 0, 0, 0])`.

        Raises:
            UsageError: It is a real robot, or the world port of the virtual one is not known.
        """
        if self._world is None:
            raise UsageError(
                f"{self._link.name}: no world port is known; simulate() always has one, and to connect() it is told: "
                "rcilab controller prints it (world HOST:PORT), add ?world_port=PORT to the address"
            )
        return self._world

    @property
    def is_moving(self) -> bool:
        """Whether a motion runs, in whichever thread; `under_way` tells more of one of `execute`."""
        return self._turns.is_moving

    @property
    def is_closed(self) -> bool:
        """Whether it was closed; a new one is needed then."""
        return self._turns.is_closing

    def hear_runs(self, ear: Ear) -> Callable[[], None]:
        """Has somebody told what became of every motion, as soon as it has ended; returns what ends that.

        Args:
            ear: Called in the thread that ran the motion, with its run and the error that ended it, or None.
        """
        return self._runner.hear(ear)

    @property
    def state(self) -> RobotState:
        """The state of this very millisecond; inside a callback, the one that it was given."""
        with self._turns.take_unless_moving() as is_mine:
            if is_mine or self._link.latest is None:
                return self.receive_state()
        return self._link.latest

    def receive_states(self, timeout: float = 1.0) -> list[RobotState]:
        """Returns every state that has arrived since the last look, oldest first; waits for the first one.

        Args:
            timeout: How long to wait for it, [s].

        Raises:
            ConnectionLostError: None came.
            UsageError: The session is closed, or a motion runs.
        """
        require_timeout(timeout)
        with self._turns.take("receive_states"):
            states = self._link.poll(timeout)
        if not states:
            raise self._no_state(timeout)
        return states

    def receive_state(self, timeout: float = 1.0, max_age: float = 0.0) -> RobotState:
        """Returns a state that was sent after this call; older ones that waited in the socket are dropped.

        Args:
            timeout: How long to wait for it, [s].
            max_age: How long ago it may have been sent, [s]: a state that is certainly no older is returned without
                waiting. 0 takes only one that is sent after the call.

        Raises:
            ConnectionLostError: None came.
            UsageError: The session is closed, or a motion runs: `state` is the newest then.
        """
        require_timeout(timeout)
        if not as_number(max_age, "max_age", "s") >= 0.0:
            raise InvalidValueError("max_age", max_age, "must not be below 0 [s]")
        with self._turns.take("receive_state"):
            while self._link.poll(0.0):
                pass
            if self._link.latest is not None and self._link.age <= max_age:
                return self._link.latest
            states = self._link.poll(timeout)
        if not states:
            raise self._no_state(timeout)
        return states[-1]

    def set_coor(self, T_flange_tool: Pose) -> None:
        """Sets the tool by its pose in the flange frame; `model` has it from then on."""
        with self._turns.take("SetCoor"):
            model = self._model.with_tool(T_flange_tool)
            super().set_coor(T_flange_tool)
            self._model = model

    def set_cartesian_limit(self, box: SafetyBox) -> None:
        """Sets the safety box that the origin of the tool must stay in, and whether it is watched."""
        with self._turns.take("SetCartesianLimit"):
            super().set_cartesian_limit(box)
            self._safety_box = box

    def set_collision_behavior(self, thresholds: ArrayLike) -> None:
        """Sets the external torques that count as a collision, shape (n,), [N m]; see `limits.joint`."""
        with self._turns.take("SetCollisionBehavior"):
            super().set_collision_behavior(thresholds)
            self._runner.collision_thresholds = as_vector(thresholds, self._model.n, "thresholds")

    def set_joint_limit(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets soft limits of the joint angles; `model` has them from then on, so that motions are checked with them.

        Args:
            lower: Shape (n,), [rad], inside the arm's own range.
            upper: Shape (n,), [rad].
        """
        with self._turns.take("SetJointLimit"):
            super().set_joint_limit(lower, upper)
            self._model = self._model.with_joint_limits(lower, upper)

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load at the flange; `model` has it from then on.

        Args:
            mass: [kg], up to the arm's payload.
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2].
        """
        from rcilab.model.dynamics.payload import Payload

        with self._turns.take("SetLoad"):
            center = load_center(center_of_mass)
            load = Payload(mass=mass, center_of_mass=center, inertia=inertia)  # type: ignore[arg-type]
            model = self._model.with_load(load)
            super().set_load(load.mass, load.center_of_mass, load.inertia)
            self._model = model

    def stop(self, reason: str = "on request") -> None:
        """Brings a running motion to rest within the limits; `execute` or `control` then returns its run.

        May be called from another thread, or from a callback. Does nothing when nothing runs, or is about to.

        Args:
            reason: What the run says in `stopped`; the first one counts.
        """
        self._turns.stop(reason)

    def recover(self) -> None:
        """Clears the controller's faults and returns once they are gone.

        Raises:
            CommandRejectedError: The controller refuses; the message says what it waits for.
            DeadlineError: It agreed, and the faults stayed.
        """
        with self._turns.take("recover"):
            recover(self, self._link)

    def close(self) -> None:
        """Brings a running motion to rest within the limits and ends the connection. May be called twice.

        The call that runs the motion returns its run. From inside a callback, the connection ends with the motion.
        """
        self._turns.close()

    def reboot(self) -> None:
        """Restarts the controller. The session is closed then: connect again once it is up."""
        with self._turns.take("RebootRobot"):
            super().reboot()
        self.close()

    def __repr__(self) -> str:
        return f"<RobotSession {self.model.name} at {self._link.name}{', closed' if self.is_closed else ''}>"

    def _request(self, request: Request, timeout: float | None = None) -> Any:
        if request.code in WHILE_MOVING or request == SetMotorPower(0):
            with self._turns.take_unless_moving() as is_mine:
                if is_mine:
                    return super()._request(request, timeout)
            return self._link.request_alongside(request, timeout)
        with self._turns.take(type(request).__name__):
            return super()._request(request, timeout)

    def _no_state(self, timeout: float) -> ConnectionLostError:
        return ConnectionLostError(
            f"{self._link.name}: no state within {timeout:g} s; look whether the controller runs and the cable is "
            "in, then connect again"
        )
