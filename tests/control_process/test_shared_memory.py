"""The shared block and what lives in it."""

from __future__ import annotations

import math
import os
import pickle
import struct
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest

from rcilab.control_process import jitter_histogram as lateness
from rcilab.control_process.jitter_histogram import JitterHistogram, summarise
from rcilab.control_process.layout import MESSAGE_SIZE, MESSAGE_SLOTS, RING_CYCLES, VERSION, ControlBlock, Counter
from rcilab.control_process.messages import Reply, WorkerSettings, as_sendable
from rcilab.control_process.requests import MessageRing
from rcilab.control_process.snapshot import Snapshot, read_snapshot, write_snapshot
from rcilab.control_process.supervisor import build_settings
from rcilab.core import errors
from rcilab.core.command import JointPosition
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.cycle_recorder import Recorder
from rcilab.core.errors import (
    CommandRejectedError,
    ConnectionLostError,
    ControlError,
    InvalidValueError,
    PlanningError,
    RcilabError,
    UsageError,
    VersionMismatchError,
)
from rcilab.core.spatial import Pose
from rcilab.core.state import unknown_state
from rcilab.execution.recorder import CycleLog
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model


@pytest.fixture
def block():
    block = ControlBlock.create(7, {"arm": "seven joints"})
    yield block
    block.close()


def requests_of(block: ControlBlock) -> MessageRing:
    return MessageRing(block.requests, block.counters, Counter.REQUESTS_POSTED, Counter.REQUESTS_READ)


def write_rows(recorder: Recorder, block: ControlBlock, count: int) -> None:
    zeros = [0.0] * 7
    for _ in range(count):
        k = recorder.count
        recorder.write(k, k * 1e-3, k, k, 0.0, 1.0, [float(k)] * 7, zeros, zeros, zeros, 0, 0, (1, 5, 0))
        block.counters[Counter.CYCLES] = recorder.count


def test_the_other_side_sees_the_same_block(block):
    other = ControlBlock(os.dup(block.descriptor))
    block.counters[Counter.STOPS_REQUESTED] = 41
    block.motion[2] = range(7)
    assert other.n == 7
    assert other.settings == {"arm": "seven joints"}
    assert other.counters[Counter.STOPS_REQUESTED] == 41
    assert other.motion[2].tolist() == list(range(7))
    other.close()


@pytest.mark.parametrize(
    ("place", "value"), [(0, b"X"), (8, struct.pack("<I", VERSION + 1)), (12, struct.pack("<I", 6))]
)
def test_another_build_s_block_is_refused(block, place, value):
    os.pwrite(block.descriptor, value, place)
    with pytest.raises(VersionMismatchError, match="restart both sides"):
        ControlBlock(os.dup(block.descriptor))


def test_a_file_that_is_no_block_is_refused(tmp_path):
    (tmp_path / "short").write_bytes(b"RCI")
    with pytest.raises(VersionMismatchError):
        ControlBlock(os.open(tmp_path / "short", os.O_RDWR))


def test_the_block_has_no_name_that_could_be_left_behind():
    before = set(Path("/dev/shm").iterdir()) if Path("/dev/shm").is_dir() else set()
    block = ControlBlock.create(7, {})
    after = set(Path("/dev/shm").iterdir()) if Path("/dev/shm").is_dir() else set()
    assert after == before
    assert os.fstat(block.descriptor).st_nlink == 0
    block.close()


def test_messages_come_out_in_order_and_a_full_ring_is_an_error(block):
    box = requests_of(block)
    for number in range(3 * MESSAGE_SLOTS):
        box.post({"id": number})
        assert box.has_message
        assert box.pop() == {"id": number}
    assert box.pop() is None
    for number in range(MESSAGE_SLOTS):
        box.post({"id": number})
    with pytest.raises(UsageError, match="is too slow"):
        box.post({"id": 99})
    with pytest.raises(UsageError, match="is too long"):
        box.post({"id": "x" * MESSAGE_SIZE})


def test_the_ring_is_drained_once_and_in_order(block):
    recorder, reader = Recorder(7, RING_CYCLES, block.cycles), block.open_reader()
    assert reader.newest() is None
    assert len(reader.drain()) == 0
    write_rows(recorder, block, 100)
    assert reader.drain()["message_id"].tolist() == list(range(100))
    write_rows(recorder, block, 5)
    rows = reader.drain()
    assert rows["message_id"].tolist() == [100, 101, 102, 103, 104]
    assert rows["q"][0].tolist() == [100.0] * 7
    assert reader.newest()["message_id"][0] == 104


def test_an_overrun_is_counted_and_what_is_left_is_whole(block):
    recorder, reader = Recorder(7, RING_CYCLES, block.cycles), block.open_reader()
    write_rows(recorder, block, RING_CYCLES + 500)
    rows = reader.drain()
    first = int(rows["message_id"][0])
    assert rows["message_id"].tolist() == list(range(first, RING_CYCLES + 500))
    assert reader.overrun == first == rows["lost"][0]
    assert first >= 501  # The row that the writer may be writing right now counts as lost, too.


def test_a_snapshot_is_never_seen_half_written(block):
    """One thread writes snapshots whose fields belong together, the other must never see a mixture."""
    stop = threading.Event()

    def write():
        k = 0
        while not stop.is_set():
            k += 1
            write_snapshot(
                block.snapshot, block.counters, Snapshot(message=f"{k}", rate_hz=float(k), motion_time=float(k))
            )

    write_snapshot(block.snapshot, block.counters, Snapshot(message="0", rate_hz=0.0, motion_time=0.0))
    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(3000):
            seen = read_snapshot(block.snapshot, block.counters)
            assert float(seen.message) == seen.rate_hz == seen.motion_time
    finally:
        stop.set()
        writer.join()


def test_a_snapshot_comes_back_as_it_went_in_and_a_long_message_is_cut_at_a_character(block):
    snapshot = Snapshot(
        phase="moving", code="moving", message="臂" * 500, powered=True, is_fifo=True, memory_locked=True,
        inputs=2**32 - 1, outputs_known=2**32 - 1, outputs=2**31,
    )  # fmt: skip
    write_snapshot(block.snapshot, block.counters, snapshot)
    seen = read_snapshot(block.snapshot, block.counters)
    assert (seen.phase, seen.code, seen.powered, seen.is_fifo, seen.memory_locked) == (
        "moving",
        "moving",
        True,
        True,
        True,
    )
    assert (seen.inputs, seen.outputs_known, seen.outputs) == (2**32 - 1, 2**32 - 1, 2**31)
    assert seen.message == "臂" * 341
    assert seen.motion_time is None


def test_percentiles_of_the_histogram_are_those_of_the_numbers():
    rng = np.random.default_rng(5)
    numbers = 10.0 ** rng.uniform(-5.5, -2.5, 5000)
    words = memoryview(bytearray(8 * lateness.SIZE)).cast("Q")
    histogram = JitterHistogram(words)
    for number in numbers:
        histogram.add(float(number))
    figures = summarise(words)
    for share, found in ((0.5, figures.p50), (0.99, figures.p99), (0.999, figures.p999)):
        assert found == pytest.approx(np.quantile(numbers, share) * 1e6, rel=0.07)
    assert figures.max == pytest.approx(numbers.max() * 1e6, rel=1e-3)
    assert figures.cycles == figures.histogram.sum() == 5000
    assert lateness.late_cycles(words) == (numbers > 1e-3).sum()
    histogram.add(0.0)
    histogram.add(1e9)
    assert summarise(words).cycles == 5002
    histogram.clear()
    assert summarise(words).cycles == 0


def test_settings_pass_through_the_block():
    model = load_model("xMate3", tool=Pose((0.0, 0.0, 0.1)))
    block = ControlBlock.create(6, build_settings(model))
    settings = ControlBlock(os.dup(block.descriptor)).settings
    block.close()
    assert isinstance(settings, WorkerSettings)
    assert (settings.arm.n, settings.arm.name) == (6, "xMate3")
    assert settings.T_flange_tool.is_close(model.T_flange_tool, 0.0)
    assert np.array_equal(settings.limits.joint.jerk, model.limits.joint.jerk)
    assert settings.limits.cartesian == model.limits.cartesian


def send(block: ControlBlock, error: Exception) -> RcilabError:
    box = MessageRing[Reply](block.replies, block.counters, Counter.REPLIES_POSTED, Counter.REPLIES_READ)
    box.post(Reply(1, as_sendable(error)))
    reply = box.pop()
    assert reply is not None
    assert reply.error is not None
    return reply.error


def test_an_error_keeps_its_class_its_sentence_and_its_faults(block):
    error = ControlError("joint 4 was too fast", (Fault.COLLISION,), np.zeros(50, cycle_dtype(7)))
    error.stop = np.zeros(500, cycle_dtype(7))
    back = send(block, error.coded("fast", joint=4))
    assert type(back) is ControlError
    assert (str(back), back.faults, back.code, back.facts) == (str(error), (Fault.COLLISION,), "fast", {"joint": 4})
    assert (back.record, back.stop) == (None, None)  # The cycles are in the ring.
    assert len(error.record) == 50
    assert isinstance(send(block, ConnectionLostError("gone")), ConnectionLostError)
    assert "ZeroDivisionError" in str(send(block, ZeroDivisionError("x")))
    refused = send(block, CommandRejectedError("StartMove", rci.StartStatus.REFLEX, "recover()", reason="fault"))
    assert isinstance(refused, CommandRejectedError)
    assert (refused.command, refused.status) == ("StartMove", rci.StartStatus.REFLEX)


def test_an_error_that_does_not_fit_or_cannot_be_pickled_keeps_its_class_and_the_beginning_of_its_sentence(block):
    back = send(block, PlanningError("x" * 10 * MESSAGE_SIZE))
    assert (type(back), set(str(back))) == (PlanningError, {"x"})
    back = send(block, InvalidValueError("callback", lambda: None, "is not a number"))
    assert isinstance(back, InvalidValueError)
    assert "is not a number" in str(back)


FAMILY = (
    errors.RcilabError("root"),
    errors.ModelError("m"),
    errors.KinematicsError("k"),
    errors.UnreachableError("u", distance=0.1, joint=2, excess=0.3),
    errors.SingularError("s"),
    errors.PlanningError("p", share=0.5, waypoint=3),
    errors.ConformanceError("c", ["one", "two"]),
    errors.CertificateError("c", ["tool"]),
    errors.ProtocolError("p"),
    errors.DecodeError("d", 12),
    errors.VersionMismatchError("file", 1, 2),
    errors.RecordedError("r", np.zeros(2)),
    errors.ConnectionLostError("gone"),
    errors.CommandRejectedError("StartMove", rci.StartStatus.REFLEX, "recover()", reason="fault"),
    errors.ManualRecoveryError("recover", rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED),
    errors.ControlError("stopped", (Fault.COLLISION,), np.ones(3)),
    errors.DeadlineError("late"),
    errors.UsageError("wrong order"),
    errors.InvalidValueError("q", [1.0], "must have 7 numbers"),
)


def kinds_of(kind: type) -> set[type]:
    return {kind}.union(
        *(kinds_of(other) for other in kind.__subclasses__() if other.__module__.startswith("rcilab.core.error"))
    )


def test_every_class_of_the_family_passes_through_pickle_whole():
    assert {type(error) for error in FAMILY} == kinds_of(errors.RcilabError)
    for error in FAMILY:
        inner = errors.UsageError("inner").coded("moving")
        error.coded(error.code or "outer", **{**error.facts, "reason": inner}).add_note("a note")
        back = pickle.loads(pickle.dumps(error))
        assert (type(back), str(back), back.args) == (type(error), str(error), error.args)
        assert back.__dict__.keys() == error.__dict__.keys()
        assert (back.code, back.__notes__) == (error.code, ["a note"])
        assert back.facts["reason"].code == "moving"
        for name, value in error.__dict__.items():
            assert name == "facts" or np.array_equal(back.__dict__[name], value), name


def test_a_row_takes_what_was_written():
    recorder = Recorder(6, 4)
    six = [float(k) for k in range(6)]
    for number in range(6):
        recorder.write(number, 0.1, 10, 20, 1e-4, 0.9, six, six, six, six, 1 << 15, 2, (2, 0, 1))
    row = recorder.last(1)[0]
    assert cycle_dtype(6) == recorder.rows().dtype
    assert (row["message_id"], row["t"], row["sent_ns"], row["lost"], row["faults"]) == (5, 0.1, 20, 2, 1 << 15)
    assert (row["robot_mode"], row["controller_mode"], row["motion_generator_mode"]) == (2, 0, 1)
    assert row["command"].tolist() == six
    assert recorder.truncated
    assert recorder.rows()["message_id"].tolist() == [2, 3, 4, 5]


def test_a_row_that_repeats_is_the_row_that_would_have_been_written():
    random = Random(3)
    decoder, quick, thorough = rci.StateDecoder(), CycleLog(Recorder(7, 50)), CycleLog(Recorder(7, 50))
    body = bytearray(rci.STATE_SIZE)
    number = 0
    for _ in range(400):
        if random.random() < 0.2:
            body[random.randrange(8, rci.STATE.offset("motion_generator_mode"))] = random.randrange(2)
        if random.random() < 0.02:
            quick.restart()
            thorough.restart()
            number = 0
        number += random.choice((1, 1, 1, 3))
        datagram = number.to_bytes(8, "big") + bytes(body[8:])
        arrived = number * 1_000_000 + random.randrange(400_000)
        is_moving = random.random() < 0.2
        answer = (0.1, arrived + 50, JointPosition(q=np.full(7, 0.3))) if is_moving else ()
        quick.write(decoder.decode(datagram, 7), arrived, *answer)
        thorough.write(rci.decode_state(datagram, 7), arrived, *answer)
        assert quick.recorder.last(1).tobytes() == thorough.recorder.last(1).tobytes()
        assert (quick.lateness, quick.lost_total) == (thorough.lateness, thorough.lost_total)


def test_lateness_is_against_the_robot_s_grid_and_forgets_a_slip():
    def late(arrivals_ms):
        log, found = CycleLog(Recorder(7, 100)), []
        for number, arrival in enumerate(arrivals_ms):
            datagram = number.to_bytes(8, "big") + bytes(rci.STATE_SIZE - 8)
            log.write(rci.decode_state(datagram, 7), round(arrival * 1e6))
            found.append(round(log.lateness * 1e3, 6))
        return found

    assert late([0, 1, 2.3, 3, 4]) == [0, 0, 0.3, 0, 0]
    assert late([0, 1, 5, 5, 5, 5, 6]) == [0, 0, 3, 2, 1, 0, 0]
    assert late([0, *range(2, 22)])[-1] == 0  # The controller left a cycle out: its grid has moved.


def test_states_that_come_every_tenth_cycle_are_lost_only_where_one_is_missing():
    log = CycleLog(Recorder(7, 100), state_cycles=10)
    for number in (510, 520, 530, 560, 565, 580):
        log.write(replace(unknown_state(7), message_id=number), 0)
    assert log.recorder.rows()["lost"].tolist() == [0, 0, 0, 2, 0, 0]
    assert log.lost_total == 2


def test_a_state_that_nobody_waited_for_is_recorded_and_tells_nothing_of_lateness():
    log, found = CycleLog(Recorder(7, 100)), []
    cycles = (0.0, True), (4.0, False), (4.0, False), (4.0, False), (4.1, True)
    for number, (arrival, is_awaited) in enumerate(cycles):
        datagram = number.to_bytes(8, "big") + bytes(rci.STATE_SIZE - 8)
        log.write(rci.decode_state(datagram, 7), round(arrival * 1e6), is_awaited=is_awaited)
        found.append(round(log.lateness * 1e3, 6))
    assert np.array_equal(found, [0, math.nan, math.nan, math.nan, 0.1], equal_nan=True)
    assert log.recorder.rows()["message_id"].tolist() == [0, 1, 2, 3, 4]
    assert np.isnan(log.recorder.rows()["lateness"]).tolist() == [False, True, True, True, False]
    assert log.lost_total == 0


def test_the_control_process_imports_nothing_that_draws():
    code = "import sys, rcilab.control_process.worker; print(' '.join(sorted(m.split('.')[0] for m in sys.modules)))"
    loaded = set(
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    )
    assert "rcilab" in loaded
    banned = {"viser", "meshcat", "yourdfpy", "trimesh", "jupyterlab", "IPython", "ipykernel", "ipywidgets"}
    assert not loaded & (banned | {"matplotlib", "mujoco", "pinocchio"})
