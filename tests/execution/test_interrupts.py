"""Ctrl-C at any instruction of the 1 kHz loop: a stop within the limits, then KeyboardInterrupt."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.core.command import JointPosition
from rcilab.execution.interrupts import DeferredInterrupts
from rcilab.execution.stop_planner import StreamStopPlanner
from rcilab.makers.rokae.driver.rci_driver import RciDriver
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint

MODEL = load_model("xMatePro7")


def interrupt_after(monkeypatch: pytest.MonkeyPatch, kind: type, name: str, calls: int) -> None:
    """Sends SIGINT at the end of a call of a method."""
    method, count = getattr(kind, name), [0]

    def called(*args: object) -> object:
        result = method(*args)
        count[0] += 1
        if count[0] == calls:
            os.kill(os.getpid(), signal.SIGINT)
        return result

    monkeypatch.setattr(kind, name, called)


@pytest.mark.parametrize("place", [(RciDriver, "send"), (StreamStopPlanner, "remember")])
@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_an_interrupt_anywhere_in_a_cycle_is_a_stop_without_a_fault(plant, place, monkeypatch):
    handler = signal.getsignal(signal.SIGINT)
    with simulate(MODEL, plant=plant) as robot:
        robot.power_on()
        motion = plan_joint(MODEL, robot.state.q_c, MODEL.home + 0.5, speed=0.3)
        interrupt_after(monkeypatch, *place, 200)
        with pytest.raises(KeyboardInterrupt):
            robot.execute(motion)
        monkeypatch.undo()
        assert not robot.state.faults
        assert 0.001 < np.abs(robot.state.q_c - MODEL.home).max() < 0.499
        robot.move_j(MODEL.home, 0.5)
    assert signal.getsignal(signal.SIGINT) is handler


def test_a_callback_is_interrupted_at_once_and_the_arm_stops(monkeypatch):
    with simulate(MODEL) as robot:
        robot.power_on()
        start = robot.state.q_c

        def wave(state, t):
            if t >= 0.3:
                os.kill(os.getpid(), signal.SIGINT)
                raise AssertionError("the interrupt came later")
            return JointPosition(start + 0.05 * (1.0 - np.cos(2.0 * min(t, 0.2) ** 2)))

        with pytest.raises(KeyboardInterrupt):
            robot.control(wave)
        assert not robot.state.faults


def test_an_interrupt_in_the_last_cycles_comes_after_the_end():
    interrupts, reached = DeferredInterrupts(), []

    def run() -> None:
        with interrupts:
            os.kill(os.getpid(), signal.SIGINT)
            reached.append(interrupts.is_pending)

    with pytest.raises(KeyboardInterrupt):
        run()
    assert reached == [True]
