"""The signal of a fault where the client missed states: the controller has continued the motion by itself."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from rcilab.app.fault_lab.signals import Signals
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import cycle_dtype
from rcilab.i18n.translator import Remark
from rcilab.makers.franka.errors import FrankaError
from rcilab.model.robot_model import load_model

MODEL = load_model("Panda")
GAP, LAST = 30, 60  # [cycles] Before this one a few states are missed; the last one shows the fault.


def rows(missed: int, jump: float) -> NDArray[np.void]:
    """Cycles of joint 4, which accelerates evenly, but for a jump at the end."""
    numbers = [k for k in range(LAST + 1) if not GAP <= k < GAP + missed]
    found = np.zeros(len(numbers), cycle_dtype(7))
    for name in ("command_pose", "command_psi", "command_tau"):
        found[name] = np.nan
    t = CYCLE_TIME * np.array(numbers)
    found["message_id"], found["t"], found["q_c"] = numbers, t, MODEL.home
    found["command"] = MODEL.home
    found["command"][:, 3] += 0.5 * t**2
    found["command"][-2:, 3] += jump
    return found


@pytest.mark.parametrize("missed", [0, 3])
def test_the_curve_has_a_gap_where_states_were_missed(missed: int) -> None:
    jump = 1.2 * MODEL.limits.joint.jerk[3] * CYCLE_TIME**3
    signal = Signals(rows(missed, jump), MODEL, MODEL.limits, None, 0).find(
        FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY, ""
    )
    assert signal is not None
    assert signal.value == pytest.approx(1.2 * signal.bound)
    before = signal.values[5:-1]
    assert np.isnan(before).sum() == (3 if missed else 0)
    assert np.nanmax(np.abs(before)) < 0.01 * signal.bound


def test_a_last_value_that_is_not_known_is_that_of_the_controller() -> None:
    cycles = rows(3, 0.1)[: GAP + 2]  # The command right after the gap does not fit.
    signals = Signals(cycles, MODEL, MODEL.limits, None, 0)
    assert signals.find(FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY, "") is None


def test_a_measured_value_is_the_one_that_the_controller_saw() -> None:
    cycles = rows(0, 0.0)
    bound = float(MODEL.limits.joint.velocity[3])
    cycles["q"], cycles["dq"][-1, 3] = MODEL.home, -1.5 * bound
    signals = Signals(cycles, MODEL, MODEL.limits, None, 0)
    seen = Remark("joint 4: …", "speed", joint=4, value=1.1 * bound, bound=bound)
    for reason, value in (("", -1.5 * bound), (seen, -1.1 * bound), (Remark("…", "speed", value=9.0), -1.5 * bound)):
        signal = signals.find(FrankaError.JOINT_VELOCITY_VIOLATION, reason)
        assert signal is not None
        assert (signal.axis, signal.value) == (4, pytest.approx(value))
