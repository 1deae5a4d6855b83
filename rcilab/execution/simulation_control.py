"""Control of a virtual robot's simulation: external forces, obstacles, emergency stop, network faults.

    with rcilab.simulate(model, plant="mujoco") as robot:
        robot.world.push([0, 0, -20, 0, 0, 0], link=4, duration=0.5)

It uses a separate simulation port, which only virtual controllers have. Every method may be called from any thread,
also while a motion runs and from a callback, and returns when the request is done.
"""

from __future__ import annotations

import select
import socket
import threading
import time

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import as_vector
from rcilab.core.closeable import Closeable
from rcilab.core.errors import (
    ConnectionLostError,
    DecodeError,
    InvalidValueError,
    ProtocolError,
    UsageError,
    plain_text,
)
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose, as_pose
from rcilab.model.dynamics.payload import Payload
from rcilab.sim.api import (
    LONGEST_STALL,
    AutoLimit,
    Direction,
    Floor,
    GetStatus,
    Guide,
    Limits,
    LineReader,
    LoopBack,
    Mount,
    Network,
    NetworkFaults,
    OnLoss,
    PlaceArm,
    PlaceBox,
    Press,
    Push,
    Refused,
    Release,
    RemoveBox,
    SafetyButton,
    SetInput,
    SetSoftLimits,
    StallClock,
    Walls,
    WorldAnswer,
    WorldRequest,
    WorldStatus,
    decode_world_answer,
    encode_world_request,
)
from rcilab.sim.setup_requests import box_request, load_request, tool_request

TIMEOUT = LONGEST_STALL + 5.0  # [s] A stalled controller responds after the stall, on a busy machine later.


def parse_simulation_port(address: str) -> tuple[str, int]:
    """Returns host and port of a simulation port, HOST:PORT.

    Raises:
        InvalidValueError: It is not such an address.
    """
    if "://" in address:
        raise InvalidValueError(
            "address",
            address,
            "is where the program of the arm connects; use the simulation port, which the controller prints after "
            "'world', such as 127.0.0.2:40123",
        )
    host, colon, port = address.rpartition(":")
    if not colon or not host or not (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise InvalidValueError("address", address, "needs HOST:PORT, such as 127.0.0.2:40123")
    return host, int(port)


class SimulationControl(Closeable):
    """Client of one virtual robot's simulation port. Connects on first use; `close` ends the connection.

    Args:
        host: Host of the simulation port.
        port: Port number.
        timeout: Timeout of the connection and of every response, [s].
    """

    def __init__(self, host: str, port: int, timeout: float = TIMEOUT) -> None:
        self._address = host, port
        self._timeout = timeout
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._reader = LineReader()
        self._last_id = 0
        self._is_refused = False  # Whether the server refused the connection with the last response.

    @property
    def address(self) -> str:
        """Address of the simulation port, HOST:PORT."""
        return f"{self._address[0]}:{self._address[1]}"

    def push(
        self,
        wrench: ArrayLike,
        link: int | None = None,
        point: ArrayLike | None = None,
        duration: float | None = None,
        rise_time: float = 0.05,
    ) -> None:
        """Applies an external force to the arm; it replaces an earlier one.

        Args:
            wrench: Force and moment, base axes, shape (6,), [N, N m].
            link: Number of the link, from 1; None: the tool.
            point: Where the force acts, in the frame of the link (or the tool), shape (3,), [m]; None: at its origin.
            duration: Duration in the robot's time, [s]; None: until `release`.
            rise_time: Time in which the force rises, and falls at its end, [s]; 0: a step.
        """
        at = None if point is None else _numbers(point, 3, "point", "m")
        self.ask(Push(_numbers(wrench, 6, "wrench", "N, N m"), link, at, duration, rise_time))

    def release(self) -> None:
        """Removes the external force."""
        self.ask(Release())

    def press(self, button: SafetyButton) -> None:
        """Presses an emergency stop, opens the safety gate, or resets all ("none").

        Args:
            button: "estop", "gstop" for the gate, or "switch" for the stop of a three-position switch, where the arm
                has it.
        """
        self.ask(Press(button))

    def guide(self, on: bool = True) -> None:
        """Presses the buttons of the arm that let a hand guide it, or releases them; a Franka arm has them."""
        self.ask(Guide(on))

    def set_input(self, signal: int, level: bool) -> None:
        """Sets a digital input by its number, from 0; of an xMate, 4 and 5 are DI1_0 and DI1_1."""
        self.ask(SetInput(signal, level))

    def set_loop_back(self, on: bool = True) -> None:
        """Connects every digital output to the input with the same number, or disconnects them."""
        self.ask(LoopBack(on))

    def set_auto_limit(self, on: bool = True) -> None:
        """Makes commands stop inside the soft joint limits instead of raising a fault beyond them."""
        self.ask(AutoLimit(on))

    def set_limits(self, table: str) -> None:
        """Selects the Cartesian limits of commands: "manual", or "sdk" for those of the vendor's SDK."""
        self.ask(Limits(table))

    def set_on_loss(self, behaviour: str) -> None:
        """Chooses what the arm does while commands are missing, from the next motion on: "hold" or "bridge"."""
        self.ask(OnLoss(behaviour))

    def set_network(self, faults: NetworkFaults | None = None, direction: Direction = "both") -> None:
        """Simulates network faults.

        Args:
            faults: The faults; None: no faults.
            direction: "commands", "states" (and responses over TCP), or "both".
        """
        self.ask(Network(NetworkFaults() if faults is None else faults, direction))

    def stall(self, duration: float, after: float = 0.0, period: float | None = None) -> None:
        """Stops the controller's clock for a time; a new call replaces an earlier one.

        Args:
            duration: Duration, [s]; 0 cancels pending stalls.
            after: Time from now, [s].
            period: Time between repetitions, [s]; None: once.
        """
        self.ask(StallClock(duration, after, period))

    def place_box(self, name: str, size: ArrayLike, pose: Pose) -> None:
        """Adds a fixed box next to the arm, or moves the box with that name; MuJoCo only.

        Args:
            name: Its name.
            size: Edge lengths along its axes, shape (3,), [m].
            pose: Its centre and orientation in base.
        """
        pose = as_pose(pose)
        position, wxyz = tuple(pose.position.tolist()), tuple(pose.wxyz.tolist())
        self.ask(PlaceBox(name, _numbers(size, 3, "size", "m"), position, wxyz))

    def remove_box(self, name: str) -> None:
        """Removes a box."""
        self.ask(RemoveBox(name))

    def set_floor(self, on: bool = True) -> None:
        """Adds a solid floor under the base, or removes it; MuJoCo only."""
        self.ask(Floor(on))

    def set_walls(self, on: bool = True) -> None:
        """Makes the faces of the active safety box solid for the links; MuJoCo only."""
        self.ask(Walls(on))

    def mount(self, load: Payload | None) -> None:
        """Attaches a physical load to the flange, independent of set_load; None: the load of set_load."""
        if load is None:
            self.ask(Mount())
            return
        inertia = tuple(load.inertia.ravel().tolist())
        self.ask(Mount(load.mass, tuple(load.center_of_mass.tolist()), inertia))

    def place_arm(self, q: ArrayLike) -> None:
        """Places the stationary arm at other joint angles, shape (n,), [rad]; refused while it moves."""
        self.ask(PlaceArm(_joints(q)))

    def set_tool(self, tool: Pose) -> None:
        """Sets the tool as on the teach pendant, by its pose in the flange frame; a session's model keeps its own."""
        self.ask(tool_request(as_pose(tool)))

    def set_load(self, load: Payload) -> None:
        """Sets the load as on the teach pendant; a session's model keeps its own."""
        self.ask(load_request(load))

    def set_box(self, box: SafetyBox) -> None:
        """Sets the safety box as on the teach pendant; an inactive one is not enforced."""
        self.ask(box_request(box))

    def set_soft_limits(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets the soft limits of the joints as on the teach pendant, shape (n,) each, [rad]."""
        self.ask(SetSoftLimits(_joints(lower), _joints(upper)))

    def status(self) -> WorldStatus:
        """Returns the status of the simulation, which is not part of the robot's state."""
        answer = self.ask(GetStatus())
        if not isinstance(answer, WorldStatus):
            raise ProtocolError(f"{self._name}: the response to a status request is {answer}")
        return answer

    def close(self) -> None:
        """Ends the connection; a later call opens a new one. May be called twice."""
        with self._lock:
            self._disconnect()

    def __repr__(self) -> str:
        return "<World at {}:{}>".format(*self._address)

    @property
    def _name(self) -> str:
        return "the simulation port {}:{}".format(*self._address)

    def ask(self, request: WorldRequest) -> WorldAnswer:
        """Returns the response to a request.

        Raises:
            InvalidValueError: A value is not valid; nothing was sent.
            UsageError: The controller refuses; the message contains the reason.
            ConnectionLostError: The simulation port does not exist or does not respond.
        """
        with self._lock:
            self._last_id += 1
            try:
                connection = self._connect()
                connection.sendall(encode_world_request(request, self._last_id))
                answer = self._receive(connection)
            except DecodeError as error:
                self._disconnect()
                raise ConnectionLostError(
                    f"{self._name} does not respond to {request.name} as a virtual controller of this release "
                    f"({error.problem}); check the address"
                ).coded("world_silent") from error
            except (OSError, UnicodeError) as error:  # The latter for a name that no host can have.
                self._disconnect()
                raise ConnectionLostError(
                    f"{self._name} does not respond to {request.name} ({error}); check that the virtual controller "
                    "is running and prints this address after 'world'"
                ).coded("world_silent") from error
            if self._is_refused:
                self._disconnect()
        if isinstance(answer, Refused):
            raise UsageError(plain_text(answer.reason)).coded(answer.code, **answer.facts)
        return answer

    def _connect(self) -> socket.socket:
        if self._socket is not None and _is_closed(self._socket):
            self._disconnect()  # The server closed this idle connection in favour of another client.
        if self._socket is None:
            self._socket = socket.create_connection(self._address, self._timeout)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._reader = LineReader()
        return self._socket

    def _receive(self, connection: socket.socket) -> WorldAnswer:
        deadline = time.monotonic() + self._timeout
        while True:
            if time.monotonic() > deadline:
                raise TimeoutError("it responds to other requests")
            data = connection.recv(65536)
            if not data:
                raise ConnectionResetError("it closed the connection")
            for line in self._reader.feed(data):
                number, answer = decode_world_answer(line)
                self._is_refused = number == 0 and isinstance(answer, Refused)
                if number == self._last_id or self._is_refused:
                    return answer

    def _disconnect(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _is_closed(connection: socket.socket) -> bool:
    """Returns whether the server has closed an idle connection."""
    poll = select.poll()
    poll.register(connection, select.POLLIN)
    return bool(poll.poll(0))


def _numbers(value: ArrayLike, count: int, name: str, unit: str) -> tuple[float, ...]:
    return tuple(as_vector(value, count, name, unit).tolist())


def _joints(value: ArrayLike) -> tuple[float, ...]:
    return tuple(np.asarray(value).ravel().tolist())
