"""States of controllers that report less than a whole one."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from rcilab.core.state import RobotMode, unknown_state


def test_an_unknown_state_has_every_field_and_takes_what_is_known():
    state = unknown_state(6)
    arrays = [value for field in fields(state) if isinstance(value := getattr(state, field.name), np.ndarray)]
    assert {array.shape for array in arrays} == {(6,)}
    assert all(np.isnan(array).all() and not array.flags.writeable for array in arrays)
    assert (state.faults, state.robot_mode) == ((), RobotMode.IDLE)
    q = np.arange(6.0)
    known = replace(state, message_id=3, q=q)
    assert (known.message_id, known.q.tolist()) == (3, q.tolist())
    assert unknown_state(7).tau.shape == (7,)
    assert unknown_state(7).tau_ext_in_base.shape == (6,)
