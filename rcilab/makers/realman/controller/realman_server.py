"""The server of the JSON protocol: several TCP clients whose requests are handled in order, and pushed states over UDP.

Every request has one answer, except for streamed commands. The end of a planned motion is an event for the client that
commanded it.
"""

from __future__ import annotations

from collections.abc import Mapping

from rcilab.core.errors import DecodeError, UsageError
from rcilab.makers.realman.bounds import CLIENT_PORT, PUSH_PERIOD
from rcilab.makers.realman.controller import (
    fence_requests,
    frame_requests,
    joint_requests,
    motion_requests,
    program_requests,
    setting_requests,
    state_requests,
)
from rcilab.makers.realman.controller.flash import Flash, flash_file
from rcilab.makers.realman.controller.handler import MOTION_FIELD, Getter, Setter
from rcilab.makers.realman.controller.identity import Generation, require_generation, software_info
from rcilab.makers.realman.controller.push import encode_push
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.controller.stream_requests import STREAMS
from rcilab.makers.realman.controller.trajectories import Trajectory
from rcilab.makers.realman.wire.line import LineReader, Request, decode_request, encode_answer, file_size
from rcilab.sim.channels import ClientLink, Peer, TcpChannel, UdpChannel
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.virtual_arm import VirtualArm

_PROTOCOL = "RealMan's JSON protocol"
_MOST_CLIENTS = 8
_EVENT_DELAY = 10
"""[cycles] The event of a motion comes no earlier behind its answer: a client in single-thread mode that receives both
at once takes the answer only, and waits for the event until its time is over. rcilab's own value."""
_PARTS = (
    joint_requests,
    state_requests,
    frame_requests,
    motion_requests,
    program_requests,
    setting_requests,
    fence_requests,
)
SETTERS: dict[str, Setter] = {name: setter for part in _PARTS for name, setter in getattr(part, "SETTERS", {}).items()}
GETTERS: dict[str, Getter] = {name: getter for part in _PARTS for name, getter in part.GETTERS.items()}


def build_realman_server(arm: VirtualArm, config: ControllerConfig) -> RealManServer:
    """Returns the server of an arm with a configuration."""
    port = CLIENT_PORT if config.port is None else config.port
    flash = Flash(flash_file(arm.model.name, port) if port else None)
    if config.fresh:
        flash.forget()
    return RealManServer(RealManController(arm, flash), port, require_generation(config.generation))


class RealManServer:
    """A `MakerServer` for the JSON protocol.

    Args:
        controller: The controller.
        port: TCP port; 0 takes any free one.
        generation: Of the controller, as its clients see it.
    """

    scheme = "realman"
    patience = 0.0
    clocks_clients = False

    def __init__(self, controller: RealManController, port: int, generation: Generation = 3) -> None:
        self.controller = controller
        self.channels = (
            TcpChannel(protocol=_PROTOCOL, port=port, open_framer=LineReader, max_clients=_MOST_CLIENTS),
            UdpChannel(port=0, target_port=0),
        )
        self._generation: Generation = generation
        self._link: ClientLink
        self._peers: list[Peer] = []
        self._pushed_to: tuple[Peer, int] | None = None
        self._files: dict[Peer, Request] = {}  # Announced, by client.
        self._accepted: dict[Peer, int] = {}  # Cycle of the last accepted motion, by client.
        self._was_in_motion = False
        self._events: list[tuple[int, Peer, Mapping[str, object]]] = []  # With the cycle in which each is sent.
        controller.on_end = self._report_end
        controller.on_log = self._log

    @property
    def is_quiet(self) -> bool:
        """Whether nothing moves and nothing is pushed."""
        controller = self.controller
        return not (
            controller.is_moving
            or controller.program
            or controller.is_dragging
            or controller.settings.push.enable
            or self._events
        )

    def attach(self, link: ClientLink) -> None:
        """Sets the link to clients."""
        self._link = link

    def connect(self, peer: Peer) -> None:
        """Accepts a client."""
        self._peers.append(peer)

    def disconnect(self, peer: Peer) -> bool:
        """Forgets a client and what it has not completed; its motions continue."""
        self._peers.remove(peer)
        self.controller.trajectories.forget(peer)
        self._files.pop(peer, None)
        self._accepted.pop(peer, None)
        self._events = [event for event in self._events if event[1] is not peer]
        if self._pushed_to is not None and self._pushed_to[0] is peer:
            self._pushed_to = None
        return False

    def receive(self, peer: Peer, frame: bytes) -> None:
        """Handles a line, or a file."""
        if peer in self._files:
            request = self._files.pop(peer)
            self._answer(peer, program_requests.receive_program(self.controller, request, frame, peer))
            return
        try:
            request = decode_request(frame)
        except DecodeError as error:
            self._link.log("refused", f"a line was ignored: {error}", request="", status="IGNORED")
            return
        name = request.command
        if name in SETTERS:
            self._set(peer, request, SETTERS[name])
        elif name in STREAMS:
            self._stream(request)
        elif name == "get_arm_software_info":
            self._answer(peer, software_info(self.controller.model.name, self._generation))
        elif name == "run_project":
            self._announce_file(peer, request)
        elif name == "save_trajectory":
            for line in program_requests.recorded_lines(self.controller):
                self._answer(peer, line)
        elif name in GETTERS:
            self._get(peer, request, GETTERS[name])
        else:
            self._link.log("refused", f"{name[:60]!r} is not simulated", request=name[:60], status="UNKNOWN")

    def receive_datagram(self, datagram: bytes) -> bool:
        """Returns False: clients send none."""
        return False

    def step(self, *, is_sent: bool = True) -> None:
        """Advances by one cycle."""
        self.controller.step()
        running = self.controller.program
        event = program_requests.advance_program(self.controller)
        if event is not None and running is not None and running.peer in self._peers:
            self._answer(running.peer, event)
        if self._events:
            self._send_events()
        self._log_motion()

    def send_states(self) -> None:
        """Pushes the state when its period is over."""
        push = self.controller.settings.push
        if not push.enable or self.controller.cycle_number % (PUSH_PERIOD * push.cycle) or not self._peers:
            return
        peer = next((peer for peer in self._peers if peer.address == push.ip), self._peers[0])
        if self._pushed_to != (peer, push.port):
            self._link.direct_datagrams(peer, push.port)
            self._pushed_to = peer, push.port
        self._link.send_datagram(encode_push(self.controller, peer.address))

    def settle(self) -> None:
        """Sends nothing: answers do not wait for a state."""

    def begin_shutdown(self) -> int:
        """Stops the arm; returns for how many cycles states are still sent."""
        self.controller.stop_at_once()
        return 0

    def _set(self, peer: Peer, request: Request, setter: Setter) -> None:
        is_done = True
        try:
            setter.run(self.controller, request, peer)
        except UsageError as error:
            is_done = False
            text = f"{request.command} was refused: {error}"
            self._link.log("refused", text, request=request.command, status="REFUSED")
        else:
            if setter.field == MOTION_FIELD:
                self._accepted[peer] = self.controller.cycle_number
        self._answer(peer, {"command": request.command, setter.field: is_done})

    def _get(self, peer: Peer, request: Request, getter: Getter) -> None:
        try:
            self._answer(peer, getter(self.controller, request))
        except UsageError as error:
            text = f"{request.command} was refused: {error}"
            self._link.log("refused", text, request=request.command, status="REFUSED")
            self._answer(peer, {"command": request.command, "get_state": False})

    def _announce_file(self, peer: Peer, request: Request) -> None:
        is_taken = True
        try:
            file_size(request)
        except UsageError as error:
            is_taken = False
            self._link.log("refused", f"run_project was refused: {error}", request="run_project", status="REFUSED")
        else:
            self._files[peer] = request
        self._answer(peer, {"command": "run_project", "project_state": is_taken})

    def _stream(self, request: Request) -> None:
        try:
            self.controller.require_ready()
            STREAMS[request.command](self.controller, request)
        except UsageError:
            self.controller.ignored += 1

    def _answer(self, peer: Peer, answer: Mapping[str, object]) -> None:
        self._link.send_frame(peer, encode_answer(answer))

    def _report_end(self, trajectory: Trajectory, has_arrived: bool, continues: bool) -> None:
        if trajectory.peer not in self._peers:
            return
        for left in reversed(range(trajectory.commands)):
            event = {
                "state": "current_trajectory_state",
                "trajectory_state": has_arrived,
                "device": 0,
                "trajectory_connect": int(continues or left > 0),
            }
            due = self._accepted.get(trajectory.peer, 0) + _EVENT_DELAY
            self._events.append((due, trajectory.peer, event))

    def _send_events(self) -> None:
        events, self._events = self._events, []
        for due, peer, event in events:
            if due <= self.controller.cycle_number:
                self._answer(peer, event)
            else:
                self._events.append((due, peer, event))

    def _log_motion(self) -> None:
        controller = self.controller
        is_in_motion = controller.arm.is_following and not controller.is_between_motions
        if is_in_motion is not self._was_in_motion:
            self._was_in_motion = is_in_motion
            if is_in_motion:
                self._link.log("motion_started", "motion started")
            else:
                self._link.log("motion_ended", f"motion ended; the arm is {controller.phase_name}")

    def _log(self, kind: str, text: str) -> None:
        self._link.log(kind, text)
