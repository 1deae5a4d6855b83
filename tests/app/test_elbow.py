"""The free arm angles that page and notebook name, and the one that the arm takes instead of a forbidden one, agree."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from rcilab.app.goal.elbow import compute_elbow, in_branch, nearest_free
from rcilab.app.goal.goal import goal_toward
from rcilab.app.text import Text
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.workbench.panels.elbow import no_ring_html, ring_html

POSES, ANGLES = 80, 6
EN = Text("en")


def free_in_words(elbow) -> list[tuple[int, int]]:
    """The ranges behind "Feasible:", in whole degrees as they are written; none for any other sentence."""
    said = re.search(r'aria-label="([^"]*)"', ring_html(elbow, EN))[1]
    numbers = [int(number.replace("−", "-")) for number in re.findall(r"[−-]?\d+(?=°)", said)]
    ranges = list(zip(numbers[::2], numbers[1::2], strict=True)) if said.startswith("Feasible: ") else []
    assert all(low <= high for low, high in ranges)  # A reader takes 122 ... 100 for a mistake.
    return ranges


def is_in(ranges, psi: float) -> bool:
    angle = round(math.degrees(psi))
    return any((angle - low) % 360 <= ((high - low) % 360 or 360) for low, high in ranges)


def is_free(elbow, psi: float, margin: float) -> bool:
    return any(
        margin < (psi - arc.start) % math.tau < arc.end - arc.start - margin for arc in elbow.arcs if arc.kind == "free"
    )


@pytest.mark.parametrize("is_held", [False, True], ids=["any branch", "branch held"])
@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7"])
def test_the_nearest_arm_angle_is_free_and_what_was_refused_is_not(name, is_held):
    model = load_model(name)
    rng = np.random.default_rng(18)
    moved = 0
    for _ in range(POSES):
        q = rng.uniform(model.limits.joint.lower + 0.02, model.limits.joint.upper - 0.02)
        target, elbow = model.forward(q), compute_elbow(model, q, None)
        if elbow is None:
            continue
        branch = elbow.branch if is_held else None
        for asked in rng.uniform(-math.pi, math.pi, ANGLES).tolist():
            psi, why = nearest_free(model, target, asked, branch)
            near = None if branch is None else in_branch(model, target, psi, q, branch)
            goal = goal_toward(model, target, q if near is None else near, psi, why)
            assert goal.reach.tone != "bad"
            assert math.remainder(goal.psi - psi, math.tau) == pytest.approx(0.0, abs=1e-6)
            shown = compute_elbow(model, goal.q, None)
            assert branch is None or near is None or shown.branch == branch
            if why is None or why.code != "elbow.snapped":
                continue
            moved += 1
            assert is_free(shown, psi, 0.0)
            assert is_in(free_in_words(shown), psi)
            assert not is_free(shown, asked, 1e-6)
    assert moved > 50


def test_without_a_free_arm_angle_none_is_called_free():
    model = load_model("xMatePro7")
    box = SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=Pose((2.0, 0.0, 0.0)))
    target = model.forward(model.home)
    for place in (None, box):
        psi, why = nearest_free(model, target, 2.5, box=place)
        goal = goal_toward(model, target, model.home, psi)
        is_said = "feasible range" in EN.render(why)
        assert is_said == bool(free_in_words(compute_elbow(model, goal.q, place))) == (place is None)


def test_an_arm_angle_that_only_a_singularity_forbids_is_taken_as_it_is():
    model = load_model("xMatePro7")
    q = np.array([0.4, 0.9, 0.3, 1.0, 0.2, 0.003, 0.1])
    psi = model.arm_angle(q)
    assert "singularity" in model.feasible_arcs(model.forward(q)).at(psi).reasons
    assert nearest_free(model, model.forward(q), psi) == (psi, None)


def test_an_arm_whose_elbow_follows_no_circle_is_not_called_stretched():
    for name, said in (("xMatePro7", "stretched"), ("Panda", "does not move on a circle: ψ is the angle of joint 3")):
        assert said in no_ring_html(load_model(name).redundancy, EN)
