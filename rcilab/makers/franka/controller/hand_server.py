"""The server of the hand, next to that of the arm: its own TCP port, and its own state datagrams."""

from __future__ import annotations

from rcilab.core.errors import DecodeError
from rcilab.makers.franka.controller.hand import RANGES, TEMPERATURE, FrankaHand
from rcilab.makers.franka.wire.gripper import (
    VERSION,
    Grasp,
    HandConnect,
    HandFrameReader,
    HandRequest,
    HandStatus,
    Homing,
    MoveFingers,
    StopFingers,
    decode_hand_request,
    encode_hand_response,
    encode_hand_state,
)
from rcilab.sim.channels import ClientLink, Peer, TcpChannel

HAND_PORT = 1338
_OUTCOMES = {
    HandStatus.SUCCESS: "done",
    HandStatus.FAIL: "failed",
    HandStatus.UNSUCCESSFUL: "no object of this width",
    HandStatus.ABORTED: "aborted by the next command",
}


class HandServer:
    """Serves one client of the hand. Owned by the arm's server.

    Attributes:
        channel: Its TCP channel.
        hand: The fingers.

    Args:
        port: TCP port; 0 takes any free one.
    """

    def __init__(self, port: int) -> None:
        self.channel = TcpChannel(
            name="hand_port", protocol="hand", port=port, open_framer=HandFrameReader, option=None
        )
        self.hand = FrankaHand()
        self._link: ClientLink
        self._peer: Peer | None = None
        self._is_connected = False
        self._message_id = 0
        self._pending: tuple[HandRequest, int] | None = None
        self._ended: HandStatus | None = None  # How the command in progress has ended.

    def attach(self, link: ClientLink) -> None:
        """Sets the link to clients."""
        self._link = link

    def connect(self, peer: Peer) -> None:
        """Accepts a client; states flow after its Connect."""
        self._peer, self._is_connected = peer, False

    def disconnect(self) -> None:
        """Forgets the client; the fingers end what they do."""
        self._peer, self._is_connected, self._pending, self._ended = None, False, None, None

    def receive(self, peer: Peer, frame: bytes) -> None:
        """Handles a request. A command in progress is aborted by the next one."""
        try:
            command_id, request = decode_hand_request(frame)
        except DecodeError as error:
            self._link.drop(peer, f"sent what is no request of the hand: {error}")
            return
        if isinstance(request, HandConnect):
            self._accept(peer, command_id, request)
            return
        if not self._is_connected:
            self._link.drop(peer, "did not begin with Connect")
            return
        self._conclude(HandStatus.ABORTED)
        if isinstance(request, StopFingers):
            self.hand.stop()
            self._pending, self._ended = (request, command_id), HandStatus.SUCCESS
            return
        refusal = self.hand.begin(request)
        if refusal is not None:
            text = f"the hand refused {_describe(request)}: {RANGES}"
            self._link.log("refused", text, request=type(request).__name__, status=refusal.name)
            self._answer(request, command_id, refusal)
        else:
            self._pending = request, command_id

    def step(self) -> None:
        """Advances the fingers by one cycle."""
        status = self.hand.step()
        if status is not None:
            self._ended = status

    def send_state(self) -> None:
        """Sends the state of the hand to its client, then the answer to a command that has ended in it."""
        if self._peer is None or not self._is_connected:
            return
        self._message_id += 1
        hand = self.hand
        state = encode_hand_state(
            self._message_id, hand.width, hand.max_width, is_grasped=hand.is_grasped, temperature=TEMPERATURE
        )
        self._link.send_datagram(state, self._peer)
        if self._ended is not None:
            self._conclude(self._ended)

    def _accept(self, peer: Peer, command_id: int, request: HandConnect) -> None:
        is_known = request.version == VERSION
        if is_known and not self._link.direct_datagrams(peer, request.udp_port):
            self._link.drop(peer, f"asked for states at port {request.udp_port}, which is not valid")
            return
        if not is_known:
            text = f"refused a client of the hand of version {request.version}: this hand has version {VERSION}"
            self._link.log("refused", text, request="Connect")
        self._is_connected = is_known
        status = HandStatus.SUCCESS if is_known else HandStatus.FAIL
        self._link.send_frame(peer, encode_hand_response(request, command_id, status))

    def _conclude(self, status: HandStatus) -> None:
        """Answers the command in progress, if there is one."""
        self._ended = None
        if self._pending is not None:
            (request, command_id), self._pending = self._pending, None
            text = f"the hand: {_describe(request)} ended: {_OUTCOMES[status]}, {1e3 * self.hand.width:.1f} mm open"
            width = round(self.hand.width, 4)
            self._link.log("hand", text, request=type(request).__name__, status=status.name, width=width)
            self._answer(request, command_id, status)

    def _answer(self, request: HandRequest, command_id: int, status: HandStatus) -> None:
        if self._peer is not None:
            self._link.send_frame(self._peer, encode_hand_response(request, command_id, status))


def _describe(request: HandRequest) -> str:
    """Returns a command as the log names it."""
    match request:
        case MoveFingers(width=width, speed=speed):
            return f"a move to {1e3 * width:g} mm at {1e3 * speed:g} mm/s"
        case Grasp(width=width, speed=speed, force=force):
            return f"a grasp of {1e3 * width:g} mm at {1e3 * speed:g} mm/s with {force:g} N"
        case Homing():
            return "a homing"
        case _:
            return "a stop"
