"""The private controller of page and notebook ends when it is idle, and starts again when it is wanted."""

from __future__ import annotations

from rcilab.app.fault_lab.private_arm import PrivateArm
from rcilab.makers.rokae.faults import Fault
from tests.processes import processes
from tests.waiting import wait_for

FAULT = Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION


def provoke(arm: PrivateArm) -> None:
    assert arm.provoke(FAULT, "xMatePro7", lambda share: None).reported == (FAULT,)


def test_an_idle_controller_ends_and_the_next_fault_gets_a_fresh_one() -> None:
    before = processes()
    arm = PrivateArm(idle_time=0.2)
    for _ in range(2):
        provoke(arm)
        wait_for(lambda: processes() == before, 10.0, "the controller to end")
    arm.close()


def test_a_controller_in_use_stays_from_one_fault_to_the_next() -> None:
    before = processes()
    arm = PrivateArm(idle_time=30.0)
    provoke(arm)
    there = processes()
    assert there > before
    provoke(arm)
    assert processes() == there
    arm.close()
    assert processes() == before
