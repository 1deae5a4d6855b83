"""The main of the control process: one thread, one connection, one loop.

It reads states, writes every cycle into the shared ring, takes requests from the mailbox and streams motions. It
imports nothing that draws. The supervisor's fork server calls `main`.
"""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from rcilab.arrays import JointVector
from rcilab.client.address import parse_address
from rcilab.client.commands import SIGNALS, RciCommands
from rcilab.client.link import Link
from rcilab.client.opening import await_first_state, require_arm_there
from rcilab.client.punctual import PRIORITY
from rcilab.client.recorder import CycleLog
from rcilab.client.recovery import recover
from rcilab.client.setup import give_setup
from rcilab.client.transport import SocketTransport
from rcilab.errors import ConnectionLostError, ControlError, InvalidValueError, ModelError, RcilabError, UsageError
from rcilab.faults import name_faults
from rcilab.model import load_model
from rcilab.motion import plan_stop
from rcilab.protocols.rci import STATE_SIZE
from rcilab.realtime import enter_realtime
from rcilab.spatial import Pose, as_pose
from rcilab.state import RobotMode, RobotState
from rcilab.supervisor.guiding import HandGuide
from rcilab.supervisor.layout import OPERATOR_TIMEOUT, ControlBlock
from rcilab.supervisor.letters import Letter, Letters
from rcilab.supervisor.mover import Mover, StoppedError
from rcilab.supervisor.oversight import Oversight
from rcilab.supervisor.publisher import Publisher
from rcilab.supervisor.settings import parse_settings
from rcilab.supervisor.setup_letter import parse_setup

SILENCE = 0.3  # [s] without a state while idle before the connection counts as lost; a choice below half a second.
_LOOK = 0.02  # [s] Longest wait in the idle loop, and between looks for the supervisor.
_NAP = 0.004  # [s] between two states that a control process waits for while nothing moves; a choice.


class Worker:
    """The control process's state. Everything here belongs to its one thread.

    Args:
        block: The shared block.
        parent: Process id of the fork server, which goes with the supervisor, and without which this process ends.
    """

    def __init__(self, block: ControlBlock, parent: int) -> None:
        self._settings = parse_settings(block.settings)
        self._letters = Letters(block)
        self._oversight = Oversight(block.words, parent)
        self._publisher = Publisher(block)
        self._log = CycleLog(self._publisher.recorder, self._publisher.on_row)
        self._mover = Mover(block, self._settings.limits, self._publisher, self._log, self._letters, self._oversight)
        self._link: Link | None = None
        self._address = ""
        self._is_ending = False
        self._next_look = 0.0
        self._model = load_model(self._settings.name, tool=self._settings.T_flange_tool)
        self._guide: HandGuide | None = None
        self._told: tuple[JointVector, Pose] | None = None  # Joint angles and pose that the tool was last found from.

    def run(self) -> int:
        """Lives until asked to end or until the supervisor is gone; returns the exit code."""
        plan_stop(
            self._settings.limits.joint,
            np.zeros(self._settings.n),
            np.full(self._settings.n, 0.1),
            np.zeros(self._settings.n),
        )  # The first one loads the planner; the next one must be quick.
        self._model.rigid_body.gravity(self._model.home)  # Loads its library: from a cold disk that takes seconds.
        granted = enter_realtime(PRIORITY)
        self._publisher.update(is_fifo=granted.policy == "SCHED_FIFO", memory_locked=granted.memory_locked)
        if granted.warning:
            print(granted.warning, file=sys.stderr, flush=True)
        try:
            while not (self._is_ending or self._is_orphan()):
                try:
                    self._listen()
                    self._serve()
                    self._mind_guiding()
                except ConnectionLostError as error:  # It never ends this process, whatever was under way.
                    self._lose(error)
        finally:
            self._disconnect()
        return 0

    def leave(self) -> None:
        """Brings the arm to rest and ends, as when the supervisor is gone; where no arm is connected, at once."""
        self._oversight.dismiss()
        if self._link is None:
            sys.exit()

    def _is_orphan(self) -> bool:
        """Returns whether the supervisor is gone; without a connection the loop looks no more often either."""
        now = time.monotonic()
        if now < self._next_look:
            return False
        self._next_look = now + _LOOK
        return self._oversight.is_orphan

    def _listen(self) -> None:
        """Takes in what the robot says while nothing moves."""
        if self._link is None:
            self._publisher.beat()
            time.sleep(_LOOK)
            return
        if self._guide is None and self._publisher.snapshot.phase == "idle":
            time.sleep(_NAP)  # To wake up for every state of a resting arm would take twice its share of a core.
            self._record(self._link.poll(0.0), is_awaited=False)
        states = self._link.poll(_LOOK)
        self._record(states)
        if states:
            self._show_state(states[-1])
        elif time.monotonic_ns() - self._link.received_ns > SILENCE * 1e9:
            self._publisher.say("lost", "lost.silent", address=self._address)

    def _record(self, states: list[RobotState], *, is_awaited: bool = True) -> None:
        if not states:
            self._publisher.beat()  # Otherwise every row is one.
        for state in states:
            assert self._link is not None
            self._log.write(state, self._link.received_ns, is_awaited=is_awaited)

    def _show_state(self, state: RobotState) -> None:
        """Keeps the phase in step with what the robot reports while nothing moves."""
        phase = self._publisher.snapshot.phase
        if state.robot_mode is RobotMode.USER_STOPPED and self._publisher.snapshot.powered:
            self._publisher.update(powered=False)  # The emergency stop, or the gate, has taken it.
            self._say_ready()
        self._show_tool(state)
        if self._guide is not None and self._guide.has_ended(state):
            self._guide = None
            self._say_ready()
        elif state.faults:
            if phase != "fault":
                self._say_fault(state.faults)
        elif phase in ("fault", "lost"):
            self._say_ready()

    def _show_tool(self, state: RobotState) -> None:
        """Shows the tool that follows from joint angles and pose; at rest both stay, and there is nothing to do."""
        told = (state.q_c, state.T_base_tool_c)
        if self._told is not None and _is_same(told, self._told):
            return
        self._told = told
        with suppress(InvalidValueError):  # A controller may report no pose before it is ready.
            flange = self._model.pose(state.q_c, "flange")
            self._publisher.show_tool(flange.inverse() @ as_pose(state.T_base_tool_c.matrix))

    def _serve(self) -> None:
        while (request := self._letters.take()) is not None:
            handler: Callable[[Letter], None] = getattr(self, f"_do_{request['kind']}")
            try:
                handler(request)
            except RcilabError as error:
                self._fail(request, error)
            except Exception as error:
                self._fail(request, error)
                raise
            else:
                self._letters.answer(request)

    def _fail(self, request: Letter, error: Exception) -> None:
        if isinstance(error, StoppedError):
            pass  # Said already.
        elif isinstance(error, ConnectionLostError) or (request["kind"] == "connect" and self._link is None):
            self._lose(error)
        elif isinstance(error, ControlError) and error.faults:
            self._say_fault(error.faults)
        elif self._link is not None and self._guide is None:
            self._publisher.say("idle", "idle.failed", error=str(error))
        self._letters.answer(request, error)

    def _lose(self, error: Exception) -> None:
        """Gives the connection up and says why."""
        self._disconnect()
        code = "lost.other_arm" if isinstance(error, ModelError) else "lost.unreachable"
        self._publisher.say("lost", code, error=str(error))

    def _do_connect(self, request: Letter) -> None:
        self._disconnect()
        self._address = request["address"]
        self._publisher.say("connecting", "connecting", address=self._address)
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
        if link.latest is not None:
            self._record([link.latest])  # Before it is said to be ready: the newest row may be a dead predecessor's.
        self._told = None
        self._commands = RciCommands(link, self._settings.limits)
        self._learn_power()
        self._do_set_up(request)

    def _do_set_up(self, request: Letter) -> None:
        self._require_link()
        setup = parse_setup(request["setup"])
        self._model = setup.applied_to(self._model)
        give_setup(self._commands, setup)
        self._say_ready()

    def _do_power(self, request: Letter) -> None:
        self._require_link()
        self._commands.set_motor_power(request["on"])
        self._learn_power()
        self._say_ready()

    def _do_output(self, request: Letter) -> None:
        self._require_link()
        bit = 1 << request["signal"]
        self._commands.set_do(request["signal"], request["level"])
        shown = self._publisher.snapshot
        outputs = shown.outputs | bit if request["level"] else shown.outputs & ~bit
        self._publisher.update(outputs_known=shown.outputs_known | bit, outputs=outputs)
        self._read_inputs()  # What an output is wired to may have changed.

    def _do_inputs(self, request: Letter) -> None:
        self._require_link()
        self._read_inputs()

    def _read_inputs(self) -> None:
        self._publisher.update(inputs=sum(self._commands.get_di(signal) << signal for signal in SIGNALS))

    def _do_reboot(self, request: Letter) -> None:
        self._require_link()
        self._commands.reboot()
        self._disconnect()
        self._publisher.say("lost", "lost.rebooted", address=self._address)

    def _do_recover(self, request: Letter) -> None:
        recover(self._commands, self._require_link())
        self._learn_power()
        self._say_ready()

    def _do_stop(self, request: Letter) -> None:
        self._oversight.see_stop(request["number"])  # Served in its turn: what it was meant for stands still by now.
        self._end_guiding("idle.stopped")

    def _do_start_guiding(self, request: Letter) -> None:
        self._require_link()
        guide = HandGuide(self._commands)
        guide.start(request["space"], request["type"])
        self._guide = guide
        self._publisher.begin_motion(None)
        self._publisher.say("moving", "moving.guided")

    def _do_stop_guiding(self, request: Letter) -> None:
        self._end_guiding("idle.guided")

    def _mind_guiding(self) -> None:
        """Ends hand guiding once nobody is at the controls any more."""
        if self._guide is None or not self._oversight.is_operator_gone:
            return
        try:
            self._end_guiding("idle.operator", seconds=OPERATOR_TIMEOUT)
        except ConnectionLostError:
            raise
        except RcilabError as error:  # Whatever it was, the states that follow tell where the arm is.
            self._publisher.say("idle", "idle.failed", error=str(error))

    def _end_guiding(self, code: str, **facts: Any) -> None:
        """Ends hand guiding, where there is any, and returns once the arm is at rest."""
        guide, self._guide = self._guide, None
        if guide is not None:
            self._publisher.say("stopping", "stopping")
            guide.stop()
            self._publisher.say("idle", code, **facts)

    def _do_end(self, request: Letter) -> None:
        self._is_ending = True

    def _do_execute(self, request: Letter) -> None:
        link = self._require_link()
        self._record(link.poll(_LOOK))
        self._mover.execute(link, self._commands, self._model, request)

    def _do_jog(self, request: Letter) -> None:
        link = self._require_link()
        self._record(link.poll(_LOOK))
        self._mover.jog(link, self._commands, self._model)

    def _do_pace(self, request: Letter) -> None:
        raise UsageError("no motion runs whose pace could change").coded("no_pace")

    def _learn_power(self) -> None:
        self._publisher.update(powered=self._commands.motor_state())

    def _say_ready(self) -> None:
        if self._link is not None and self._link.latest is not None and self._link.latest.faults:
            self._say_fault(self._link.latest.faults)
        elif self._guide is not None:
            self._publisher.say("moving", "moving.guided")
        elif self._publisher.snapshot.powered:
            self._publisher.say("idle", "idle")
        else:
            self._publisher.say("idle", "idle.unpowered")

    def _say_fault(self, faults: Sequence[object]) -> None:
        """Says what has stopped the arm; a safety stop shows as an error bit that means something else."""
        state = None if self._link is None else self._link.latest
        if state is not None and state.robot_mode is RobotMode.USER_STOPPED:
            self._publisher.say("fault", "fault.pressed")
        else:
            self._publisher.say("fault", "fault", faults=name_faults(faults))

    def _require_link(self) -> Link:
        if self._link is None:
            raise UsageError("no controller is connected; reconnect first").coded("not_connected")
        return self._link

    def _disconnect(self) -> None:
        if self._link is not None:
            self._guide = None  # The controller ends it with the connection.
            self._link.close()
            self._link = None
            self._publisher.update(powered=None, inputs=-1, outputs_known=0, outputs=0)


def _is_same(told: tuple[JointVector, Pose], before: tuple[JointVector, Pose]) -> bool:
    (q, T), (q_before, T_before) = told, before
    return (q is q_before or q.tobytes() == q_before.tobytes()) and (
        T is T_before or T.as_row_major() == T_before.as_row_major()
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the control process on the block it was handed."""
    parser = argparse.ArgumentParser(prog="rcilab.supervisor.worker", description=__doc__)
    parser.add_argument("--block", type=int, required=True, metavar="FD", help="open descriptor of the shared block")
    parser.add_argument("--parent", type=int, required=True, metavar="PID", help="end when it is gone")
    args = parser.parse_args(argv)
    worker = Worker(ControlBlock(args.block), args.parent)
    # Not in mid-motion: before VS Code ends a kernel it asks every process below it to end.
    signal.signal(signal.SIGTERM, lambda *_: worker.leave())
    return worker.run()
