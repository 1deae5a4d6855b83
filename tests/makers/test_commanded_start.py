"""Where an arm is commanded, if its states have single precision."""

from __future__ import annotations

import numpy as np

from rcilab.makers.maker import commanded_start
from rcilab.model.robot_model import load_model


def test_a_start_that_the_state_has_only_rounded_is_where_the_arm_is():
    model = load_model("FR3")
    reported = model.home.astype(np.float32).astype(np.float64)
    assert np.abs(reported - model.home).max() > 1e-9
    assert commanded_start(model.home, reported, model) is model.home
    assert commanded_start(model.home + 1e-6, reported, model) is reported
    assert commanded_start(model.home[:6], reported, model) is reported


def test_a_state_of_doubles_is_taken_as_it_is():
    for name in ("Panda", "xMatePro7"):
        model = load_model(name)
        near = model.home + 1e-8
        assert commanded_start(model.home, near, model) is near
