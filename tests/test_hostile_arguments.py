"""Arguments that a script gets wrong, or that somebody chose with care: one sentence, and nothing is bypassed."""

from __future__ import annotations

import numpy as np
import pytest

import rcilab
from rcilab.core.errors import InvalidValueError

MODEL = rcilab.load_model("xMatePro7")
HUGE = [10**400, 0, 0, 0, 0, 0, 0]


@pytest.mark.parametrize(
    "call",
    [
        lambda: rcilab.plan_joint(MODEL, MODEL.home, HUGE),
        lambda: MODEL.forward(HUGE),
        lambda: MODEL.jacobian(HUGE),
        lambda: MODEL.clearance(HUGE),
        lambda: rcilab.Pose(HUGE[:3]),
        lambda: rcilab.plan_recovery(MODEL, HUGE),
        lambda: rcilab.Motion.from_samples([HUGE, HUGE], dt=0.001),
        lambda: rcilab.Motion.from_cycles([HUGE, HUGE]),
        lambda: rcilab.SafetyBox(size=(10**400, 1, 1), T_base_box=rcilab.Pose()),
        lambda: rcilab.Waypoint.joint(HUGE),
    ],
)
def test_an_integer_beyond_every_float_is_a_value_like_others(call):
    with pytest.raises(InvalidValueError):
        call()


DEGREES = [0.0, 30.0, 0.0, 60.0, 0.0, 90.0, 0.0]


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: rcilab.plan_joint(MODEL, DEGREES, MODEL.home), "start"),
        (lambda: rcilab.plan_joint(MODEL, MODEL.home, DEGREES), "goal"),
        (lambda: MODEL.with_joint_limits(MODEL.limits.joint.lower, DEGREES), "upper"),
        (lambda: rcilab.Motion.from_samples([MODEL.home, DEGREES], dt=1.0), "q"),
    ],
)
def test_degrees_by_mistake_are_named_with_the_remedy(call, name):
    with pytest.raises(InvalidValueError, match=rf"{name} of joint 6.*: 90\.0 rad .* np\.radians\({name}\)"):
        call()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: rcilab.Program(model="xMatePro7", start=MODEL.home, waypoints=None),
            "waypoints must be a list.*, got None",
        ),
        (lambda: MODEL.limits.source([]), "limit: .* is unknown; known: joint.lower"),
        (lambda: rcilab.Monitor(MODEL, np.array(["a", "b"])), "mode: .* is unknown"),
    ],
)
def test_things_of_another_kind_are_named(call, said):
    with pytest.raises(InvalidValueError, match=said):
        call()


def test_a_callback_that_is_none_is_refused_before_anything_starts():
    with rcilab.simulate(MODEL) as robot:
        robot.power_on()
        with pytest.raises(InvalidValueError, match=r"callback must be a function .*, got 5"):
            robot.control(5)
        assert robot.state.controller_mode.name == "OTHER"


@pytest.mark.parametrize("rows", ["times", "q", "dq", "ddq", "jerk"])
def test_rows_that_were_judged_cannot_be_made_writable_again(rows):
    motion = rcilab.plan_joint(MODEL, MODEL.home, MODEL.home + 0.1)
    with pytest.raises(ValueError, match="cannot set WRITEABLE"):
        getattr(motion, rows).flags.writeable = True
