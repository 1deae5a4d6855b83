"""A newcomer's first plan meets the recommended conditions too, wherever it is made."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from rcilab.app.app_state import AppState
from rcilab.app.planning import make_plan
from rcilab.conformance.check import check
from rcilab.core.spatial import Pose
from rcilab.execution.session import RobotSession
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
DEFAULTS = {field.name: field.default for field in fields(AppState)}


def first_goal(model) -> np.ndarray:
    target = model.forward(model.home) @ Pose([0.0, 0.0, 0.10])
    return model.inverse(target).nearest(model.home)


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7", "xMate3", "xMate7"])
def test_page_and_notebook_plan_without_a_footnote_as_they_come(name):
    model = load_model(name)
    plan = make_plan(
        model, model.home, first_goal(model), DEFAULTS["speed"], DEFAULTS["law"], None, DEFAULTS["path_type"], None
    )
    assert plan.report.ok
    assert plan.report.warnings == ()


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7", "xMate3", "xMate7"])
def test_the_vendor_s_move_has_none_at_its_own_speed(name):
    model = load_model(name)
    speed = RobotSession.move_j.__defaults__[0]
    report = check(plan_joint(model, model.home, first_goal(model), speed=speed, law="s_profile"), model)
    assert report.ok
    assert report.warnings == ()


def test_the_readme_s_first_plan_has_none():
    code = re.findall(r"```python\n(.*?)```", README, re.DOTALL)[0]
    scope: dict[str, object] = {}
    exec(code[: code.index("with rcilab.simulate")], scope)
    assert scope["report"].warnings == ()
