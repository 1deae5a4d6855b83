"""The fault lab of RealMan's arms."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.app.fault_lab import FaultLab
from rcilab.app.fault_lab.demo_view import body_html, head_html
from rcilab.app.text import Text
from rcilab.makers.realman.errors import RealManError
from rcilab.makers.realman.robots import ROBOTS
from rcilab.model.robot_model import load_model

pytest.importorskip("Robotic_Arm", reason="needs the extra realman")

REQUESTED = (
    "OVERSPEED",
    "OVERACCELERATION",
    "UNREACHABLE",
    "CIRCLE",
    "NO_WORK_FRAME",
    "NO_TOOL_FRAME",
    "JOINT_DISABLED",
)
STREAMED = (
    "TARGET_OVER_LIMIT", "SELF_COLLISION", "FENCE", "JOINT_OVERSPEED", "JOINT_POSITION_STEP", "COLLISION"
)  # fmt: skip


@pytest.mark.parametrize("arm", ["RM65", "RM75"])
def test_errors_come_with_their_reason_and_the_arm_moves_again(arm):
    with FaultLab(arm) as lab:
        assert {fault.name for fault in lab.faults} == {*STREAMED, *REQUESTED}
        for fault in lab.faults:
            demo = lab.provoke(fault)
            assert demo.reported == (fault,)
            assert demo.way_out[-2:] == ("recover", "move")
            assert demo.describe("sent", "en") != demo.describe("sent", "zh")
            assert np.isfinite(demo.moved.q).all()
            if fault.name in REQUESTED:
                assert demo.signal is None
            else:
                assert demo.condition is not None
                assert demo.condition.fault is fault
                assert demo.signal is not None
                assert demo.signal.is_broken
            for language in ("en", "zh"):
                shown = head_html(demo, Text(language)) + body_html(demo, Text(language))
                assert demo.fault.manual_name in shown
                assert "nan" not in shown.lower().replace("fenan", "")


def test_the_numbers_of_a_collision_are_the_controllers_own():
    with FaultLab("RM65") as lab:
        demo = lab.provoke(RealManError.COLLISION)
    assert demo.signal is not None
    assert not demo.signal.has_curve, "the interface reports no torques"
    assert demo.place in demo.sentence
    assert f"{abs(demo.value):.4g}" in demo.sentence
    assert abs(demo.bound) == pytest.approx(load_model("RM65").limits.joint.torque[demo.signal.axis - 1] / 9.0)


@pytest.mark.parametrize("name", sorted(set(ROBOTS) - {"RM65", "RM75"}))
def test_links_can_touch_on_every_arm(name):
    with FaultLab(name) as lab:
        assert lab.provoke(RealManError.SELF_COLLISION).reported == (RealManError.SELF_COLLISION,)
