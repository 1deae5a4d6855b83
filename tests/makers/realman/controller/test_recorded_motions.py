"""Record and log of a virtual RealMan arm: a motion for each one that the controller plans, and for a stream."""

from __future__ import annotations

from rcilab.core.cycle_ring import CycleRing
from rcilab.recording.client_motions import ClientMotions
from rcilab.sim.cycle_capture import CycleCapture
from tests.makers.realman.controller.bench import Bench

PAUSE = 50  # [cycles] Between two motions, or commands of a stream.


def test_each_planned_motion_and_a_stream_with_gaps_is_one_of_record_and_log() -> None:
    bench = Bench("RM65")
    facts = {"model": "RM65", "plant": "ideal", "url": "realman://127.0.0.1", "realtime": False}
    ring = CycleRing.create(6, facts)
    capture, motions = CycleCapture(ring, bench.controller), ClientMotions(ring)

    def run(cycles: int) -> None:
        for _ in range(cycles):
            bench.run(1)
            capture.write()

    def move(command: str, angle: int, **fields: object) -> None:
        bench.send(command, joint=[*bench.q[:5], angle], **fields)
        run(1)
        while bench.controller.is_moving:
            run(1)
        run(PAUSE)

    for angle in (5000, 10000):
        move("movej", angle, v=50, r=0, trajectory_connect=0)
    run(600)
    for angle in (11000, 12000):
        move("movej_canfd", angle, follow=True)
    run(600)
    parts = motions.poll(is_last=True)
    assert [part.motion.number for part in parts] == [1, 2, 3]
    assert all(part.end is not None and part.end.stopped is None for part in parts)
    logged = [kind for kind, _ in bench.logged if kind.startswith("motion_")]
    assert logged == ["motion_started", "motion_ended"] * 3
