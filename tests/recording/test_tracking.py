"""An arm that is brought to rest has left its plan on purpose: it is compared with it until then, and no longer."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.recording.run import Run, build_run
from tests.recording.runs import MODEL, OFFSET, PLAN, some_cycles, some_run, some_stopped_run


def compared(run: Run) -> np.ndarray:
    """Which rows are compared with the plan; joints and tool must agree."""
    joints = np.isfinite(run.tracking.joint).all(axis=1)
    assert np.array_equal(joints, np.isfinite(run.tracking.position))
    assert np.array_equal(joints, np.isfinite(run.error).all(axis=1))
    return np.flatnonzero(joints)


def spoiled(**fields) -> Run:
    cycles = some_cycles().copy()
    for name, (first, value) in fields.items():
        cycles[name][first:] = value
    return build_run(cycles, plan=PLAN, model=MODEL)


def test_a_run_to_its_end_is_compared_whole():
    run = some_run()
    assert run.stop_time is None
    assert len(compared(run)) == len(run.t)


def test_the_way_to_rest_after_a_stop_is_no_error_of_tracking():
    run = some_stopped_run()
    assert run.stop_time == pytest.approx(0.3)
    assert run.delay == 1
    assert compared(run).tolist() == list(range(301))  # What was sent last is seen one cycle later.
    assert run.tracking.joint_max == pytest.approx(OFFSET * np.eye(7)[1], abs=1e-12)
    assert np.abs(run.q - run.planned)[301:].max() > 5.0 * OFFSET  # The braking, as it would have counted.
    assert f"largest error {OFFSET:.3g} rad ({np.degrees(OFFSET):.3g} deg) until the stop at 0.300 s" in repr(run)
    assert np.isfinite(run.q).all()  # The motion itself is there to its rest.


def test_a_fault_ends_the_comparison_at_once():
    run = spoiled(faults=(400, 1 << 3))
    assert run.stop_time == pytest.approx(0.4)
    assert compared(run).tolist() == list(range(400))


def test_a_controller_that_ends_a_motion_without_a_fault_is_no_longer_answered():
    run = spoiled(sent_ns=(350, 0), command=(350, np.nan))
    assert run.stop_time == pytest.approx(0.35)
    assert compared(run).tolist() == list(range(351))


def test_the_delay_of_poses_is_found_by_the_plan_until_the_stop():
    run = some_stopped_run()
    cycles = run.cycles.copy()
    cycles["command"] = np.nan  # Sent as poses.
    assert build_run(cycles, plan=PLAN, model=MODEL).delay == 1


def test_a_run_with_a_state_every_tenth_cycle_has_lost_none_and_its_delay_in_cycles():
    cycles = some_cycles()[::10].copy()
    cycles["q_c"][1:] = cycles["command"][:-1]
    run = build_run(cycles, plan=PLAN, model=MODEL)
    assert (run.timing.lost, run.delay) == (0, 10)
    cycles["q"] = cycles["q_c"]
    run = build_run(cycles, plan=PLAN, model=MODEL)
    assert np.nanmax(np.abs(run.error)) < 1e-12
    assert np.nanmax(np.abs(run._lag())) < 1e-12
    assert np.abs(run.commanded().at(0.2).q - PLAN.at(0.2).q).max() < 1e-4
