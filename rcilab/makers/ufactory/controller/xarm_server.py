"""The server of the xArm interface: many clients on the control port, and reports on four others."""

from __future__ import annotations

from pathlib import Path
from traceback import extract_tb

from rcilab.core.errors import DecodeError
from rcilab.makers.ufactory.bounds import CLIENT_PORT
from rcilab.makers.ufactory.controller.modbus_memory import ModbusRegisters
from rcilab.makers.ufactory.controller.modes import Mode, State
from rcilab.makers.ufactory.controller.reporter import encode_report
from rcilab.makers.ufactory.controller.request_handlers import Reply, RequestHandlers
from rcilab.makers.ufactory.controller.tasks import Tasks
from rcilab.makers.ufactory.controller.xarm_controller import TaskEvent, XArmController
from rcilab.makers.ufactory.errors import UfactoryWarning
from rcilab.makers.ufactory.wire.frame import (
    HEARTBEAT,
    MODBUS,
    STATUS_ERROR,
    STATUS_INVALID,
    STATUS_NOT_READY,
    STATUS_WARNING,
    Feedback,
    Frame,
    FrameReader,
    decode_frame,
    encode_feedback,
    encode_modbus_response,
    encode_response,
)
from rcilab.makers.ufactory.wire.functions import Function, decode_payload
from rcilab.makers.ufactory.wire.identity import IDENTITIES
from rcilab.makers.ufactory.wire.modbus import ModbusException, answer_modbus, refuse_modbus
from rcilab.makers.ufactory.wire.refused_answers import refused_payload
from rcilab.makers.ufactory.wire.reports import REPORTS, ReportLayout
from rcilab.makers.ufactory.wire.unix_sockets import unix_socket_path
from rcilab.sim.channels import ClientLink, Peer, TcpChannel
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.virtual_arm import VirtualArm

_PROTOCOL = "xArm protocol"
_MOST_CLIENTS = 16  # Of one port; a tuning value.
_STREAM_SILENCE = 1000  # Cycles without a motion after which a stream has ended in the log; a tuning value.
_NOT_READY = (State.STOPPED, State.CHANGED)
_FUNCTIONS = frozenset(Function)


def build_xarm_server(arm: VirtualArm, config: ControllerConfig) -> XArmServer:
    """Returns the server of an arm with a configuration."""
    controller = XArmController(arm)
    return XArmServer(controller, CLIENT_PORT if config.port is None else config.port)


class XArmServer:
    """A `MakerServer` for the xArm interface.

    Args:
        controller: The controller.
        port: TCP port for commands; 0 takes any free one, and for the reports, too.
    """

    scheme = "xarm"
    patience = 0.0
    clocks_clients = False

    def __init__(self, controller: XArmController, port: int) -> None:
        self.controller = controller
        main = TcpChannel(
            protocol=_PROTOCOL,
            port=port,
            open_framer=FrameReader,
            max_clients=_MOST_CLIENTS,
            socket_path=_socket_path(port),
        )
        self._reports = {_report_channel(layout, 0 if port == 0 else layout.port): layout for layout in REPORTS}
        self.channels = (main, *self._reports)
        self._identity = IDENTITIES[controller.model.name]
        self._tasks = Tasks(self._send_feedback)
        self._handlers = RequestHandlers(controller, self._identity, self._tasks, self._log_refusal)
        self._registers = ModbusRegisters(controller)
        self._link: ClientLink
        self._clients: set[Peer] = set()
        self._stream_end: int | None = None  # Cycle at which a silent stream has ended.
        self._listeners: dict[ReportLayout, list[Peer]] = {layout: [] for layout in REPORTS}
        controller.on_task = self._handle_task
        controller.on_state = self._log_state

    @property
    def is_quiet(self) -> bool:
        """Whether nothing moves."""
        return not self.controller.is_moving

    def attach(self, link: ClientLink) -> None:
        """Sets the link to clients."""
        self._link = link

    def connect(self, peer: Peer) -> None:
        """Accepts a client; one of a report port gets its first report at once."""
        layout = self._reports.get(peer.channel)
        if layout is None:
            self._clients.add(peer)
            return
        self._listeners[layout].append(peer)
        self._link.send_frame(peer, encode_report(self.controller, self._identity, layout))

    def disconnect(self, peer: Peer) -> bool:
        """Forgets a client; what it has commanded continues."""
        layout = self._reports.get(peer.channel)
        if layout is not None:
            self._listeners[layout].remove(peer)
        else:
            self._clients.discard(peer)
            self._tasks.forget(peer)
            self._handlers.feedback.pop(peer, None)
        return False

    def receive(self, peer: Peer, frame: bytes) -> None:
        """Handles a request and answers it."""
        request = decode_frame(frame)
        if request.protocol == HEARTBEAT:
            return
        is_modbus = request.protocol == MODBUS
        try:
            response = self._answer_modbus(request) if is_modbus else self._answer(peer, request)
        except Exception as error:  # The controller outlives a request of one client that it does not expect.
            self._log_failure(request, error)
            if is_modbus:
                response = encode_modbus_response(request, refuse_modbus(request.payload, ModbusException.DEVICE))
            else:
                reply = Reply(refused_payload(request.function), is_invalid=True)
                response = encode_response(request, self._status(reply), reply.payload)
        self._link.send_frame(peer, response)

    def receive_datagram(self, datagram: bytes) -> bool:
        """Returns False: the interface has none."""
        return False

    def step(self, *, is_sent: bool = True) -> None:
        """Advances by one cycle."""
        self.controller.step()
        self._handlers.io.step()
        if self._stream_end is not None and self.controller.cycle_number >= self._stream_end:
            self._log_end(self.controller.shown_state)

    def send_states(self) -> None:
        """Sends the reports that are due."""
        cycle = self.controller.cycle_number
        for layout, peers in self._listeners.items():
            if peers and cycle % layout.period == 0:
                report = encode_report(self.controller, self._identity, layout)
                for peer in tuple(peers):
                    self._link.send_frame(peer, report)

    def settle(self) -> None:
        """Does nothing: every request is answered at once."""

    def begin_shutdown(self) -> int:
        """Ends what moves."""
        self.controller.set_state(4)
        return 0

    def _answer_modbus(self, request: Frame) -> bytes:
        return encode_modbus_response(request, answer_modbus(request.payload, self._registers))

    def _answer(self, peer: Peer, request: Frame) -> bytes:
        reply = self._handle(peer, request)
        return encode_response(request, self._status(reply), reply.payload)

    def _handle(self, peer: Peer, request: Frame) -> Reply:
        refuse = self._handlers.refuse
        if request.function not in _FUNCTIONS:
            refuse(f"function {request.function}", UfactoryWarning.UNKNOWN_COMMAND, "it is not simulated")
            return Reply(refused_payload(request.function))
        function = Function(request.function)
        try:
            values = decode_payload(function, request.payload)
        except DecodeError as error:
            refuse(function.name, UfactoryWarning.PARAMETER, error.problem)
            return Reply(refused_payload(function), is_invalid=True)
        return self._handlers.handle(peer, request, function, values)

    def _status(self, reply: Reply) -> int:
        controller = self.controller
        status = STATUS_INVALID if reply.is_invalid else 0
        if reply.is_refused or (controller.shown_state in _NOT_READY and not reply.is_setting):
            status |= STATUS_NOT_READY
        if controller.error is not None:
            status |= STATUS_ERROR
        return status | (STATUS_WARNING if controller.warning is not None else 0)

    def _handle_task(self, event: TaskEvent) -> None:
        self._tasks.handle(event, 1000 * self.controller.cycle_number)

    def _send_feedback(self, peer: Peer, feedback: Feedback) -> None:
        if peer in self._clients:
            self._link.send_frame(peer, encode_feedback(feedback._replace(status=self._status(Reply()))))

    def _log_refusal(self, name: str, reason: str) -> None:
        self._link.log("refused", f"{name} was refused: {reason}", request=name)

    def _log_failure(self, request: Frame, error: Exception) -> None:
        *_, place = extract_tb(error.__traceback__)
        where = f"{Path(place.filename).name}, line {place.lineno}"
        text = f"a request failed inside the controller ({type(error).__name__}: {error}; {where})"
        self._link.log("warning", f"{text}; report it with these bytes: {request.function} {request.payload.hex(' ')}")

    def _log_state(self, before: State, after: State) -> None:
        controller = self.controller
        if after is State.MOVING:
            if self._stream_end is None:
                self._link.log("motion_started", f"motion started in mode {controller.mode.value}")
            self._stream_end = None
        elif before is State.MOVING and after is State.READY and controller.mode is Mode.SERVO:
            self._stream_end = controller.cycle_number + _STREAM_SILENCE
        elif before is State.MOVING or self._stream_end is not None:
            self._log_end(after)

    def _log_end(self, state: State) -> None:
        self._stream_end = None
        self._link.log("motion_ended", f"motion ended; the state is {state.value} ({state.name.lower()})")


def _report_channel(layout: ReportLayout, port: int) -> TcpChannel:
    return TcpChannel(
        name=f"report_{layout.port}",
        protocol="reports",
        port=port,
        default_port=layout.port,
        max_clients=_MOST_CLIENTS,
        socket_path=_socket_path(port),
    )


def _socket_path(port: int) -> Path | None:
    """Returns where clients look for a Unix-domain socket; None for a port that they do not know."""
    return unix_socket_path(port) if port else None
