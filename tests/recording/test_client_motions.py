"""The controller's own record of a foreign client: a scripted peer of the vendor's library, over real sockets."""

from __future__ import annotations

import os
import re
import shutil
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.cycle_ring import CAPACITY, CycleRing, RingCounter
from rcilab.core.errors import UsageError, VersionMismatchError
from rcilab.i18n.error_messages import describe_note
from rcilab.i18n.translator import Text
from rcilab.model.robot_model import load_model
from rcilab.recording.client_motions import LAG, ClientMotions, MotionPart
from rcilab.recording.client_recorder import ClientRecorder
from rcilab.recording.client_report import report_on_client
from rcilab.recording.columns import facts_text
from rcilab.recording.html_facts import fact_rows
from rcilab.recording.run import Run, build_run, load_run
from rcilab.recording.sent_motion import check_sent, sent_motion
from tests.peers import programs, wire
from tests.peers.arena import Arena, arena
from tests.peers.robot import UNFILTERED, ControlException, Output, Robot
from tests.waiting import wait_for

NEAR = tuple(angle + 0.02 for angle in programs.START[7])  # [rad]
SECONDS = 1.0  # [s]
MODEL = load_model("xMatePro7")


@contextmanager
def watched(**options: Any) -> Iterator[tuple[Arena, ClientMotions]]:
    with arena(is_recorded=True, **options) as place:
        assert place.server.ring is not None
        yield place, ClientMotions(CycleRing.attach(os.getpid(), place.server.ring.descriptor))


def record_two_motions(folder: Path, program: Callable[..., Any]) -> list[str]:
    """Records a preparing motion and a program of a peer; returns the lines for the log."""
    lines: list[str] = []
    with arena(is_recorded=True) as place:
        assert place.server.ring is not None
        recorder = ClientRecorder(folder, place.server.ring, lambda kind, text: lines.append(text))
        with place.connect() as robot:
            programs.prepare(robot, NEAR, factor=1.0)
            program(robot, SECONDS, period=SECONDS)
            assert not any(state.errors for state in robot.states)
        wait_for(lambda: (recorder.poll(), len(lines) == 2)[1])
    return lines


def collect(motions: ClientMotions, count: int) -> list[list[MotionPart]]:
    """The parts of the next motions that end, one list a motion."""
    found: list[list[MotionPart]] = [[]]

    def has_ended() -> bool:
        for part in motions.poll():
            found[-1].append(part)
            if part.end is not None:
                found.append([])
        return len(found) > count

    wait_for(has_ended)
    return found[:count]


def as_run(parts: list[MotionPart]) -> Run:
    motion = parts[0].motion
    cycles = np.concatenate([part.cycles for part in parts])
    return build_run(cycles, plan=None, model=motion.model, setup=motion.setup, realtime=False)


def start_moving(robot: Robot) -> wire.State:
    """Starts a joint motion; returns the first state that is to be answered."""
    robot.start_move(wire.JOINT_POSITION, wire.JOINT)
    state = robot.receive_fresh_state()
    while state.robot_mode != wire.ROBOT_MOVE:
        state = robot.receive_fresh_state()
    return state


def sent_commands(robot: Robot) -> list[bytes]:
    """Keeps every datagram that a peer sends."""
    kept: list[bytes] = []
    send = robot._udp.sendto

    class Tapped:
        def sendto(self, data: bytes, address: tuple[str, int]) -> int:
            kept.append(data)
            return send(data, address)

        def __getattr__(self, name: str) -> Any:
            return getattr(udp, name)

    udp, robot._udp = robot._udp, Tapped()  # type: ignore[assignment]
    return kept


PROGRAMS: dict[str, tuple[Callable[..., Any], str, slice]] = {
    "joint_position": (programs.joint_sine, "command", slice(8, 64)),
    "cartesian_position": (programs.line, "command_pose", slice(64, 192)),
    "torque": (programs.torque, "command_tau", slice(-56, None)),
}


@pytest.mark.parametrize("mode", PROGRAMS)
def test_every_command_of_a_client_is_recorded_bit_for_bit(mode: str) -> None:
    program, field, part_of_datagram = PROGRAMS[mode]
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        sent = sent_commands(robot)
        program(robot, SECONDS, period=SECONDS)
        parts = collect(motions, 2)[1]
    run, end = as_run(parts), parts[-1].end
    assert (run.setup.mode, run.setup.client) == (mode, "127.0.0.1")
    answered = run.cycles[run.cycles["sent_ns"] != 0]
    assert [row.tobytes() for row in answered[field]] == [data[part_of_datagram] for data in sent]
    assert [int.from_bytes(data[:8], "big") for data in sent] == answered["message_id"].tolist()
    assert end is not None
    assert (end.stopped, end.received, end.lost) == (None, len(sent), 0)
    played = np.flatnonzero(run.cycles["played"])
    sources = played - run.cycles["age"][played].astype(int)
    assert run.cycles["message_id"][sources].tolist() == answered["message_id"].tolist()


def test_a_recorded_motion_sent_again_moves_the_arm_alike(tmp_path: Path) -> None:
    """The same commands give the same commanded angles, bit for bit, also from a file."""
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        programs.joint_sine(robot, SECONDS, period=SECONDS)
        first = as_run(collect(motions, 2)[1])
    first.save(tmp_path / "first.rcirun")
    loaded = load_run(tmp_path / "first.rcirun")
    assert loaded.cycles.tobytes() == first.cycles.tobytes()
    assert loaded.setup == first.setup
    commands = iter(loaded.command[loaded.cycles["sent_ns"] != 0].tolist())
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.filter_frequency = UNFILTERED
        count = int((loaded.cycles["sent_ns"] != 0).sum())
        outputs = [Output(q=tuple(next(commands))) for _ in range(count)]
        outputs.append(Output(q=outputs[-1].q, finished=True))  # The library sends nothing for the last one.
        queue = iter(outputs)
        robot.start_move(wire.JOINT_POSITION, wire.JOINT)
        robot.control(lambda state: next(queue))
        second = as_run(collect(motions, 2)[1])
    rows = min(len(first.q_c), len(second.q_c))
    assert rows > 0.9 * len(first.q_c)
    assert second.q_c[:rows].tobytes() == first.q_c[:rows].tobytes()


def test_a_refused_command_is_recorded_with_its_fault() -> None:
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        with pytest.raises(ControlException):
            programs.joint_sine(robot, SECONDS, period=0.05)
        parts = collect(motions, 2)[1]
    run, end = as_run(parts), parts[-1].end
    assert end is not None
    assert end.stopped is not None
    assert "jerk" in end.stopped
    assert run.faults
    faulty = int(np.flatnonzero(run.cycles["faults"])[0])
    assert run.cycles["sent_ns"][faulty - int(run.cycles["age"][faulty])] == run.cycles["sent_ns"].max()
    found = report_on_client(run, end)
    assert "stopped: joint 1: commanded" in found.line
    assert all(part in found.text for part in end.stopped.parts)


def test_a_motion_that_the_controller_stopped_lasts_until_then() -> None:
    """In the log, in the run and in its report; a gap of the client at its end is within it."""
    with watched(lockstep=False) as (place, motions), place.connect() as robot:
        robot.set_motor_power(1)
        state = start_moving(robot)
        for _ in range(100):
            robot.answer(state, Output(q=state.q_c[:7]))
            state = robot.next_state(state.message_id)
        parts = collect(motions, 1)[0]
        (ended,) = (entry for entry in place.entries if entry.kind == "motion_ended")
    run = as_run(parts)
    assert run.faults
    assert run.duration == pytest.approx(ended.facts["duration"])
    gaps = np.flatnonzero(run.cycles["missed"])
    assert run.t[gaps[-1]] - run.begin <= run.duration
    assert f"{run.duration:.3f} s, stopped" in report_on_client(replace(run, stopped="x"), parts[-1].end).line
    assert not any("played them in" in note for note in check_sent(run, distance=None).motion.notes)


def test_a_motion_that_its_client_broke_off_did_not_run_to_its_end() -> None:
    with watched() as (place, motions), place.connect() as robot:
        robot.set_motor_power(1)
        state = start_moving(robot)
        q = np.array(state.q_c[:7])
        for k in range(200):
            robot.answer(state, Output(q=(q[0] + 1e-6 * k * k, *q[1:])))
            state = robot.next_state(state.message_id)
        robot.stop_move()
        parts = collect(motions, 1)[0]
    end = parts[-1].end
    assert end is not None
    found = report_on_client(as_run(parts), end)
    assert re.search(r"stopped: the client stopped the motion while joint 1 moved at 0\.\d+ rad/s", found.line)
    assert end.stopped is not None
    assert re.search(r"关节 1 的速度为 \d+\.\d°/s", Text("zh", "rcilab.app").render(describe_note(end.stopped)))


def test_a_motion_right_after_another_keeps_its_first_command() -> None:
    """The end of a motion is read before the client has answered the first state of the next one."""
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        state = start_moving(robot)
        (first,) = collect(motions, 1)
        assert first[-1].end is not None
        for _ in range(20):
            robot.answer(state, Output(q=state.q_c[:7]))
            state = robot.next_state(state.message_id)
        robot.stop_move()
        run = as_run(collect(motions, 1)[0])
    answered = run.cycles["sent_ns"] != 0
    assert int(answered.sum()) == 20
    assert answered[0]


def test_commands_that_answer_one_state_again_are_all_recorded() -> None:
    """The vendor's client sleeps after StartMove and then answers every copy of a state that it finds."""
    with watched(mode_delay=0.005) as (place, motions), place.connect(start_sleep=0.5) as robot:
        sent = sent_commands(robot)
        programs.prepare(robot, NEAR, factor=1.0)
        (parts,) = collect(motions, 1)
    run = as_run(parts)
    numbers = [int.from_bytes(data[:8], "big") for data in sent]
    assert len(set(numbers)) < len(numbers) - 2  # A copy after 0.02, 0.06, 0.14, 0.24, 0.34 and 0.44 s.
    played = np.flatnonzero(run.cycles["played"])
    sources = played - run.cycles["age"][played].astype(int)
    assert (sources < played).all()
    assert [row.tobytes() for row in run.command[sources]] == [data[8:64] for data in sent]
    assert run.timing.lost == 0
    assert sent_motion(run).notes == ()
    assert check(sent_motion(run), parts[0].motion.model, distance=None).ok


def test_duplicates_do_not_displace_other_commands() -> None:
    """Of a burst of old answers with doubles among them, as after the sleep of the vendor's client."""
    with watched(mode_delay=0.005) as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        state = start_moving(robot)
        sent = sent_commands(robot)
        start = state.q_c[:7]
        for step in (0, 0, 1, 1, 1, 2, 3, 3, 4, 5):  # Of 1 nrad, all answers to one state.
            robot.answer(state, Output(q=tuple(angle + 1e-9 * step for angle in start)))
        state = robot.next_state(state.message_id)
        robot.answer(state, Output(q=tuple(angle + 5e-9 for angle in start)))
        robot.next_state(state.message_id)
        robot.stop_move()
        run = as_run(collect(motions, 2)[1])
    played = np.flatnonzero(run.cycles["played"])
    sources = played - run.cycles["age"][played].astype(int)
    assert (sources < played).all()
    different = [data for data, before in zip(sent, [b"", *sent], strict=False) if data != before]
    assert [row.tobytes() for row in run.command[sources]] == [data[8:64] for data in different]


def sine(step: int, count: int) -> tuple[float, ...]:
    """A gentle motion that begins and ends at standstill, [rad]; no two commands are equal."""
    offset = 0.01 * (1.0 - np.cos(2.0 * np.pi * step / (count - 1))) + 1e-12 * step
    return tuple(angle + offset for angle in programs.START[7])


@pytest.mark.parametrize(
    "number_of",
    [
        pytest.param(lambda number, step: step + 10, id="its own numbers"),
        pytest.param(lambda number, step: number - 300, id="old numbers"),
        pytest.param(lambda number, step: 0x7F000000 + step, id="numbers of no state"),
        pytest.param(lambda number, step: number if step < 300 else step - 300, id="numbers that begin again"),
        pytest.param(lambda number, step: max(number - 400, 0) if step < 90 else number, id="old numbers at first"),
    ],
)
def test_commands_with_other_numbers_than_those_of_the_states_are_recorded_as_played(
    number_of: Callable[[int, int], int],
) -> None:
    count = 800
    with watched() as (place, motions), place.connect() as robot:
        robot.set_motor_power(1)
        state = robot.receive_fresh_state()
        while state.message_id < 500:  # No number of a client is negative.
            state = robot.next_state(state.message_id)
        robot.start_move(wire.JOINT_POSITION, wire.JOINT)
        sent = [sine(step, count) for step in range(count)]
        state = robot.receive_fresh_state()
        for step, q in enumerate(sent):
            robot.send_raw(wire.pack_command(number_of(state.message_id, step) & 0xFFFFFFFF, q))
            state = robot.next_state(state.message_id)
        robot.stop_move()
        parts = collect(motions, 1)[0]
    run, end = as_run(parts), parts[-1].end
    played = np.flatnonzero(run.cycles["played"])
    sources = played - run.cycles["age"][played].astype(int)
    assert [tuple(row) for row in run.command[sources].tolist()] == sent
    assert run.cycles["sent_ns"][sources].all()
    assert end is not None
    assert (end.lost, end.late) == (0, 0)
    found = report_on_client(run, end)
    assert "conforms" in found.text
    assert f"{count} commands, 0 late; 0 cycles without one" in found.line


def test_a_run_whose_commands_have_no_lateness_is_exported_without_one() -> None:
    """A client that counts on its own answers no state."""
    with watched() as (place, motions), place.connect() as robot:
        robot.set_motor_power(1)
        robot.start_move(wire.JOINT_POSITION, wire.JOINT)
        state = robot.receive_fresh_state()
        for step in range(400):
            robot.send_raw(wire.pack_command(0x7F000000 + step, sine(step, 400)))
            state = robot.next_state(state.message_id)
        robot.stop_move()
        run = replace(as_run(collect(motions, 1)[0]), realtime=True)
    assert np.isnan(run.cycles["lateness"]).all()
    assert (run.timing.late, run.timing.lateness_p99, run.timing.lateness_max) == (0, None, None)
    assert "NaN" not in facts_text(run)
    facts = dict(fact_rows(run, Text("en", "rcilab.recording")))
    assert facts["Timing"] == "cycles without a command: 0, late ones: 0"
    assert "nan" not in run._repr_html_()


def synthetic_rows(ring: CycleRing, first: int, count: int, motion: int = 1, *, played: bool = True) -> None:
    """Writes cycles in which the command of the one before is played."""
    rows = np.zeros(count, cycle_dtype(ring.n, complete=True, playout=True))
    rows["message_id"] = rows["sent_ns"] = np.arange(first, first + count) + 1
    rows["motion"], rows["played"], rows["age"] = motion, played, 1
    for row, data in zip(rows, range(first, first + count), strict=True):
        start = data % CAPACITY * rows.itemsize
        ring.memory[start : start + rows.itemsize] = row.tobytes()
        ring.counters[RingCounter.ROWS] = data + 1


def begin_event(motion: int, row: int) -> dict[str, Any]:
    tool, load = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], [0.0, [0.0] * 3, [[0.0] * 3] * 3]
    event = {"event": "begin", "motion": motion, "row": row, "mode": "joint_position", "client": "127.0.0.1"}
    return {**event, "wall_ns": 0, "tool": tool, "load": load, "settings": {}}


def end_event(motion: int, row: int) -> dict[str, Any]:
    counts = dict.fromkeys(("received", "lost", "most_lost", "late", "dropped", "duplicates"), 0)
    return {"event": "end", "motion": motion, "row": row, "stopped": None, **counts}


@pytest.fixture
def ring() -> Iterator[CycleRing]:
    found = CycleRing.create(7, {"model": "xMatePro7", "plant": "ideal", "url": "rci://127.0.0.1", "realtime": True})
    yield found
    found.close()


def test_overwritten_cycles_are_a_gap_with_its_size(ring: CycleRing) -> None:
    motions = ClientMotions(ring)
    ring.add_event(begin_event(1, 0))
    synthetic_rows(ring, 0, 2000)
    (before,) = motions.poll()
    assert (before.cycles["message_id"][0], len(before.cycles), before.skipped) == (1, 2000 - LAG, 0)
    written = 2000 + CAPACITY + 1500
    synthetic_rows(ring, 2000, CAPACITY + 1500)
    ring.add_event(end_event(1, written))
    (after,) = motions.poll()
    assert after.end is not None
    first = int(after.cycles["message_id"][0]) - 1
    assert after.skipped == first - (2000 - LAG)
    assert first > written - CAPACITY
    np.testing.assert_allclose(after.cycles["t"], 1e-3 * np.arange(first, written), rtol=0, atol=1e-9)


def test_a_display_reads_late_commands_of_every_kind_again(ring: CycleRing) -> None:
    motions = ClientMotions(ring, lag=5)
    ring.add_event(begin_event(1, 0))
    synthetic_rows(ring, 0, 1000)
    (part,) = motions.poll()
    rows = np.frombuffer(ring.memory, cycle_dtype(ring.n, complete=True, playout=True), CAPACITY)
    names = [name for name in part.cycles.dtype.names or () if name.startswith("command")]
    assert len(names) == 8
    for name in names:
        rows[name][900] = 2
    motions.refresh(part.cycles, part.next)
    for name in names:
        assert (part.cycles[name][900] == 2).all(), name


@pytest.mark.parametrize("length", [2000, CAPACITY + 3000])
def test_a_motion_in_progress_is_read_from_its_beginning(ring: CycleRing, length: int) -> None:
    synthetic_rows(ring, 0, 1, motion=0)
    ring.add_event(begin_event(1, 1))
    synthetic_rows(ring, 1, length)
    motions = ClientMotions(ring, lag=5)
    (part,) = motions.poll()
    assert part.motion.number == 1
    assert len(part.cycles) + part.skipped in (length - 5, length - 4)
    ring.add_event(end_event(1, length + 1))
    assert [part.end is not None for part in motions.poll()] == [True]
    (newest,) = ClientMotions(ring).poll() or [None]
    assert newest is None


def test_a_motion_with_a_gap_is_two_runs_and_neither_is_checked_across_it(ring: CycleRing, tmp_path: Path) -> None:
    lines: list[str] = []
    recorder = ClientRecorder(tmp_path, ring, lambda kind, text: lines.append(text))
    ring.add_event(begin_event(1, 0))
    synthetic_rows(ring, 0, 2000)
    recorder.poll()
    synthetic_rows(ring, 2000, CAPACITY + 1500)
    ring.add_event(end_event(1, 3500 + CAPACITY))
    recorder.poll()
    recorder.close()
    first, second = (load_run(path) for path in sorted(tmp_path.glob("*.rcirun"), reverse=True))
    assert (first.truncated, second.truncated) == (False, True)
    assert first.stopped == "this file ends here, the motion went on"
    assert second.t[0] > first.t[-1] + 0.5
    assert sum("cycles before" in line and "are not recorded" in line for line in lines) == 1
    assert [", without its beginning, joint_position" in line for line in lines if "ran to" in line] == [True]


def test_commands_before_the_first_played_one_count_as_not_recorded(ring: CycleRing) -> None:
    motions = ClientMotions(ring)
    ring.add_event(begin_event(1, 0))
    synthetic_rows(ring, 0, 50, played=False)
    synthetic_rows(ring, 50, 1000)
    ring.add_event(end_event(1, 1050))
    (part,) = motions.poll()
    assert part.end is not None
    assert len(part.cycles) + part.end.unrecorded == 1050
    assert part.end.unrecorded == 49


@pytest.mark.parametrize("part", ["event", "load", "row"])
def test_an_event_that_lacks_a_part_is_skipped(ring: CycleRing, part: str) -> None:
    event = begin_event(1, 0)
    del event[part]
    ring.add_event(event)
    synthetic_rows(ring, 0, 2000)
    motions = ClientMotions(ring)
    ring.add_event(event)
    assert motions.poll() == ClientMotions(ring).poll() == []


def test_a_motion_whose_beginning_was_overwritten_is_named_as_a_part(ring: CycleRing, tmp_path: Path) -> None:
    lines: list[str] = []
    recorder = ClientRecorder(tmp_path, ring, lambda kind, text: lines.append(text))
    ring.add_event(begin_event(1, 0))
    synthetic_rows(ring, 0, CAPACITY + 1500)
    ring.add_event(end_event(1, CAPACITY + 1500))
    recorder.poll()
    recorder.close()
    gap, line = lines
    assert "cycles at its beginning are not recorded" in gap
    assert line.startswith("motion 1 of 127.0.0.1, without its beginning, joint_position, ")


def test_a_motion_of_which_only_cycles_without_a_command_were_read_is_named(ring: CycleRing, tmp_path: Path) -> None:
    lines: list[str] = []
    recorder = ClientRecorder(tmp_path, ring, lambda kind, text: lines.append(text))
    ring.add_event(begin_event(1, 0))
    synthetic_rows(ring, 0, 1000)
    recorder.poll()
    synthetic_rows(ring, 1000, CAPACITY + 1500, played=False)
    ring.add_event(end_event(1, 2500 + CAPACITY))
    recorder.poll()
    recorder.close()
    (line,) = lines
    assert line.startswith("motion 1 is not recorded: in what was read no command was played; 2501 of its 18884 cycles")


def test_every_motion_that_was_overwritten_as_a_whole_says_so(ring: CycleRing, tmp_path: Path) -> None:
    lines: list[str] = []
    recorder = ClientRecorder(tmp_path, ring, lambda kind, text: lines.append(text))
    for motion in (1, 2, 3):
        first = 1000 * (motion - 1)
        ring.add_event(begin_event(motion, first))
        synthetic_rows(ring, first, 1000, motion)
        ring.add_event(end_event(motion, first + 1000))
    synthetic_rows(ring, 3000, CAPACITY + 1000, motion=0)
    recorder.poll()
    recorder.close()
    assert len(lines) == 3
    for motion, line in enumerate(lines, start=1):
        assert line.startswith(
            f"motion {motion}: 1000 cycles which were all of it, are not recorded; they were overwritten"
        )


def test_a_motion_without_a_played_command_names_its_end_as_well(ring: CycleRing, tmp_path: Path) -> None:
    lines: list[str] = []
    recorder = ClientRecorder(tmp_path, ring, lambda kind, text: lines.append(text))
    ring.add_event(begin_event(1, 0))
    synthetic_rows(ring, 0, 100, played=False)
    ring.add_event({**end_event(1, 100), "stopped": {"said": "a push", "code": "", "facts": {}}})
    recorder.poll()
    recorder.close()
    assert lines == ["motion 1, joint_position, is not recorded: no command was played; a push"]


def test_motions_whose_events_were_overwritten_are_named(ring: CycleRing, tmp_path: Path) -> None:
    lines: list[str] = []
    recorder = ClientRecorder(tmp_path, ring, lambda kind, text: lines.append(text))
    for motion in range(1, 602):
        ring.add_event(begin_event(motion, motion - 1))
        synthetic_rows(ring, motion - 1, 1, motion)
        ring.add_event(end_event(motion, motion))
        if motion == 1:
            recorder.poll()
    ring.add_event(begin_event(602, 601))
    synthetic_rows(ring, 601, 600, 602)
    ring.add_event(end_event(602, 1201))
    recorder.poll()
    recorder.close()
    assert any(line.startswith("motion 2 to ") and "not recorded" in line for line in lines)
    assert len(list(tmp_path.glob("*-602-*.rcirun"))) == 1


def test_two_recorders_share_a_folder(tmp_path: Path) -> None:
    with arena(is_recorded=True) as place:
        assert place.server.ring is not None
        recorders = [ClientRecorder(tmp_path, place.server.ring, lambda kind, text: None) for _ in range(2)]
        with place.connect() as robot:
            programs.prepare(robot, NEAR, factor=1.0)
        for recorder in recorders:
            recorder.close()
    first, second = (load_run(path) for path in tmp_path.glob("*.rcirun"))
    assert first.cycles.tobytes() == second.cycles.tobytes()
    assert len(list(tmp_path.glob("*.txt"))) == 2


def test_the_next_motion_is_recorded_after_the_folder_was_removed(tmp_path: Path) -> None:
    folder, lines = tmp_path / "runs", list[str]()
    with arena(is_recorded=True) as place:
        assert place.server.ring is not None
        recorder = ClientRecorder(folder, place.server.ring, lambda kind, text: lines.append(text))
        with place.connect() as robot:
            programs.prepare(robot, NEAR, factor=1.0)
            wait_for(lambda: (recorder.poll(), len(lines) == 1)[1])
            shutil.rmtree(folder)
            programs.joint_sine(robot, SECONDS, period=SECONDS)
        recorder.close()
    (path,) = folder.glob("*-002-*.rcirun")
    assert load_run(path).is_complete


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"", id="empty"),
        pytest.param(b"x" * 10_000, id="another file"),
        pytest.param(struct.pack("<8sIIII", b"RCILABCY", 3, 7, 1400, CAPACITY) + bytes(4000), id="cut"),
        pytest.param(struct.pack("<8sIIII", b"RCILABCY", 3, 2**31, 1400, CAPACITY) + bytes(4000), id="joints"),
    ],
)
def test_a_file_that_is_no_record_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    with path.open("rb+") as file, pytest.raises(UsageError, match="the record of"):
        CycleRing.attach(os.getpid(), file.fileno())


def test_an_event_that_is_too_long_loses_its_longest_value_and_no_other_event(ring: CycleRing) -> None:
    ring.add_event(begin_event(1, 0))
    ring.add_event({**end_event(1, 1), "stopped": "x" * 20_000})
    ring.add_event(begin_event(2, 1))
    first, second, third = ring.events(0)[0]
    assert (first["event"], second["event"], second["stopped"], third["motion"]) == ("begin", "end", None, 2)


def test_damaged_facts_are_refused_and_damaged_events_skipped(ring: CycleRing) -> None:
    motions = ClientMotions(ring)
    ring.counters[RingCounter.EVENTS] = 2**40
    assert motions.poll() == []
    other = CycleRing.create(7, {"model": 7})
    with pytest.raises(UsageError, match="does not name its arm"):
        ClientMotions(other)
    other.close()


def test_tool_load_and_settings_in_force_are_recorded() -> None:
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        tool = (1, 0, 0, 0.1, 0, 1, 0, 0.0, 0, 0, 1, 0.2, 0, 0, 0, 1)
        robot.set_coor(tool)
        robot.set_load(1.5, (0.0, 0.0, 0.05), (0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01))
        robot.set_collision_behavior((20.0,) * 7)
        programs.joint_sine(robot, SECONDS, period=SECONDS)
        parts = collect(motions, 2)[1]
    motion = parts[0].motion
    settings = report_on_client(as_run(parts)).text.split("Settings in force")[1]
    assert "tool: [1, 0, 0, 0.1, 0, 1," in settings
    assert "load_mass: 1.5\n" in settings
    assert "load_center_of_mass: [0, 0, 0.05]\n" in settings
    assert motion.model.load.mass == 1.5
    assert motion.model.T_flange_tool.as_row_major() == pytest.approx(tool)
    assert motion.setup.settings["collision_thresholds"] == [20.0] * 7
    assert motion.setup.settings["limit_table"] == "manual"


def test_the_recorder_writes_a_run_and_a_report_for_every_motion(tmp_path: Path) -> None:
    lines = record_two_motions(tmp_path, programs.line)
    first, second = sorted(tmp_path.glob("*.rcirun"))
    run = load_run(second)
    assert run.is_complete
    assert run.setup.mode == "cartesian_position"
    assert run.report is None
    assert str(second) in lines[1]
    nearest = r"nearest limits: .+ position of joint \d, .+ and .* (velocity|acceleration|jerk) of .+ at \d\.\d{3} s; "
    assert re.search(f"ran to its end; {nearest}", lines[1]), lines[1]
    report = second.with_suffix(".txt").read_text()
    assert "\n\n\n" not in report
    assert "cartesian.velocity.translation" in report
    assert "Settings in force" in report
    assert str(first) in lines[0]


def test_a_folder_that_cannot_be_written_to_costs_the_run_and_not_the_motion(tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    folder.write_text("a file")
    lines = record_two_motions(folder, programs.joint_sine)
    assert all("is not recorded: run file: " in line for line in lines)


def test_the_record_of_a_process_that_has_none_is_refused() -> None:
    with pytest.raises(UsageError, match="cannot be opened"):
        CycleRing.attach(os.getpid(), 9999)
    with open(os.devnull, "rb+") as other, pytest.raises((VersionMismatchError, UsageError)):
        CycleRing.attach(os.getpid(), other.fileno())
