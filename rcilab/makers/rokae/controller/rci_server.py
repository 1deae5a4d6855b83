"""The server of the RCI: one TCP client whose requests are handled in order, commands and states over UDP.

An answer may be deferred to the next state or until the arm is at standstill; later requests are then deferred, too.
"""

from __future__ import annotations

from collections import deque

from rcilab.core.errors import DecodeError
from rcilab.i18n.translator import Remark
from rcilab.makers.rokae.bounds import DEFAULT_PORT
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.makers.rokae.controller.request_handlers import Reply
from rcilab.makers.rokae.controller.state_machine import Event, Phase, When
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.wire import (
    COMMAND_SIZE,
    Connect,
    FrameReader,
    Request,
    decode_command,
    decode_request,
    encode_response,
)
from rcilab.sim.channels import ClientLink, Peer, TcpChannel, UdpChannel
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.phase_log import PhaseLog
from rcilab.sim.virtual_arm import VirtualArm

SHUTDOWN_NOTICE = 20  # [cycles] For which states are still sent after the end of a motion, with the error bit.
_PROTOCOL = "RCI"
_OTHER_VERSION = "the client may have another version"
_PRESSED = "a safety stop was pressed: the motors are off"
_RELEASED = "the safety stop was released; the motors stay off"
_QUIET = (Phase.OFF, Phase.IDLE)
_ACTIVE = (Phase.MOVING, Phase.GUIDING)
"""Not STOPPING: its motion was ended by StopMove, after which the vendor's client may close the connection at once."""


def build_rci_server(arm: VirtualArm, config: ControllerConfig) -> RciServer:
    """Returns the RCI server of an arm with a configuration."""
    joints = arm.model.description.imperfections
    controller = RciController(
        arm,
        mode_delay=config.mode_delay_cycles,
        force_sign=config.force_sign or "on-arm",
        coulomb=[joint.friction for joint in joints] if joints and config.realism == "real" else None,
    )
    controller.auto_limit = config.auto_limit
    if config.limit_table is not None:
        controller.limit_table = config.limit_table
    port = DEFAULT_PORT if config.port is None else config.port
    return RciServer(controller, port, config.udp_port, config.client_port)


class RciServer:
    """A `MakerServer` for the RCI.

    Args:
        controller: The controller.
        port: TCP port; 0 takes any free one.
        udp_port: For commands; None: the same number, as the vendor's client expects it.
        client_port: Port for states; None: the same number.
    """

    scheme = "rci"
    patience = 0.0  # A real controller does not wait, and --prefill absorbs jitter.
    clocks_clients = True

    def __init__(self, controller: RciController, port: int, udp_port: int | None, client_port: int | None) -> None:
        self.controller = controller
        self.channels = (
            TcpChannel(protocol=_PROTOCOL, port=port, open_framer=FrameReader),
            UdpChannel(port=udp_port, target_port=client_port),
        )
        self._n = controller.model.n
        self._link: ClientLink
        self._peer: Peer | None = None
        self._frames: deque[bytes] = deque()
        self._pending: tuple[Request, int, Reply] | None = None
        self._pending_since = 0  # Number of the last state before the deferred request.

    @property
    def is_quiet(self) -> bool:
        """Whether nothing moves and no answer is deferred."""
        return self.controller.phase in _QUIET and self._pending is None

    def attach(self, link: ClientLink) -> None:
        """Sets the link to clients."""
        self._link = link
        log = PhaseLog(self.controller.playout, link.log, pressed=_PRESSED, released=_RELEASED)
        self.controller.on_transition = log.record

    def connect(self, peer: Peer) -> None:
        """Accepts a client and sends a state first: the vendor's client waits for it for a few milliseconds."""
        self._peer = peer
        self.send_states()

    def disconnect(self, peer: Peer) -> bool:
        """Stops the arm; returns whether this ends a motion or hand guiding."""
        was_moving = self.controller.phase in _ACTIVE
        self._peer = None
        self._frames.clear()
        self._pending = None
        self.controller.on_event(Event.CLIENT_LOST)
        return was_moving

    def receive(self, peer: Peer, frame: bytes) -> None:
        """Queues a request and handles it after the earlier ones."""
        self._frames.append(frame)
        self._serve(peer)

    def receive_datagram(self, datagram: bytes) -> bool:
        """Passes a command on; returns whether it has the correct size."""
        size = len(datagram)
        if size != COMMAND_SIZE:
            expected = f"a command of this {_PROTOCOL} has {COMMAND_SIZE}"
            text = f"ignored a datagram of {size} bytes: {expected}; {_OTHER_VERSION}"
            self._link.log("bad_datagram", text, size=size, expected=COMMAND_SIZE)
            return False
        self.controller.receive(decode_command(datagram, self._n))
        return True

    def step(self, *, is_sent: bool = True) -> None:
        """Advances by one cycle."""
        self.controller.step(is_sent=is_sent)

    def send_states(self) -> None:
        """Sends the last state."""
        self._link.send_datagram(self.controller.datagram)

    def settle(self) -> None:
        """Sends the deferred answer if it is due, and continues with the next requests."""
        if self._pending is not None and self._is_due(self._pending[2].when):
            deferred, self._pending = self._pending, None
            assert self._peer is not None
            self._answer(self._peer, *deferred)
            self._serve(self._peer)

    def begin_shutdown(self) -> int:
        """Ends a motion in progress; returns for how many cycles states with the error bit are still sent."""
        if self.controller.phase is not Phase.MOVING:
            self.controller.on_event(Event.CLIENT_LOST)
            return 0
        self.controller.reason = Remark("the controller was ended during a motion", "told_to_end")
        self.controller.on_event(Event.FAULT, Fault.INSTABILITY_DETECTION)
        return SHUTDOWN_NOTICE

    def _is_due(self, when: When) -> bool:
        is_shown = self.controller.state.message_id > self._pending_since
        return is_shown and (when is When.SHOWN or self.controller.is_settled)

    def _serve(self, peer: Peer) -> None:
        """Handles requests in order, up to one whose answer is deferred."""
        while self._frames and self._pending is None:
            frame = self._frames.popleft()
            try:
                command_id, request = decode_request(frame)
            except DecodeError as error:
                self._frames.clear()
                self._link.drop(peer, f"sent bytes that are not valid {_PROTOCOL}: {error}; {_OTHER_VERSION}")
                return
            reply = self.controller.handle(request)
            self._log_refusal(request, reply)
            if isinstance(request, Connect):
                self._link.direct_datagrams(peer, request.udp_port)
            # An answer is sent when its effect is visible: after a deferred answer, every state has the new mode.
            if reply.when is When.NOW:
                self._answer(peer, request, command_id, reply)
            else:
                self._pending, self._pending_since = (request, command_id, reply), self.controller.state.message_id

    def _answer(self, peer: Peer, request: Request, command_id: int, reply: Reply) -> None:
        due = self.controller.conclude(request, reply)
        if due is not reply:
            self._log_refusal(request, due)
        self._link.send_frame(peer, encode_response(request.code, command_id, due.response))
        if reply.ends_connection:
            self._link.drop(peer, "requested a reboot")

    def _log_refusal(self, request: Request, reply: Reply) -> None:
        if reply.refusal:
            status = getattr(reply.response, "status", None)
            facts = {"request": type(request).__name__, "phase": self.controller.phase_name}
            self._link.log("refused", reply.refusal, status=getattr(status, "name", ""), **facts)
