"""The main of the control process: one thread, one connection, one loop.

It reads states, writes every cycle into the shared ring, takes requests from the mailbox and streams motions. It
imports nothing that draws. The supervisor's fork server calls `main`.
"""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from rcilab.control_process.layout import OPERATOR_TIMEOUT, ControlBlock
from rcilab.control_process.messages import (
    Configure,
    Connect,
    End,
    Execute,
    Jog,
    NumberedRequest,
    ReadInputs,
    Reboot,
    Recover,
    Request,
    SetOutput,
    SetPower,
    Settings,
    StartGuiding,
    Stop,
    StopGuiding,
    SwitchRows,
)
from rcilab.control_process.motion_service import MotionService, StoppedError
from rcilab.control_process.request_channel import RequestChannel
from rcilab.control_process.status_writer import StatusWriter
from rcilab.control_process.stop_conditions import StopConditions
from rcilab.core.arrays import JointVector
from rcilab.core.errors import ConnectionLostError, ControlError, InvalidValueError, ModelError, RcilabError, UsageError
from rcilab.core.fault import name_faults
from rcilab.core.spatial import Pose, as_pose
from rcilab.core.state import RobotMode, RobotState
from rcilab.execution.guiding import HandGuide
from rcilab.execution.recorder import CycleLog
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import StreamingDriver, open_driver
from rcilab.makers.maker import capabilities_of
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_stop
from rcilab.realtime.scheduling import PRIORITY, enter_realtime

SILENCE = 0.3  # [s] without a state while idle before the connection counts as lost; a page waits 0.5 s.
_LOOK = 0.02  # [s] Longest wait in the idle loop, and between looks for the supervisor.
_NAP = 0.004  # [s] between two states that a control process waits for while nothing moves; saves CPU time.


class ControlProcess:
    """The control process's state. Everything here belongs to its one thread.

    Args:
        block: The shared block.
        parent: Process id of the fork server, which goes with the supervisor, and without which this process ends.
    """

    def __init__(self, block: ControlBlock, parent: int) -> None:
        settings = block.settings
        assert isinstance(settings, Settings)  # The supervisor has put it there.
        self._settings = settings
        self._requests = RequestChannel(block)
        self._oversight = StopConditions(block.counters, parent)
        self._publisher = StatusWriter(block)
        self._log = CycleLog(self._publisher.recorder, self._publisher.on_row)
        self._motions = MotionService(
            block, self._settings.limits, self._publisher, self._log, self._requests, self._oversight
        )
        self._driver: StreamingDriver | None = None
        self._address = ""
        self._is_ending = False
        self._next_look = 0.0
        self._model = load_model(self._settings.arm.name, tool=self._settings.T_flange_tool)
        self._guide: HandGuide | None = None
        self._reported: tuple[JointVector, Pose] | None = (
            None  # Joint angles and pose that the tool was last found from.
        )

    def run(self) -> int:
        """Lives until asked to end or until the supervisor is gone; returns the exit code."""
        plan_stop(
            self._settings.limits.joint,
            np.zeros(self._settings.arm.n),
            np.full(self._settings.arm.n, 0.1),
            np.zeros(self._settings.arm.n),
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
                except ConnectionLostError as error:  # It never ends this process, whatever was in progress.
                    self._lose(error)
        finally:
            self._disconnect()
        return 0

    def leave(self) -> None:
        """Brings the arm to rest and ends, as when the supervisor is gone; where no arm is connected, at once."""
        self._oversight.dismiss()
        if self._driver is None:
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
        if self._driver is None:
            self._publisher.beat()
            time.sleep(_LOOK)
            return
        if self._guide is None and self._publisher.snapshot.phase == "idle":
            time.sleep(_NAP)  # To wake up for every state of a resting arm would take twice its share of a core.
            self._record(self._driver.poll(0.0), is_awaited=False)
        states = self._driver.poll(_LOOK)
        self._record(states)
        if states:
            self._show_state(states[-1])
        elif time.monotonic_ns() - self._driver.received_ns > SILENCE * 1e9:
            self._publisher.say("lost", "lost.silent", address=self._address)

    def _record(self, states: list[RobotState], *, is_awaited: bool = True) -> None:
        if not states:
            self._publisher.beat()  # Otherwise every row is one.
        for state in states:
            assert self._driver is not None
            self._log.write(state, self._driver.received_ns, is_awaited=is_awaited)

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
            if phase != "fault" or self._publisher.snapshot.code == "fault.pressed":
                self._say_fault(state.faults)
        elif phase in ("fault", "lost"):
            self._say_ready()

    def _show_tool(self, state: RobotState) -> None:
        """Shows the tool that follows from joint angles and pose; at rest both stay, and there is nothing to do."""
        reported = (state.q_c, state.T_base_tool_c)
        if self._reported is not None and _is_same(reported, self._reported):
            return
        self._reported = reported
        with suppress(InvalidValueError):  # A controller may report no pose before it is ready.
            flange = self._model.pose(state.q_c, "flange")
            self._publisher.show_tool(flange.inverse() @ as_pose(state.T_base_tool_c.matrix))

    def _serve(self) -> None:
        while (request := self._requests.take()) is not None:
            try:
                self._handle(request.body)
            except RcilabError as error:
                self._fail(request, error)
            except Exception as error:
                self._fail(request, error)
                raise
            else:
                self._requests.answer(request)

    def _handle(self, request: Request) -> None:
        match request:
            case Connect():
                self._connect(request)
            case Configure():
                self._configure(request.configuration)
            case SetPower():
                self._set_power(request.on)
            case SetOutput():
                self._set_output(request.signal, request.level)
            case ReadInputs():
                self._read_inputs()
            case Reboot():
                self._reboot()
            case Recover():
                self._recover()
            case Stop():
                self._oversight.see_stop(request.number)  # In its turn: what it was meant for stands still by now.
                self._end_guiding("idle.stopped")
            case StartGuiding():
                self._start_guiding(request)
            case StopGuiding():
                self._end_guiding("idle.guided")
            case Execute():
                driver = self._require_driver()
                self._record(driver.poll(_LOOK))
                self._motions.execute(driver, self._model, request)
            case Jog():
                driver = self._require_driver()
                self._record(driver.poll(_LOOK))
                self._motions.jog(driver, self._model)
            case SwitchRows():
                raise UsageError("no motion runs whose speed override could change").coded("no_pace")
            case End():
                self._is_ending = True

    def _fail(self, request: NumberedRequest, error: Exception) -> None:
        if isinstance(error, StoppedError):
            pass  # Said already.
        elif isinstance(error, ConnectionLostError) or (isinstance(request.body, Connect) and self._driver is None):
            self._lose(error)
        elif isinstance(error, ControlError) and error.faults:
            self._say_fault(error.faults)
        elif self._driver is not None and self._guide is None:
            self._publisher.say("idle", "idle.failed", error=str(error))
        self._requests.answer(request, error)

    def _lose(self, error: Exception) -> None:
        """Gives the connection up and says why."""
        code = "lost.unreachable" if self._driver is None else "lost.closed"
        if isinstance(error, ModelError):
            code = "lost.other_arm"
        self._disconnect()
        self._publisher.say("lost", code, error=str(error))

    def _connect(self, request: Connect) -> None:
        self._disconnect()
        self._address = request.address
        self._publisher.say("connecting", "connecting", address=self._address)
        driver = open_driver(self._address, request.timeout, self._settings.arm)
        self._driver = driver
        driver.on_states = self._record
        self._log.restart()
        self._publisher.restart()
        if driver.latest is not None:
            self._record([driver.latest])  # Before it is said to be ready: the newest row may be a dead predecessor's.
        self._reported = None
        self._learn_power()
        self._configure(request.configuration)

    def _configure(self, configuration: RobotConfiguration) -> None:
        driver = self._require_driver()
        self._model = configuration.applied_to(self._model)
        driver.configure(configuration)
        self._say_ready()

    def _set_power(self, on: bool) -> None:
        self._require_driver().power(on)
        self._learn_power()
        self._say_ready()

    def _set_output(self, signal: int, level: bool) -> None:
        bit = 1 << signal
        self._require_driver().set_output(signal, level)
        shown = self._publisher.snapshot
        outputs = shown.outputs | bit if level else shown.outputs & ~bit
        self._publisher.update(outputs_known=shown.outputs_known | bit, outputs=outputs)
        self._read_inputs()  # What an output is wired to may have changed.

    def _read_inputs(self) -> None:
        driver, count = self._require_driver(), len(capabilities_of(self._model).inputs)
        self._publisher.update(inputs=sum(driver.read_input(signal) << signal for signal in range(count)))

    def _reboot(self) -> None:
        self._require_driver().reboot()
        self._disconnect()
        self._publisher.say("lost", "lost.rebooted", address=self._address)

    def _recover(self) -> None:
        self._require_driver().recover()
        self._learn_power()
        self._say_ready()

    def _start_guiding(self, request: StartGuiding) -> None:
        guide = HandGuide(self._require_driver())
        guide.start(request.space, request.kind)
        self._guide = guide
        self._publisher.begin_motion(None)
        self._publisher.say("moving", "moving.guided")

    def _mind_guiding(self) -> None:
        """Ends hand guiding once no operator is present any more."""
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

    def _learn_power(self) -> None:
        self._publisher.update(powered=self._require_driver().is_powered())

    def _say_ready(self) -> None:
        if self._driver is not None and self._driver.latest is not None and self._driver.latest.faults:
            self._say_fault(self._driver.latest.faults)
        elif self._guide is not None:
            self._publisher.say("moving", "moving.guided")
        elif self._publisher.snapshot.powered:
            self._publisher.say("idle", "idle")
        else:
            self._publisher.say("idle", "idle.unpowered")

    def _say_fault(self, faults: Sequence[object]) -> None:
        """Says what has stopped the arm; a safety stop shows as an error bit that means something else."""
        state = None if self._driver is None else self._driver.latest
        if state is not None and state.robot_mode is RobotMode.USER_STOPPED:
            self._publisher.say("fault", "fault.pressed")
        elif self._publisher.snapshot.code in ("fault.pressed", "fault.released"):
            self._publisher.say("fault", "fault.released")  # Only the bit is left of it.
        else:
            self._publisher.say("fault", "fault", faults=name_faults(faults))

    def _require_driver(self) -> StreamingDriver:
        if self._driver is None:
            raise UsageError("no controller is connected; reconnect first").coded("not_connected")
        return self._driver

    def _disconnect(self) -> None:
        if self._driver is not None:
            self._guide = None  # The controller ends it with the connection.
            self._driver.close()
            self._driver = None
            self._publisher.update(powered=None, inputs=-1, outputs_known=0, outputs=0)


def _is_same(now: tuple[JointVector, Pose], before: tuple[JointVector, Pose]) -> bool:
    (q, T), (q_before, T_before) = now, before
    return (q is q_before or q.tobytes() == q_before.tobytes()) and (
        T is T_before or T.as_row_major() == T_before.as_row_major()
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the control process on the block it was handed."""
    parser = argparse.ArgumentParser(prog="rcilab.control_process.worker", description=__doc__)
    parser.add_argument("--block", type=int, required=True, metavar="FD", help="open descriptor of the shared block")
    parser.add_argument("--parent", type=int, required=True, metavar="PID", help="end when it is gone")
    args = parser.parse_args(argv)
    worker = ControlProcess(ControlBlock(args.block), args.parent)
    # Not in mid-motion: before VS Code ends a kernel it asks every process below it to end.
    signal.signal(signal.SIGTERM, lambda *_: worker.leave())
    return worker.run()
