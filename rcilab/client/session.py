"""The session: one arm, connected. The same object for a real robot, `connect`, and a simulated one, `simulate`."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeAlias

from numpy.typing import ArrayLike

from rcilab.arrays import as_number
from rcilab.client.address import parse_address
from rcilab.client.commands import RciCommands
from rcilab.client.control_loop import SILENCE, Callback, ControlLoop
from rcilab.client.filters import CommandFilter
from rcilab.client.identify import dh_lengths, identify_robot
from rcilab.client.link import Link
from rcilab.client.motions import Motions
from rcilab.client.open_sessions import enlist
from rcilab.client.opening import await_first_state, require_arm_there, require_timeout
from rcilab.client.punctual import punctual
from rcilab.client.recorder import RECORD_TIME, CycleLog, Recorder
from rcilab.client.recovery import recover
from rcilab.client.transport import SocketTransport
from rcilab.client.world import World
from rcilab.clock import CYCLE_TIME
from rcilab.closing import Closing
from rcilab.errors import ConnectionLostError, InvalidValueError, UsageError
from rcilab.one_core import one_core
from rcilab.protocols.rci import STATE_SIZE, Request
from rcilab.recording.run import Run, build_run
from rcilab.recording.setup import Setup
from rcilab.safety_box import SafetyBox
from rcilab.spatial import Pose
from rcilab.state import ControllerMode, Mode, RobotState

if TYPE_CHECKING:
    from rcilab.model import RobotModel
    from rcilab.motion import Motion

Ear: TypeAlias = Callable[[Run, BaseException | None], None]

_CLOSED = "the session was closed while a motion ran"
_CLOSE_TIMEOUT = 10.0  # [s] for another thread to bring its motion to rest; the slowest joint needs 0.4 s.
_LOOK = 0.02  # [s] Longest wait for another thread's request before it is looked at again what that thread does.
_SPARE_CYCLES = 2000  # Room in the recorder for what comes before and after the motion itself.


def connect(address: str, model: RobotModel | None = None, timeout: float = 3.0) -> RobotSession:
    """Returns a session with the robot at an address. Nothing moves and no motor is switched.

    Args:
        address: `rci://HOST:PORT`; `?udp_port=N` when the robot takes commands at another UDP port,
            `?client_port=M` when it sends states to another port of ours; `?world_port=W` for `world`.
        model: The arm, with its tool and load; None takes the arm that the controller says it is.
        timeout: How long to wait for the connection, for the first state, and for every answer, [s].

    Raises:
        ConnectionLostError: Nobody answers there, or states do not arrive; the message says what to check.
        ModelError: The model is another arm than the controller's, or none was given and that one is not known.
        InvalidValueError: The address, the model or the timeout is none.
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
    world: World | None = None,
    partner: int | None = None,
) -> RobotSession:
    """Returns a session as `connect` does, with what only a simulation sets; see `RobotSession`."""
    place = parse_address(address)
    require_timeout(timeout)
    if model is not None:
        from rcilab.model import require_model, require_rci

        require_rci(require_model(model))
    transport = SocketTransport(place, STATE_SIZE, timeout)
    try:
        link = Link(transport, 7 if model is None else model.n, str(place), timeout)
        if model is None:
            from rcilab.model import load_model

            model = load_model(identify_robot(RciCommands(link).load_model().dh))
            link.n = model.n
        else:
            require_arm_there(RciCommands(link), model.name, dh_lengths(model.description.dh), str(place))
        await_first_state(link, place, transport.local_address, timeout)
        if world is None and place.world_port is not None:
            world = World(place.host, place.world_port)
        return RobotSession(
            link, model, realtime=realtime, silence=silence, on_close=on_close, world=world, partner=partner
        )
    except BaseException:
        transport.close()
        raise


class RobotSession(Motions, Closing):
    """A connected arm: its state, every RCI command, and motions at 1 kHz. Made by `connect` and `simulate`.

    While a motion runs, only `stop`, `close` and `state` may be called, from any thread and from a callback; all else
    is refused and does not disturb it. A session stays usable after faults: `recover()`.

    Args:
        link: The connection.
        model: The arm.
        realtime: False for a controller in lock-step, where timing means nothing.
        silence: Time without a state, while moving, that counts as a lost connection, [s].
        on_close: Called once when the session is closed, such as to end a private controller.
        world: What surrounds a virtual robot; None where nothing of the kind is known.
        partner: Process id of a controller on this machine that is in lock-step with us; None: it is not.
    """

    def __init__(
        self,
        link: Link,
        model: RobotModel,
        *,
        realtime: bool = True,
        silence: float = SILENCE,
        on_close: Callable[[], None] = lambda: None,
        world: World | None = None,
        partner: int | None = None,
    ) -> None:
        super().__init__(link, model.limits)
        self._model = model
        self._safety_box: SafetyBox | None = None
        self._realtime = realtime
        self._silence = silence
        self._on_close = on_close
        self._world = world
        self._partner = partner
        self._stop_reason: str | None = None
        self._moving = False
        self._leaving = False  # A motion is being checked; from here on it can be stopped.
        self._ears: tuple[Ear, ...] = ()
        self._closing = False
        self._closed = False
        self._busy = threading.RLock()  # Held by the thread that talks to the controller.
        self._mover: int | None = None  # The thread that runs a motion.
        enlist(self)

    @property
    def model(self) -> RobotModel:
        """The arm, with the tool and the load that the controller was told of last by this session."""
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
    def world(self) -> World:
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
        return self._moving

    @property
    def is_closed(self) -> bool:
        """Whether it was closed; a new one is needed then."""
        return self._closing

    def hear_runs(self, ear: Ear) -> Callable[[], None]:
        """Has somebody told what became of every motion, as soon as it has ended; returns what ends that.

        Args:
            ear: Called in the thread that ran the motion, with its run and the error that ended it, or None.
        """
        self._ears = (*self._ears, ear)

        def end() -> None:
            self._ears = tuple(other for other in self._ears if other is not ear)

        return end

    @property
    def state(self) -> RobotState:
        """The state of this very millisecond; inside a callback, the one that it was given."""
        if self._moving and self._link.latest is not None:
            return self._link.latest
        return self.receive_state()

    def receive_states(self, timeout: float = 1.0) -> list[RobotState]:
        """Returns every state that has arrived since the last look, oldest first; waits for the first one.

        Args:
            timeout: How long to wait for it, [s].

        Raises:
            ConnectionLostError: None came.
            UsageError: The session is closed, or a motion runs.
        """
        require_timeout(timeout)
        with self._turn("receive_states"):
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
        with self._turn("receive_state"):
            while self._link.poll(0.0):
                pass
            if self._link.latest is not None and self._link.age <= max_age:
                return self._link.latest
            states = self._link.poll(timeout)
        if not states:
            raise self._no_state(timeout)
        return states[-1]

    def _no_state(self, timeout: float) -> ConnectionLostError:
        return ConnectionLostError(
            f"{self._link.name}: no state within {timeout:g} s; look whether the controller runs and the cable is "
            "in, then connect again"
        )

    def set_coor(self, T_flange_tool: Pose) -> None:
        """Sets the tool by its pose in the flange frame; `model` has it from then on."""
        with self._turn("SetCoor"):
            model = self._model.with_tool(T_flange_tool)
            super().set_coor(T_flange_tool)
            self._model = model

    def set_cartesian_limit(self, box: SafetyBox) -> None:
        """Sets the safety box that the origin of the tool must stay in, and whether it is watched."""
        with self._turn("SetCartesianLimit"):
            super().set_cartesian_limit(box)
            self._safety_box = box

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load at the flange; `model` has it from then on.

        Args:
            mass: [kg], up to the arm's payload.
            center_of_mass: In the flange frame, shape (3,), [m].
            inertia: About the centre of mass, shape (3, 3), [kg m^2].
        """
        from rcilab.dynamics.payload import Payload

        with self._turn("SetLoad"):
            load = Payload(mass=mass, center_of_mass=center_of_mass, inertia=inertia)  # type: ignore[arg-type]
            model = self._model.with_load(load)
            super().set_load(load.mass, load.center_of_mass, load.inertia)
            self._model = model

    def stop(self, reason: str = "on request") -> None:
        """Brings a running motion to rest within the limits; `execute` or `control` then returns its run.

        May be called from another thread, or from a callback. Does nothing when nothing runs, or is about to.

        Args:
            reason: What the run says in `stopped`; the first one counts.
        """
        if self._moving or self._leaving:
            self._stop_reason = self._stop_reason or reason

    def recover(self) -> None:
        """Clears the controller's faults and returns once they are gone.

        Raises:
            CommandRejectedError: The controller refuses; the message says what it waits for.
            DeadlineError: It agreed, and the faults stayed.
        """
        with self._turn("recover"):
            recover(self, self._link)

    def close(self) -> None:
        """Brings a running motion to rest within the limits and ends the connection. May be called twice.

        The call that runs the motion returns its run. From inside a callback, the connection ends with the motion.
        """
        self._closing = True
        if self._moving and self._mover == threading.get_ident():
            return
        is_mine = self._busy.acquire(timeout=_CLOSE_TIMEOUT)
        try:
            self._disconnect()
        finally:
            if is_mine:
                self._busy.release()

    def reboot(self) -> None:
        """Restarts the controller. The session is closed then: connect again once it is up."""
        with self._turn("RebootRobot"):
            super().reboot()
        self.close()

    def __repr__(self) -> str:
        return f"<RobotSession {self.model.name} at {self._link.name}{', closed' if self._closed else ''}>"

    def _run(self, callback: Callback, mode: Mode, plan: Motion | None, filters: Sequence[CommandFilter] = ()) -> Run:
        time_needed = RECORD_TIME if plan is None else plan.duration
        recorder = Recorder(self.n, math.ceil(time_needed / CYCLE_TIME) + _SPARE_CYCLES)
        loop = ControlLoop(
            self._link,
            RciCommands(self._link),  # Not self: everybody else's commands are refused while a motion runs.
            self.model.limits,
            ControllerMode[mode.upper()],
            CycleLog(recorder),
            watch=lambda t: _CLOSED if self._closing else self._stop_reason,
            silence=self._silence,
            model=self.model,
            filters=filters,
        )
        self._mover = threading.get_ident()
        self._moving = True
        started_ns = time.time_ns()

        def keep(stopped: str | None, error: BaseException | None = None) -> Run:
            run = build_run(
                recorder.rows(),
                plan=plan if self._paced is None else self._paced[0].as_motion(),
                paced=self._paced is not None and bool(self._paced[0].changed),
                stopped=stopped,
                truncated=recorder.truncated,
                realtime=self._realtime,
                model=self.model,
                setup=Setup(target=self._link.name, mode=mode, started_ns=started_ns),
            )
            for ear in self._ears:
                ear(run, error)
            return run

        try:
            with punctual(self._realtime), one_core(self._partner):
                reason = loop.run(callback)
        except BaseException as error:
            self._rest()
            if self._ears:
                keep(str(error) or type(error).__name__, error)
            raise
        self._rest()
        return keep(reason)

    def _rest(self) -> None:
        self._moving = False
        if self._closing:
            self._disconnect()

    def _request(self, request: Request, timeout: float | None = None) -> Any:
        with self._turn(type(request).__name__):
            return super()._request(request, timeout)

    @contextmanager
    def _setting_out(self, what: str) -> Iterator[None]:
        """Has the connection for a motion; a stop while it is still being checked counts."""
        with self._turn(what):
            self._stop_reason, self._leaving = None, True
            try:
                yield
            finally:
                self._leaving = False

    @contextmanager
    def _turn(self, what: str) -> Iterator[None]:
        """Has the connection for itself: waits for another thread's request, not for a motion.

        Raises:
            UsageError: A motion runs, or the session is closed.
        """
        self._require_free(what)
        while not self._busy.acquire(timeout=_LOOK):
            self._require_free(what)
        try:
            self._require_free(what)  # Also where the lock is ours: a callback has it too.
            yield
        finally:
            self._busy.release()

    def _require_free(self, what: str) -> None:
        if self._closing:
            raise UsageError("this session is closed; connect again").coded("session_closed")
        if self._moving:
            said = f"a motion is running already: no {what} meanwhile; let it end, or stop() it first"
            raise UsageError(said).coded("moving")

    def _disconnect(self) -> None:
        if not self._closed:
            self._closed = True
            self._link.close()
            if self._world is not None:
                self._world.close()
            self._on_close()
