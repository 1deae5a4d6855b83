from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.conformance.limit_violation import faults_of
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.makers.rokae.conditions import RCI_TORQUE_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model

LIMITS = load_model("xMatePro7").limits.joint
RATE, RANGE = Fault.COMMAND_TORQUE_DISCONTINUITY, Fault.COMMAND_TORQUE_RANGE_VIOLATION


@given(st.integers(0, 2**32))
def test_it_says_what_the_manuals_inequalities_say_of_a_random_walk(seed):
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(scale=rng.uniform(0.1, 3.0), size=(40, 7)), axis=0) + rng.uniform(-80.0, 80.0, 7)
    monitor = TorqueMonitor(LIMITS, RCI_TORQUE_CONDITIONS)
    monitor.reset(walk[0].tolist())
    for before, tau in pairwise(walk):
        faults = faults_of(monitor.step(tau.tolist()))
        assert (RANGE in faults) == bool((np.abs(tau) >= LIMITS.torque).any())
        assert (RATE in faults) == bool((np.abs((tau - before) / CYCLE_TIME) >= LIMITS.torque_rate).any())
        assert len(monitor.violations()) >= len(faults)


def test_the_limit_itself_is_outside_and_both_faults_come_in_wire_order():
    monitor = TorqueMonitor(LIMITS, RCI_TORQUE_CONDITIONS)
    monitor.reset([84.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert faults_of(monitor.step([85.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])) == (RANGE,)
    monitor.reset([0.0] * 7)
    assert faults_of(monitor.step([85.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])) == (RATE, RANGE)
    assert [violation.text for violation in monitor.violations()] == [
        "joint 1: commanded torque rate 85000 N m/s passes 1500 N m/s",
        "joint 1: commanded torque 85 N m reaches 85 N m",
    ]


def test_a_wrist_bears_less():
    monitor = TorqueMonitor(LIMITS, RCI_TORQUE_CONDITIONS)
    monitor.reset([37.0] * 7)
    assert faults_of(monitor.step([37.0] * 7)) == (RANGE,)
    assert [violation.axis for violation in monitor.violations()] == [5, 6, 7]


def test_what_is_not_a_number_breaks_both_and_a_six_axis_arm_ignores_the_seventh():
    monitor = TorqueMonitor(load_model("xMate3").limits.joint, RCI_TORQUE_CONDITIONS)
    assert faults_of(monitor.step([0.0] * 6 + [float("nan")])) == ()
    assert faults_of(monitor.step([0.0, float("nan"), 0.0, 0.0, 0.0, 0.0, 0.0])) == (RATE, RANGE)
    with pytest.raises(InvalidValueError, match=r"must be 6 numbers \[N m\]"):
        monitor.reset([0.0] * 7)
