"""The server of the FCI: one TCP client whose requests are handled in order, commands and states over UDP.

A client begins with Connect, which names its version and its UDP port; states flow from then on. Move has two answers,
at the beginning and at the end of the motion, with one id.
"""

from __future__ import annotations

from typing import NamedTuple

from rcilab.core.errors import DecodeError, InvalidValueError, ModelError, UsageError
from rcilab.makers.franka.bounds import CLIENT_PORT
from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.controller.hand_server import HAND_PORT, HandServer
from rcilab.makers.franka.controller.model_library import build_model_library, runs_here
from rcilab.makers.franka.controller.phases import REASONS, Phase
from rcilab.makers.franka.controller.robot_model import build_robot_model
from rcilab.makers.franka.wire.command_packet import decode_command
from rcilab.makers.franka.wire.frame import (
    NO_WALL,
    FrameReader,
    decode_header,
    decode_request,
    encode_connect_response,
    encode_response,
)
from rcilab.makers.franka.wire.requests import (
    SETTERS,
    AutomaticErrorRecovery,
    Connect,
    GetCartesianLimit,
    GetRobotModel,
    LoadModelLibrary,
    Move,
    Request,
    StopMove,
)
from rcilab.makers.franka.wire.state_packet import encode_state
from rcilab.makers.franka.wire.versions import VERSION_5, VERSION_10, FciVersion, Status
from rcilab.robots import RobotDescription
from rcilab.sim.channels import ClientLink, Peer, TcpChannel, UdpChannel
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.phase_log import PhaseLog
from rcilab.sim.virtual_arm import VirtualArm

_PROTOCOL = "FCI"
_PRESSED = "the user stop was pressed: the arm stops"
_DUE_TO_PHASE = (Status.NOT_POSSIBLE, Status.EMERGENCY_ABORTED, Status.ABORTED)
_RECOVERY_ENDS = {Phase.IDLE: Status.SUCCESS, Phase.USER_STOPPED: Status.EMERGENCY_ABORTED}
_VERSIONS = {"Panda": VERSION_5, "FR3": VERSION_10}
"""The version of each arm's controller."""


def build_fci_server(arm: VirtualArm, config: ControllerConfig) -> FciServer:
    """Returns the FCI server of an arm with a configuration.

    Raises:
        UsageError: The arm is to listen on the port of the hand.
    """
    if config.port == HAND_PORT:
        raise UsageError(f"--port {HAND_PORT} is where clients expect the hand; choose another port for the arm")
    version = _VERSIONS[arm.model.name]
    # Its clients filter and limit their commands against q_d of the state, which a delay would make unstable.
    arm.set_prefill(0 if config.prefill is None else config.prefill)
    controller = FciController(arm, version)
    if config.limit_table is not None:
        controller.limit_table = config.limit_table
    return FciServer(controller, CLIENT_PORT if config.port is None else config.port, config.udp_port)


class _Models(NamedTuple):
    """What clients get as the model of the arm; made before the first cycle, because it takes longer than one."""

    urdf: bytes
    library: bytes
    """Empty in version 10, or where it cannot be compiled."""
    problem: str
    """Why it cannot be."""

    @classmethod
    def of(cls, description: RobotDescription, version: FciVersion) -> _Models:
        """Returns the models of an arm."""
        urdf = build_robot_model(description).encode()
        if LoadModelLibrary not in version.commands:
            return cls(urdf, b"", "")
        try:
            return cls(urdf, build_model_library(description), "")
        except ModelError as error:
            return cls(urdf, b"", str(error))


class FciServer:
    """A `MakerServer` for the FCI.

    Args:
        controller: The controller.
        port: TCP port; 0 takes any free one.
        udp_port: For commands; None: any free one.
    """

    scheme = "fci"
    patience = 0.02  # [s] A soft lock-step: clients on ordinary kernels jitter by milliseconds.
    clocks_clients = True

    def __init__(self, controller: FciController, port: int, udp_port: int | None = None) -> None:
        self.controller = controller
        self.channels = (
            TcpChannel(protocol=_PROTOCOL, port=port, open_framer=FrameReader),
            UdpChannel(port=0 if udp_port is None else udp_port, target_port=0, is_state_port_only=True),
        )
        self._hand = HandServer(HAND_PORT if port else 0)
        self.channels = (*self.channels, self._hand.channel)
        self._models = _Models.of(controller.model.description, controller.version)
        self._link: ClientLink
        self._peer: Peer | None = None
        self._version: FciVersion | None = None
        self._move: tuple[type[Request], int] | None = None  # Waits for the end of its motion.
        self._recovery: int | None = None  # Id of the request.

    @property
    def is_quiet(self) -> bool:
        """Whether nothing moves and no answer is deferred."""
        return self.controller.phase is Phase.IDLE and self._move is None and self._recovery is None

    def attach(self, link: ClientLink) -> None:
        """Sets the link to clients."""
        self._link = link
        self._hand.attach(link)
        log = PhaseLog(self.controller.playout, link.log, pressed=_PRESSED, released="the user stop was released")
        self.controller.on_transition = log.record

    def connect(self, peer: Peer) -> None:
        """Accepts a client; states flow after its Connect."""
        if peer.channel is self._hand.channel:
            self._hand.connect(peer)
        else:
            self._peer, self._version = peer, None

    def disconnect(self, peer: Peer) -> bool:
        """Stops the arm, or the fingers; returns whether this ends a motion of the arm."""
        if peer.channel is self._hand.channel:
            self._hand.disconnect()
            return False
        self._peer = self._version = self._move = self._recovery = None
        return self.controller.lose_client()

    def receive(self, peer: Peer, frame: bytes) -> None:
        """Handles a request."""
        if peer.channel is self._hand.channel:
            self._hand.receive(peer, frame)
            return
        header = decode_header(frame)
        try:
            request = decode_request(frame, self._version)
        except DecodeError as error:
            self._link.drop(peer, f"sent what is no request of the FCI: {error}")
            return
        if isinstance(request, Connect):
            self._accept(peer, header.command_id, request)
        else:
            self._handle(peer, header.command_id, request)

    def receive_datagram(self, datagram: bytes) -> bool:
        """Passes a command on; returns whether it is well formed."""
        if self._version is None:
            return False
        try:
            packet = decode_command(datagram, self._version)
        except DecodeError as error:
            self._link.log("bad_datagram", f"ignored a datagram: {error}", size=len(datagram))
            return False
        self.controller.receive(packet)
        return True

    def step(self, *, is_sent: bool = True) -> None:
        """Advances by one cycle."""
        self.controller.step(is_sent=is_sent)
        self._hand.step()

    def send_states(self) -> None:
        """Sends the last state."""
        if self._version is not None:
            self._link.send_datagram(encode_state(self.controller.packet, self._version))
            self.controller.count_sent_state()
        self._hand.send_state()

    def settle(self) -> None:
        """Sends the answers that the state just sent has made due."""
        if self._peer is None or self._version is None:
            return
        outcome = self.controller.outcome
        if self._move is not None and outcome is not None:
            kind, command_id = self._move
            self._move = self.controller.outcome = None
            self._send_answer(kind, command_id, outcome)  # Not a refusal: the end of the motion is in the log.
        if self._recovery is not None and self.controller.phase is not Phase.RECOVERING:
            command_id, self._recovery = self._recovery, None
            status = _RECOVERY_ENDS.get(self.controller.phase, Status.ABORTED)
            self._answer(AutomaticErrorRecovery, command_id, status)

    def begin_shutdown(self) -> int:
        """Ends a motion in progress; returns for how many cycles states are still sent."""
        self.controller.stop_move()
        return 0

    def _accept(self, peer: Peer, command_id: int, request: Connect) -> None:
        version = self.controller.version
        if request.version != version.number:
            self._link.send_frame(peer, encode_connect_response(command_id, Status.INCOMPATIBLE, version.number))
            text = f"refused a client of version {request.version}: this arm has version {version.number} of the FCI"
            phase = self.controller.phase_name
            self._link.log("refused", text, request="Connect", status=Status.INCOMPATIBLE.name, phase=phase)
            return
        if not self._link.direct_datagrams(peer, request.udp_port):
            self._link.drop(peer, f"asked for states at port {request.udp_port}, which is not valid")
            return
        self._version = version
        self._link.send_frame(peer, encode_connect_response(command_id, Status.SUCCESS, version.number))

    def _handle(self, peer: Peer, command_id: int, request: Request) -> None:
        controller, kind = self.controller, type(request)
        match request:
            case Move():
                status, why = self._begin_move(request)
                if status is Status.MOTION_STARTED:
                    self._move = kind, command_id
                self._answer(kind, command_id, status, why)
            case StopMove():
                self._answer(kind, command_id, controller.stop_move())
            case AutomaticErrorRecovery():
                found = controller.begin_recovery()
                if found is None:
                    self._recovery = command_id
                else:
                    self._answer(kind, command_id, found)
            case GetRobotModel():
                self._answer(kind, command_id, Status.SUCCESS, content=self._models.urdf)
            case LoadModelLibrary(architecture=architecture, system=system):
                self._send_library(command_id, architecture, system)
            case GetCartesianLimit():
                self._answer(kind, command_id, Status.SUCCESS, content=NO_WALL)
            case _ if kind in SETTERS:
                status, why = controller.set(request)
                self._answer(kind, command_id, status, why)
            case _:
                self._link.drop(peer, f"sent {kind.__name__} in the wrong place")

    def _begin_move(self, request: Move) -> tuple[Status, str]:
        try:
            return self.controller.begin_move(request), ""
        except InvalidValueError as error:
            return Status.INVALID_ARGUMENT, str(error)

    def _send_library(self, command_id: int, architecture: int, system: int) -> None:
        models = self._models
        why = models.problem if runs_here(architecture, system) else "the client's machine is of another kind"
        status = Status.ERROR if why else Status.SUCCESS
        self._answer(LoadModelLibrary, command_id, status, why, content=models.library)

    def _answer(
        self, kind: type[Request], command_id: int, status: Status, why: str = "", *, content: bytes = b""
    ) -> None:
        self._send_answer(kind, command_id, status, content)
        if status in (Status.SUCCESS, Status.MOTION_STARTED):
            return
        phase, name = self.controller.phase, "Move" if issubclass(kind, Move) else kind.__name__
        why = why or (REASONS.get(phase, "") if status in _DUE_TO_PHASE else "")
        text = f"{name} was answered: {status.value}" + (f"; {why}" if why else "")
        self._link.log("refused", text, request=name, status=status.name, phase=self.controller.phase_name)

    def _send_answer(self, kind: type[Request], command_id: int, status: Status, content: bytes = b"") -> None:
        assert self._peer is not None
        assert self._version is not None
        content = content if status is Status.SUCCESS else b""
        self._link.send_frame(self._peer, encode_response(self._version, kind, command_id, status, content))
