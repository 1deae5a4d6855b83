"""Response time of the client to a state."""

from __future__ import annotations

import numpy as np

from rcilab.control_process.simulate import simulate
from rcilab.core.command import JointPosition
from rcilab.core.state import RobotState
from rcilab.diagnostics.bench.measure import Measurement, summarise
from rcilab.model.robot_model import load_model

_ROBOT = "xMatePro7"
_DURATION = 3.0  # [s]


def bench_client_answer() -> Measurement:
    """From the receipt of a state to the sending of its command, with a minimal callback, free-running."""
    model = load_model(_ROBOT)

    def stay(state: RobotState, t: float) -> JointPosition:
        return JointPosition(state.q_c, finished=t >= _DURATION)

    with simulate(model, lockstep=False) as robot:
        robot.power_on()
        cycles = robot.control(stay).cycles
    answered = cycles[cycles["sent_ns"] != 0]
    times = 1e-9 * (answered["sent_ns"] - answered["received_ns"])
    # Queued states have the time of arrival of an earlier state: they are excluded.
    alone = np.flatnonzero(np.diff(answered["received_ns"], prepend=0))
    note = f"{_ROBOT}, {len(answered)} states of a controller at 1 kHz, decoding, checks, record and encoding included"
    return summarise("client_answer", times[alone], "us", 120.0, note)
