"""FaultPanel: a fault of the gallery beside the notebook's own robot, which it never touches."""

from __future__ import annotations

import html
import math
import os
import re
import threading
from typing import Any

import numpy as np

import rcilab
from rcilab.faults import Fault
from rcilab.language import LANGUAGES
from rcilab.notebook import FaultPanel
from rcilab.words.text import load_face
from tests.waiting import wait_for

PRO7 = rcilab.load_model("xMatePro7")


def text_of(widget: Any) -> str:
    return html.unescape(re.sub(r"<[^>]*>", "", widget.value))


def children() -> set[str]:
    found: set[str] = set()
    for task in os.listdir("/proc/self/task"):
        with open(f"/proc/self/task/{task}/children", encoding="ascii") as file:
            found |= set(file.read().split())
    return found


def test_a_fault_is_provoked_on_a_private_controller_and_the_session_is_left_alone() -> None:
    with rcilab.simulate(PRO7) as robot:
        before = robot.receive_state()
        own = children()
        with FaultPanel(robot, language="zh") as panel:
            panel.fault.value = Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY
            panel.provoke.click()
            assert panel.provoke.disabled
            assert panel.cancel.layout.display is None
            wait_for(lambda: panel.exhibit is not None and not panel.provoke.disabled, 30.0, "the exhibit")
            assert panel.exhibit is not None
            said = text_of(panel._told)
            assert "kCommandJointAccelerationDiscontinuity" in said
            assert f"{math.degrees(5000.0):.0f}°/s³" in said  # Five thousand rad/s^3, in the degrees of every widget.
            for part in (panel.exhibit.told("cause", "zh"), *panel.exhibit.tell_way_out("zh"), panel.exhibit.script):
                assert part in said
            assert "<circle" in panel._told.value
            assert panel.progress.layout.display == "none"
            panel.fault.value = Fault.COLLISION
            assert "<circle" not in panel._told.value
            assert len(children() - own) == 1
        assert children() == own
        after = robot.receive_state()
        np.testing.assert_array_equal(after.q_c, before.q_c)
        assert after.faults == ()


def test_who_cancels_or_closes_sees_nothing_and_leaves_nothing_behind() -> None:
    own, threads = children(), threading.active_count()
    with FaultPanel(PRO7) as panel:
        panel.provoke.click()
        panel.cancel.click()
        wait_for(lambda: not panel.provoke.disabled, 10.0, "the button again")
        assert panel.exhibit is None
        panel.provoke.click()
    wait_for(lambda: threading.active_count() == threads, 10.0, "the end of the threads")
    assert children() == own


def test_an_arm_of_six_axes_is_told_which_fault_it_cannot_have() -> None:
    with FaultPanel(rcilab.load_model("xMate7")) as panel:
        panel.fault.value = Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION
        assert panel.provoke.disabled
        assert "7 axes" in text_of(panel._told)
        panel.fault.value = Fault.COLLISION
        assert not panel.provoke.disabled


def test_every_fault_has_a_short_name_in_both_languages() -> None:
    for language in LANGUAGES:
        assert {f"learn.fault.{fault.name}" for fault in Fault} <= load_face("rcilab.notebook", language).keys()
