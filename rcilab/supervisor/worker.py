"""The main of the control process: one thread, one connection, one loop.

It reads states, writes every cycle into the shared ring, takes requests from the mailbox and streams motions. It
imports nothing that draws. Started by the supervisor as `python -m rcilab.supervisor.worker --block FD`.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from rcilab.awake import awake_cores
from rcilab.client.address import parse_address
from rcilab.client.commands import RciCommands
from rcilab.client.control_loop import Callback, ControlLoop
from rcilab.client.filters import RateLimiter
from rcilab.client.link import Link
from rcilab.client.opening import await_first_state, require_arm_there
from rcilab.client.punctual import PRIORITY
from rcilab.client.recorder import CycleLog
from rcilab.client.recovery import recover
from rcilab.client.setup import give_setup
from rcilab.client.start_check import describe_start_mismatch
from rcilab.client.streaming import MotionStream
from rcilab.client.transport import SocketTransport
from rcilab.clock import CYCLE_TIME
from rcilab.errors import ConnectionLostError, ControlError, InvalidValueError, ModelError, RcilabError, UsageError
from rcilab.model import load_model
from rcilab.motion import plan_stop
from rcilab.protocols.rci import STATE_SIZE
from rcilab.realtime import enter_realtime
from rcilab.spatial import Pose
from rcilab.state import ControllerMode, Mode, RobotMode, RobotState
from rcilab.supervisor.failure import pack_failure
from rcilab.supervisor.guiding import HandGuide
from rcilab.supervisor.jogging import HeldJog
from rcilab.supervisor.layout import OPERATOR_TIMEOUT, ControlBlock, Word
from rcilab.supervisor.mailbox import Mailbox
from rcilab.supervisor.publisher import Publisher
from rcilab.supervisor.settings import parse_settings
from rcilab.supervisor.setup_letter import parse_setup
from rcilab.supervisor.status import MESSAGES, Phase

SILENCE = 0.3  # [s] without a state while idle before the connection counts as lost; a choice below half a second.
LONGEST_PAUSE = 120_000  # Cycles that a motion is held for before it is given up; a choice: every cycle is recorded.
_LOOK = 0.02  # [s] Longest wait in the idle loop.


class StoppedError(ControlError):
    """A motion was brought to rest before its end, because somebody wanted it so."""


class Worker:
    """The control process's state. Everything here belongs to its one thread.

    Args:
        block: The shared block.
        parent: Process id of the supervisor, without which it ends. Told, since it may be gone before we look.
    """

    def __init__(self, block: ControlBlock, parent: int) -> None:
        self._block = block
        self._words = block.words
        self._settings = parse_settings(block.settings)
        self._inbox = Mailbox(block.requests, block.words, Word.REQUESTS_POSTED, Word.REQUESTS_TAKEN)
        self._outbox = Mailbox(block.replies, block.words, Word.REPLIES_POSTED, Word.REPLIES_TAKEN)
        self._publisher = Publisher(block)
        self._log = CycleLog(self._publisher.recorder, self._publisher.on_row)
        self._stops_seen = self._words[Word.STOPS_ASKED]
        self._parent = parent
        self._link: Link | None = None
        self._address = ""
        self._is_ending = False
        self._deferred: list[dict[str, Any]] = []
        self._model = load_model(self._settings.name, tool=self._settings.T_flange_tool)
        self._jog: HeldJog | None = None
        self._guide: HandGuide | None = None
        self._stream: MotionStream | None = None
        self._mode: Mode = "joint_position"
        self._softly: str | None = None  # Why a motion in torques is being brought to rest.

    def run(self) -> int:
        """Lives until asked to end or until the supervisor is gone; returns the exit code."""
        plan_stop(
            self._settings.limits.joint,
            np.zeros(self._settings.n),
            np.full(self._settings.n, 0.1),
            np.zeros(self._settings.n),
        )  # The first one loads the planner; the next one must be quick.
        granted = enter_realtime(PRIORITY)
        self._publisher.update(is_fifo=granted.policy == "SCHED_FIFO", memory_locked=granted.memory_locked)
        if granted.warning:
            print(granted.warning, file=sys.stderr, flush=True)
        try:
            while not self._is_ending and os.getppid() == self._parent:
                self._publisher.beat()
                self._listen()
                self._serve()
                self._mind_guiding()
        finally:
            self._disconnect()
        return 0

    def _listen(self) -> None:
        """Takes in what the robot says while nothing moves."""
        if self._link is None:
            time.sleep(_LOOK)
            return
        states = self._link.poll(_LOOK)
        self._record(states)
        if states:
            self._show_state(states[-1])
        elif time.monotonic_ns() - self._link.received_ns > SILENCE * 1e9:
            self._say("lost", "lost.silent", address=self._address)

    def _record(self, states: list[RobotState]) -> None:
        self._publisher.beat()
        for state in states:
            assert self._link is not None
            self._log.write(state, self._link.received_ns)

    def _show_state(self, state: RobotState) -> None:
        """Keeps the phase in step with what the robot reports while nothing moves."""
        phase = self._publisher.snapshot.phase
        if state.robot_mode is RobotMode.USER_STOPPED and self._publisher.snapshot.powered:
            self._publisher.update(powered=False)  # The emergency stop, or the gate, has taken it.
            self._say_ready()
        with suppress(InvalidValueError):  # A controller may report no pose before it is ready.
            flange = self._model.pose(state.q_c, "flange")
            self._publisher.show_tool(flange.inverse() @ Pose.from_matrix(state.T_base_tool_c))
        if self._guide is not None and self._guide.has_ended(state):
            self._guide = None
            self._say_ready()
        elif state.faults:
            if phase != "fault":
                self._say("fault", "fault", faults=_names(state.faults))
        elif phase in ("fault", "lost"):
            self._say_ready()

    def _serve(self) -> None:
        while (request := self._deferred.pop(0) if self._deferred else self._inbox.take()) is not None:
            handler: Callable[[dict[str, Any]], None] = getattr(self, f"_do_{request['kind']}")
            try:
                handler(request)
            except RcilabError as error:
                self._fail(request, error)
            except Exception as error:
                self._fail(request, error)
                raise
            else:
                self._outbox.post({"id": request["id"]})

    def _fail(self, request: dict[str, Any], error: Exception) -> None:
        if isinstance(error, StoppedError):
            pass  # Said already.
        elif isinstance(error, ConnectionLostError) or (request["kind"] == "connect" and self._link is None):
            self._disconnect()
            code = "lost.other_arm" if isinstance(error, ModelError) else "lost.unreachable"
            self._say("lost", code, error=str(error))
        elif isinstance(error, ControlError) and error.faults:
            self._say("fault", "fault", faults=_names(error.faults))
        elif self._link is not None and self._guide is None:
            self._say("idle", "idle.failed", error=str(error))
        self._outbox.post({"id": request["id"], "failure": pack_failure(error)})

    def _do_connect(self, request: dict[str, Any]) -> None:
        self._disconnect()
        self._address = request["address"]
        self._say("connecting", "connecting", address=self._address)
        place = parse_address(self._address)
        transport = SocketTransport(place, STATE_SIZE, request["timeout"])
        try:
            link = Link(transport, self._settings.n, str(place), request["timeout"])
            require_arm_there(RciCommands(link), self._settings.name, self._settings.lengths, str(place))
            await_first_state(link, place, transport.local_address, request["timeout"])
        except BaseException:
            transport.close()
            raise
        self._link = link
        link.on_states = self._record
        self._log.restart()
        self._publisher.restart()
        self._commands = RciCommands(link, self._settings.limits)
        self._learn_power()
        self._do_set_up(request)

    def _do_set_up(self, request: dict[str, Any]) -> None:
        self._require_link()
        setup = parse_setup(request["setup"])
        self._model = setup.applied_to(self._model)
        give_setup(self._commands, setup)
        self._say_ready()

    def _do_power(self, request: dict[str, Any]) -> None:
        self._require_link()
        self._commands.set_motor_power(request["on"])
        self._learn_power()
        self._say_ready()

    def _do_recover(self, request: dict[str, Any]) -> None:
        recover(self._commands, self._require_link())
        self._learn_power()
        self._say_ready()

    def _do_stop(self, request: dict[str, Any]) -> None:
        # Served in its turn, so what it was meant for stands still by now; see `_watch`.
        self._stops_seen = request["number"]
        self._end_guiding("idle.stopped")

    def _do_start_guiding(self, request: dict[str, Any]) -> None:
        self._require_link()
        guide = HandGuide(self._commands)
        guide.start(request["space"], request["type"])
        self._guide = guide
        self._publisher.begin_motion(None)
        self._say("moving", "moving.guided")

    def _do_stop_guiding(self, request: dict[str, Any]) -> None:
        self._end_guiding("idle.guided")

    def _mind_guiding(self) -> None:
        """Ends hand guiding once nobody is at the controls any more."""
        if self._guide is None or not self._is_operator_gone():
            return
        try:
            self._end_guiding("idle.operator", seconds=OPERATOR_TIMEOUT)
        except RcilabError as error:  # Whatever it was, the states that follow tell where the arm is.
            self._say("idle", "idle.failed", error=str(error))

    def _end_guiding(self, code: str, **facts: Any) -> None:
        """Ends hand guiding, where there is any, and returns once the arm is at rest."""
        guide, self._guide = self._guide, None
        if guide is not None:
            self._say("stopping", "stopping")
            guide.stop()
            self._say("idle", code, **facts)

    def _do_end(self, request: dict[str, Any]) -> None:
        self._is_ending = True

    def _do_execute(self, request: dict[str, Any]) -> None:
        link = self._require_link()
        rows = self._block.motion[: request["rows"]]
        mode: Mode = request["mode"]
        self._record(link.poll(_LOOK))
        if link.latest is not None:
            mismatch = describe_start_mismatch(rows[0], link.latest.q_c)
            if mismatch is not None:
                raise UsageError(mismatch).coded("elsewhere")
            self._model.rigid_body.motion_torque(link.latest.q, link.latest.dq, link.latest.dq)  # Loads it now.
        self._publisher.begin_motion(request["duration"])
        self._say("moving", "moving")
        self._stream, self._softly = MotionStream(rows, mode, self._model, self._publisher.on_cycle), None
        try:
            self._move(link, self._stream, "idle.arrived", mode)
        finally:
            self._stream = None

    def _do_jog(self, request: dict[str, Any]) -> None:
        link = self._require_link()
        self._record(link.poll(_LOOK))
        assert link.latest is not None  # A connection begins with a state.
        self._jog = HeldJog(self._block, self._model, link.latest.q_c)
        self._publisher.begin_motion(None)
        self._say("moving", "moving.jog")
        try:
            self._move(link, self._jog, "idle.jogged")
        finally:
            self._jog = None

    def _move(self, link: Link, callback: Callback, arrived: str, mode: Mode = "joint_position") -> None:
        """Runs a motion; what it says at its end tells why it ended."""
        self._mode = mode
        loop = ControlLoop(
            link,
            self._commands,
            self._settings.limits,
            ControllerMode[mode.upper()],
            self._log,
            watch=self._watch,
            model=self._model,
            filters=[RateLimiter(self._settings.limits)] if mode == "torque" else [],
        )
        try:
            with awake_cores():
                reason = loop.run(callback) or self._softly
        finally:
            gc.collect()
        if reason is None:
            self._say("idle", arrived)
        elif reason == "idle.operator":
            self._say("idle", reason, seconds=OPERATOR_TIMEOUT)
        elif reason == "idle.held":
            self._say("idle", reason, seconds=LONGEST_PAUSE * CYCLE_TIME)
        else:
            self._say("idle", "idle.stopped")
        if reason is not None:
            raise StoppedError(self._publisher.snapshot.message)

    def _watch(self, t: float) -> str | None:
        """Looked at in every cycle of a motion: does anybody or anything want it to end?"""
        reason = None
        if self._words[Word.STOPS_ASKED] != self._stops_seen:
            reason = "idle.stopped"
        elif self._is_operator_gone():
            reason = "idle.operator"
        elif os.getppid() != self._parent:
            reason, self._is_ending = "idle.stopped", True
        elif self._inbox.waiting:
            reason = self._answer_while_moving()
        elif self._stream is not None and self._stream.held > LONGEST_PAUSE:
            reason = "idle.held"
        if reason is not None and self._softly is None:
            self._say("stopping", "stopping.operator" if reason == "idle.operator" else "stopping")
            if self._stream is not None and self._mode == "torque":
                self._softly = reason
                self._stream.stop()
        return None if self._softly else reason

    def _answer_while_moving(self) -> str | None:
        request = self._inbox.take()
        if request is None:
            return None
        if request["kind"] in ("stop", "end"):
            self._deferred.append(request)
            return "idle.stopped"
        if request["kind"] == "pace" and self._stream is not None and self._softly is None:
            self._change_pace(request, self._stream)
            return None
        if self._jog is not None:  # It comes to rest at once, and then has no reason to go on.
            self._deferred.append(request)
            self._jog.is_wanted = False
            return None
        error = UsageError("the arm is moving; stop it first, or wait until it has arrived")
        self._outbox.post({"id": request["id"], "failure": pack_failure(error)})
        return None

    def _change_pace(self, request: dict[str, Any], stream: MotionStream) -> None:
        """Goes on with rows that lie ready in the block."""
        rows = self._block.motion[request["place"] : request["place"] + request["rows"]]
        reply: dict[str, Any] = {"id": request["id"]}
        if stream.switch(request["first"], rows, holds=request["holds"]):
            self._publisher.update(motion_duration=request["duration"])
            self._say("moving", "moving.held" if request["holds"] else "moving")
        else:
            reply["failure"] = pack_failure(UsageError("the change of pace came too late; ask again"))
        self._outbox.post(reply)

    def _do_pace(self, request: dict[str, Any]) -> None:
        raise UsageError("no motion runs whose pace could change").coded("no_pace")

    def _is_operator_gone(self) -> bool:
        beat = self._words[Word.OPERATOR_BEAT]
        if beat == 0:
            return False
        # A supervisor that hangs cannot tell whether anybody is there: that counts as nobody.
        oldest = min(beat, self._words[Word.SUPERVISOR_BEAT])
        return time.monotonic_ns() - oldest > OPERATOR_TIMEOUT * 1e9

    def _learn_power(self) -> None:
        self._publisher.update(powered=self._commands.motor_state())

    def _say_ready(self) -> None:
        if self._link is not None and self._link.latest is not None and self._link.latest.faults:
            self._say("fault", "fault", faults=_names(self._link.latest.faults))
        elif self._guide is not None:
            self._say("moving", "moving.guided")
        elif self._publisher.snapshot.powered:
            self._say("idle", "idle")
        else:
            self._say("idle", "idle.unpowered")

    def _say(self, phase: Phase, code: str, **facts: Any) -> None:
        if self._publisher.snapshot.code != code or facts:
            self._publisher.update(phase=phase, code=code, message=MESSAGES[code].format(**facts))

    def _require_link(self) -> Link:
        if self._link is None:
            raise UsageError("no controller is connected; reconnect first").coded("not_connected")
        return self._link

    def _disconnect(self) -> None:
        if self._link is not None:
            self._guide = None  # The controller ends it with the connection.
            self._link.close()
            self._link = None
            self._publisher.update(powered=None)


def _names(faults: Sequence[object]) -> str:
    return ", ".join(getattr(fault, "name", str(fault)) for fault in faults)


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the control process on the block it was handed."""
    parser = argparse.ArgumentParser(prog="rcilab.supervisor.worker", description=__doc__)
    parser.add_argument("--block", type=int, required=True, metavar="FD", help="open descriptor of the shared block")
    parser.add_argument("--parent", type=int, required=True, metavar="PID", help="the supervisor: end when it is gone")
    args = parser.parse_args(argv)
    return Worker(ControlBlock(args.block), args.parent).run()


if __name__ == "__main__":
    sys.exit(main())
