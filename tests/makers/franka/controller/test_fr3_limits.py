"""The FR3's own limits on its virtual controller: the errors of the maker, in the cycle that `check` names."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.arrays import readonly_copy
from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.wire.command_packet import CommandPacket
from rcilab.makers.franka.wire.requests import AsyncMove
from rcilab.makers.franka.wire.versions import VERSION_10, Status
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

FR3 = load_model("FR3")
LIMITS = FR3.limits.joint
ZERO = (0.0,) * 7
NO_POSE = tuple(np.eye(4).ravel())


def play(rows: np.ndarray) -> tuple[FciController, int]:
    """Commands joint angles one by one; returns the controller and the number of rows that it took without an error."""
    controller = FciController(VirtualArm(FR3, build_plant("ideal", FR3), prefill=0), VERSION_10)
    controller.reset(readonly_copy(rows[0]))
    controller.step()
    assert controller.begin_move(AsyncMove(0, 0, (0.0,) * 3, (0.0,) * 3)) is Status.MOTION_STARTED
    controller.step()
    for cycle, q in enumerate(rows):
        identifier = controller.packet.message_id
        controller.receive(
            CommandPacket(identifier, tuple(q), ZERO, NO_POSE, (0.0,) * 6, (0.0, 0.0), False, False, ZERO, False)
        )
        controller.step()
        if controller.faults:
            return controller, cycle
    return controller, len(rows)


def rise(joint: int, start: float, end: float, cycles: int) -> np.ndarray:
    """Returns rows on which one joint moves smoothly between two angles."""
    share = np.linspace(0.0, 1.0, cycles + 1)
    rows = np.repeat(FR3.home[np.newaxis], cycles + 1, axis=0)
    rows[:, joint] = start + (end - start) * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return rows


@pytest.mark.parametrize(("joint", "start", "end"), [(0, 2.1, 2.70), (3, -2.4, -3.0), (1, 1.0, 1.72)])
def test_a_motion_that_is_too_fast_near_an_end_ends_in_the_cycle_that_check_names(
    joint: int, start: float, end: float
) -> None:
    seen = set()
    for cycles in range(500, 1300, 100):
        rows = rise(joint, start, end, cycles)
        report = check(Motion.from_cycles(rows), FR3, distance=None)
        controller, taken = play(rows)
        if report.ok:
            assert controller.faults == ()
            continue
        first = min(round(violation.time / 0.001) for violation in report.violations)
        assert taken == first
        faults = {v.fault for v in report.violations if round(v.time / 0.001) == first}
        assert set(controller.faults) == set(controller.reflex_reason) == faults
        seen |= faults
    assert FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION in seen


def test_a_plan_close_to_an_end_is_followed_without_an_error() -> None:
    goal = FR3.home.copy()
    goal[[0, 4]] = LIMITS.upper[[0, 4]] - 0.02
    controller, taken = play(plan_joint(FR3, FR3.home, goal, speed=1.0).q)
    assert controller.faults == ()
    assert taken > 500


def test_an_angle_out_of_range_raises_the_error_of_a_measured_one() -> None:
    rows = rise(5, 4.3, 4.48, 3000)
    rows = np.concatenate((rows, np.repeat(rows[-1:], 200, axis=0)))
    rows[3100:, 5] = 4.53
    controller, taken = play(rows)
    assert taken == 3100
    assert FrankaError.JOINT_POSITION_LIMITS_VIOLATION in controller.faults
    assert FrankaError.JOINT_MOTION_GENERATOR_POSITION_LIMITS_VIOLATION not in controller.faults


def test_what_is_not_a_number_raises_no_error_that_the_arm_does_not_have() -> None:
    rows = rise(0, 0.0, 0.1, 400)
    rows[100, 3] = np.nan
    controller, taken = play(rows)
    assert taken == 100
    assert controller.faults == (FrankaError.JOINT_POSITION_LIMITS_VIOLATION,)
