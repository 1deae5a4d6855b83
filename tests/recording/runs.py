"""A run whose error is known: the arm follows its plan one cycle late, and joint 2 with a known offset."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from io import BytesIO
from typing import Any

import numpy as np

from rcilab.core.cycle_recorder import Recorder
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint, plan_stop
from rcilab.recording.export import write_export
from rcilab.recording.run import Run, build_run
from rcilab.recording.run_setup import Setup

MODEL = load_model("xMatePro7", tool=Pose((0.0, 0.01, 0.12), (0.9, 0.1, 0.2, 0.3)), load=Payload(mass=1.5))
PLAN = plan_joint(MODEL, MODEL.home, MODEL.home + 0.2, speed=0.3)
SETUP = Setup(target="virtual", plant="mujoco", mode="joint_position", started_ns=1_700_000_000_123_456_789)
OFFSET = 1e-3  # [rad] of joint 2.


@lru_cache
def some_cycles(count: int | None = None) -> np.ndarray:
    rows = PLAN.q if count is None else PLAN.q[:count]
    recorder = Recorder(7, len(rows))
    for k, q in enumerate(rows):
        before = rows[max(k - 1, 0)]
        measured = before + OFFSET * np.eye(7)[1]
        stamp = 1_000_000 * k
        recorder.write(
            k + 5, k * 1e-3, stamp, stamp + 90_000, 2e-5, 1.0,
            measured, before, PLAN.dq[k], q, 0, 0, (1, 1, 1), [1.0] * 7
        )  # fmt: skip
    return recorder.rows()


def some_long_run(times: int = 60) -> Run:
    """The same cycles again and again, for what takes long."""
    cycles = np.tile(some_cycles(), times)
    cycles["t"], cycles["message_id"] = 1e-3 * np.arange(len(cycles)), 5 + np.arange(len(cycles))
    return build_run(cycles, plan=None, model=MODEL, setup=SETUP)


def some_ideal_run() -> Run:
    """An arm that is exactly where it is told to be."""
    cycles = some_cycles().copy()
    cycles["q"] = cycles["q_c"]
    return build_run(cycles, plan=PLAN, model=MODEL, setup=replace(SETUP, plant="ideal"))


def some_stopped_run(place: int = 300) -> Run:
    """Somebody presses Stop: from a cycle on what is sent brings the arm to rest, and one cycle later it brakes."""
    cycles = some_cycles().copy()
    q, dq, ddq = PLAN.q[place - 1], PLAN.dq[place - 1], PLAN.ddq[place - 1]
    way = plan_stop(MODEL.limits.joint, q, dq, ddq).q[1:]
    cycles["command"][place:] = way[np.minimum(np.arange(len(cycles) - place), len(way) - 1)]
    cycles["q_c"][place + 1 :] = cycles["command"][place:-1]
    cycles["q"] = cycles["q_c"] + OFFSET * np.eye(7)[1]
    cycles["braking"][place:] = 1
    cycles = cycles[: place + len(way) + 5]
    return build_run(cycles, plan=PLAN, model=MODEL, setup=SETUP, stopped="on request")


def some_run(**facts) -> Run:
    return build_run(some_cycles(), plan=PLAN, model=MODEL, setup=SETUP, **facts)


def export_run(run: Run, ending: str, **options: Any) -> bytes:
    """Returns what `Run.save` writes to a file with this ending."""
    stream = BytesIO()
    write_export(run, ending, stream, **options)
    return stream.getvalue()
