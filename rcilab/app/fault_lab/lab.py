"""A private virtual controller in lock-step on which faults are provoked, one at a time."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rcilab.app.fault_lab.fault_demo import FaultDemo, RecoveryStep
from rcilab.app.fault_lab.signals import Signals
from rcilab.app.fault_lab.table import FaultTable
from rcilab.conformance.common_conditions import LOST_COMMANDS_THRESHOLD
from rcilab.control_process.simulate import simulate
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.closeable import Closeable
from rcilab.core.command import Command
from rcilab.core.cycle_recorder import Recorder
from rcilab.core.errors import ControlError, ManualRecoveryError, RcilabError, UsageError
from rcilab.core.fault import FaultCode, find_fault
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import IDENTITY
from rcilab.core.state import RobotState
from rcilab.execution.control_loop import Callback
from rcilab.execution.motion_executor import MotionStream
from rcilab.execution.recorder import CycleLog
from rcilab.execution.session import RobotSession
from rcilab.makers.configuration import RobotConfiguration, SoftJointLimits
from rcilab.makers.maker import capabilities_of, maker_of, parameters_of, require_simulator, timing_of
from rcilab.makers.parameters import default_parameters
from rcilab.makers.scenario import FaultScenario, Scene
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import plan_joint, plan_recovery
from rcilab.motion.joint import DEFAULT_JOINT_SPEED

_CAPACITY = 4096  # [cycles] More than any scenario takes.
_OPEN = SafetyBox(size=(20.0, 20.0, 20.0), T_base_box=IDENTITY, active=False)
_SMALL_FORCE = 1.0  # [N, N m] Far below any threshold of a scenario.
_MAX_WAIT_STATES = 500
_GAP = 5  # [states] Largest number of missing states between two shown ones, as on any network.
_AFTER = 200  # [cycles] Recorded part of the controlled stop: the arm stands still by then.
_TEST_MOTION = 0.02  # [rad] Length of the motion that shows that the arm can move again.
_CLOCKED_SPEED = 0.2  # Of an arm that runs by the clock and catches up after a pause of the machine, faster still.
_THERE = 1e-6  # [rad] Largest distance from the start of a scenario.
_OPENED, _PLACED, _SHOWN = 0.4, 0.5, 0.8
"""Progress when the controller runs, when the arm is at the start, when the fault has come. About as measured."""

Tell = Callable[[float], None]
"""Called with the progress, 0 to 1. An exception from it ends the provocation: the arm is stopped."""


class FaultLab(Closeable):
    """Provokes faults on a private virtual arm. Owned by one thread; opens at its first use.

    Args:
        model: The arm, without tool and load: the faults of the bare arm are shown.
    """

    def __init__(self, model: RobotModel | str) -> None:
        self.model = require_simulator(load_model(model if isinstance(model, str) else model.name))
        self.faults = FaultTable(self.model)
        """The faults that can be provoked."""
        self._robot: RobotSession | None = None

    def provoke(self, fault: FaultCode | str, progress: Tell = lambda share: None) -> FaultDemo:
        """Provokes a fault and returns the controller's report; afterwards the arm is ready for the next one.

        Args:
            fault: A fault, or its name as the manual prints it.
            progress: Called with the progress, 0 to 1.

        Raises:
            InvalidValueError: There is no such fault.
            UsageError: This arm cannot have this fault: it has no arm angle, or there is no scenario for it.
            RcilabError: The controller did not report it.
        """
        known = find_fault(self.model.description.faults, fault)
        if known not in self.faults:
            raise UsageError(f"{self.model.name}: there is no scenario for {known.manual_name}")
        scenario = self.faults[known]
        if scenario.needs_elbow and not self.model.redundancy:
            sentence = f"{scenario.fault.manual_name} takes an arm of 7 axes; {self.model.name} has no elbow angle"
            raise UsageError(sentence).coded("no_psi")
        try:
            return self._provoke(scenario, progress)
        except BaseException:
            self.close()  # Its state is unknown: the next fault gets a new controller.
            raise

    def close(self) -> None:
        """Ends the private controller. A later `provoke` starts a new one."""
        robot, self._robot = self._robot, None
        if robot is not None:
            robot.close()

    def __repr__(self) -> str:
        return f"<FaultLab with a private {self.model.name}{'' if self._robot else ', not opened yet'}>"

    def _provoke(self, scenario: FaultScenario, progress: Tell) -> FaultDemo:
        progress(0.02)
        if self._robot is None:
            self._robot = simulate(self.model, prefill=0)  # A fault is that of the last command.
            self._robot.power_on()
        robot = self._robot
        progress(_OPENED)
        start = scenario.start(self.model)
        if np.abs(robot.receive_state().q_c - start).max() > _THERE:
            self._go(robot, start)
        scene = scenario.prepare(self._scene(robot))
        progress(_PLACED)
        if scenario.request is not None:
            return self._request(robot, scenario, scenario.request, scene, progress)
        assert scenario.act is not None  # A scenario has one of both.
        log = CycleLog(Recorder(self.model.n, _CAPACITY))
        try:
            robot.control(_logged(scenario.act(scene), log, progress), scenario.mode)
        except ControlError as error:
            if scenario.fault not in error.faults:
                raise
            fault = error
        else:
            error = RcilabError(f"{self.model.name}: {scenario.fault.manual_name} did not come")
            raise error.coded("no_fault", fault=scenario.fault.manual_name)
        assert fault.record is not None
        assert fault.stop is not None
        rows = log.recorder.rows()
        rows = np.concatenate((rows, fault.record[fault.record["message_id"] > rows["message_id"][-1]]))
        after = _watch_stop(robot, rows[-1], fault.stop)  # First: its states are already arriving.
        status = robot.world.status()
        progress(_SHOWN)
        lost = min(status.lost, LOST_COMMANDS_THRESHOLD)  # A controller that holds commands counts late ones, too.
        signals = Signals(rows, self.model, scene.limits, scene.box, lost)
        signal = signals.find(scenario.fault, status.reason) or signals.reported(scenario.fault, status.reason)
        if signal is None:
            raise RcilabError(
                f"{scenario.fault.manual_name}: the record does not show what the controller saw: {status.reason}"
            ).coded("no_fault", fault=scenario.fault.manual_name)
        return FaultDemo(
            fault=scenario.fault,
            scenario=scenario,
            model=self.model,
            limits=scene.limits,
            reported=tuple(bit for bit in fault.faults if isinstance(bit, FaultCode)),
            sentence=status.reason,
            cycles=rows,
            after=after,
            signal=signal,
            way_out=tuple(self._leave(robot, scenario, scene)),
        )

    def _request(
        self,
        robot: RobotSession,
        scenario: FaultScenario,
        request: Callable[[Scene], tuple[FaultCode, ...]],
        scene: Scene,
        progress: Tell,
    ) -> FaultDemo:
        """Sends the requests that lead to an error, to an arm at standstill, and records the cycles around them."""
        log, begun = CycleLog(Recorder(self.model.n, _CAPACITY)), robot.receive_state().message_id
        _watch_standstill(robot, log, begun)
        sent = len(log.recorder.rows())
        reported = request(scene)
        _watch_standstill(robot, log, begun)
        rows = log.recorder.rows()
        progress(_SHOWN)
        if scenario.fault not in reported:
            error = RcilabError(f"{self.model.name}: {scenario.fault.manual_name} did not come")
            raise error.coded("no_fault", fault=scenario.fault.manual_name)
        return FaultDemo(
            fault=scenario.fault,
            scenario=scenario,
            model=self.model,
            limits=scene.limits,
            reported=reported,
            sentence=robot.world.status().reason,
            cycles=rows[: sent + 1],
            after=rows[sent + 1 :],
            signal=None,
            way_out=tuple(self._leave(robot, scenario, scene)),
        )

    def _scene(self, robot: RobotSession) -> Scene:
        maker = maker_of(self.model)
        assert maker is not None  # It has a virtual controller.
        commands = getattr(robot, maker.scheme)
        return Scene(robot=robot, commands=commands, start=robot.receive_state(), limits=self.model.limits)

    def _leave(self, robot: RobotSession, scenario: FaultScenario, scene: Scene) -> list[RecoveryStep]:
        """Recovers from a fault and returns the steps."""
        done: list[RecoveryStep] = []
        if scenario.cuts_network:
            robot.world.set_network(None)
            done.append("network")
        if robot.world.status().pushed:
            robot.world.release()
            done.append("release")
            self._wait_for_small_force(robot)
        done += self._recover(robot)
        scenario.restore(scene)
        self._widen(robot)
        self._configure(robot, RobotConfiguration(control=default_parameters(parameters_of(self.model))))
        back = plan_recovery(self.model, robot.receive_state().q_c)
        if len(back.q) > 1:
            robot.control(MotionStream(back.q, "joint_position", self.model))
        nudged = np.array(robot.receive_state().q_c)
        nudged[-1] -= np.copysign(_TEST_MOTION, nudged[-1])
        self._go(robot, nudged)
        return [*done, "move"]

    def _go(self, robot: RobotSession, goal: Array) -> None:
        """Moves the private arm: inside every limit, without a check for collisions, as there is nothing to hit."""
        speed = DEFAULT_JOINT_SPEED if timing_of(self.model).state_cycles == 1 else _CLOCKED_SPEED
        motion = plan_joint(self.model, robot.receive_state().q_c, goal, speed=speed)
        robot.control(MotionStream(motion.q, "joint_position", self.model))

    def _widen(self, robot: RobotSession) -> None:
        limits = self.model.limits.joint
        whole = SoftJointLimits(lower=tuple(limits.lower.tolist()), upper=tuple(limits.upper.tolist()))
        self._configure(robot, RobotConfiguration(joints=whole, box=_OPEN))

    def _configure(self, robot: RobotSession, configuration: RobotConfiguration) -> None:
        robot.configure(configuration.only(capabilities_of(self.model).setup))

    def _wait_for_small_force(self, robot: RobotSession) -> None:
        """Returns once the estimated external torques are small again: the estimate needs a moment after a push."""
        for _ in range(_MAX_WAIT_STATES):
            if np.abs(robot.receive_state().tau_ext_in_base).max() < _SMALL_FORCE:
                return

    def _recover(self, robot: RobotSession) -> list[RecoveryStep]:
        try:
            robot.recover()
        except ManualRecoveryError:
            robot.power_off()
            self._widen(robot)
            robot.power_on()
            return ["refused", "power_off", "widen", "power_on"]
        if robot.is_powered():
            return ["recover"]
        robot.power_on()  # A joint limit and an emergency stop switch the motor power off.
        return ["recover", "power_on"]


def _watch_stop(robot: RobotSession, last: np.void, stop: NDArray[np.void]) -> NDArray[np.void]:
    """Returns the cycles after the one with the fault: the controller stops the arm, and it stands still.

    Args:
        robot: Receives the states after `stop`.
        last: The cycle with the fault.
        stop: The states of the stop so far.
    """
    log = CycleLog(Recorder(robot.model.n, _CAPACITY))
    begun, t = int(last["message_id"]), float(last["t"])
    seen = int(stop["message_id"][-1]) - begun if len(stop) else 0
    while seen < _AFTER:
        for state in robot.receive_states():
            since = state.message_id - begun
            log.write(state, time.monotonic_ns(), t + since * CYCLE_TIME)
            seen = max(seen, since)
    rows = np.concatenate((stop, log.recorder.rows()))
    steps = np.diff(rows["message_id"].astype(np.int64), prepend=begun)
    missed = np.flatnonzero(
        steps > _GAP * timing_of(robot.model).state_cycles
    )  # Missed cycles are not interpolated: the record ends there.
    rows = rows[: missed[0]] if missed.size else rows
    return rows[rows["message_id"] <= begun + _AFTER]


def _watch_standstill(robot: RobotSession, log: CycleLog, begun: int) -> None:
    """Records some cycles of an arm that stands still; their time begins in the cycle `begun`."""
    end = robot.receive_state().message_id + _AFTER
    while log.state is None or log.state.message_id < end:
        for state in robot.receive_states():
            log.write(state, time.monotonic_ns(), (state.message_id - begun) * CYCLE_TIME)


def _logged(callback: Callback, log: CycleLog, progress: Tell) -> Callback:
    """Returns a callback that also records every cycle."""

    def recorded(state: RobotState, t: float) -> Command:
        command = callback(state, t)
        now = time.monotonic_ns()
        log.write(state, now, t, now, command)
        if state.message_id % 64 == 0:
            progress(_PLACED)
        return command

    return recorded
