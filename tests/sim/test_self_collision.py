"""Self-collision: contact is an error, unless the links touched from the start of the motion and have not parted."""

from __future__ import annotations

import numpy as np

from rcilab.model.robot_model import load_model
from rcilab.sim.self_collision import SelfCollisionWatch

MODEL = load_model("xArm6")
FOLDED = np.array([0.0, -0.21, 0.14, 0.0, 1.51, 0.0])


def between(share):
    """Joint angles from home to where the last link is in the base."""
    return MODEL.home + share * (FOLDED - MODEL.home)


def found(watch, start, end):
    """Shares on the way at which contact is found."""
    return [share for share in np.linspace(start, end, 200) if watch.step(between(share)) is not None]


def test_links_that_touch_at_the_start_may_part_and_then_not_touch_again():
    watch = SelfCollisionWatch(MODEL)
    watch.begin(between(0.95))
    assert not found(watch, 0.95, 0.5)
    first, *_ = found(watch, 0.5, 0.99)
    assert 0.93 < first < 0.945
    watch.begin(between(0.95))
    first, *_ = found(watch, 0.95, 0.99)
    assert 0.95 < first < 0.951
