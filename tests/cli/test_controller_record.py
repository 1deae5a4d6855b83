"""`rcilab controller --record FOLDER`, as the command a user starts, with a client that is not rcilab."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

from rcilab.cli import main
from rcilab.cli.motion_recorder import recorder_process, show_entry
from rcilab.core.cycle_ring import CycleRing
from rcilab.recording.run import load_run
from tests.peers import programs, wire
from tests.peers.arena import Process
from tests.peers.robot import PATIENCE, Robot
from tests.waiting import wait_for

NEAR = tuple(angle + 0.02 for angle in programs.START[7])  # [rad]


def test_the_last_motion_is_written_before_the_command_ends(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "runs"
    with Process("--record", str(folder), "--lockstep") as controller:
        with controller.connect() as robot:
            programs.prepare(robot, NEAR, factor=1.0)
    (file,) = folder.glob("*.rcirun")
    run = load_run(file)
    assert run.is_complete
    assert not run.realtime
    assert run.setup.client == "127.0.0.1"
    assert "joint.velocity" in file.with_suffix(".txt").read_text()


def test_the_arm_goes_on_without_the_recorder(tmp_path: Path) -> None:
    with Process("--record", str(tmp_path), "--lockstep") as controller:
        children = Path(f"/proc/{controller.process.pid}/task/{controller.process.pid}/children")
        (child,) = children.read_text().split()
        os.kill(int(child), signal.SIGKILL)
        wait_for(lambda: not children.read_text().split(), what="the end of the recorder")
        with controller.connect() as robot:
            programs.prepare(robot, NEAR, factor=1.0)
            assert not any(state.errors for state in robot.states)
    assert not list(tmp_path.iterdir())


def test_a_line_of_the_recorder_is_written_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[str] = []
    monkeypatch.setattr(sys.stderr, "write", written.append)
    show_entry("text", lambda: 0)("not_recorded", "motions are not recorded any more")
    (line,) = written
    assert line.endswith("motions are not recorded any more\n")


def test_modules_in_the_folder_of_the_user_do_not_replace_those_of_the_recorder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "numpy.py").write_text("raise SystemExit('a file of the user')")
    monkeypatch.chdir(tmp_path)
    ring = CycleRing.create(7, {"model": "xMatePro7", "plant": "ideal", "url": "rci://127.0.0.1", "realtime": True})
    with recorder_process(tmp_path / "runs", ring, "text", lambda: 0):
        pass
    ring.close()


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    assert main(["controller", "--model", "xMatePro7", "--port", "0", "--record", str(tmp_path / "file" / "x")]) == 2
    assert "--record" in (line := capsys.readouterr().err)
    assert "is not a folder that can be written to: Not a directory" in line
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers


def moving_client(controller: Process) -> Robot:
    """A client in mid-motion, after 400 commands."""
    robot = controller.connect()
    robot.set_motor_power(1)
    robot.start_move(wire.JOINT_POSITION, wire.JOINT)
    state = robot.receive_fresh_state()
    for _ in range(400):
        robot.send_raw(wire.pack_command(state.message_id, programs.START[7]))
        state = robot.next_state(state.message_id)
    return robot


def test_the_last_motion_is_whole_although_the_controller_was_killed(tmp_path: Path) -> None:
    with Process("--record", str(tmp_path), "--lockstep") as controller:
        robot = moving_client(controller)
        controller.process.kill()
        robot.close()
        wait_for(lambda: list(tmp_path.glob("*.txt")), what="the report")
    (file,) = tmp_path.glob("*.rcirun")
    run = load_run(file)
    assert run.stopped == "the controller was ended"
    assert int((run.cycles["sent_ns"] != 0).sum()) == 400


def test_a_second_interrupt_ends_the_wait_for_a_recorder_that_was_stopped(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with Process("--record", str(tmp_path / "runs"), "--lockstep", log=log) as controller:
        children = Path(f"/proc/{controller.process.pid}/task/{controller.process.pid}/children")
        (child,) = children.read_text().split()
        os.kill(int(child), signal.SIGSTOP)
        controller.process.terminate()
        wait_for(lambda: "waiting for the recorder" in log.read_text(), what="the line in the log")
        controller.process.send_signal(signal.SIGINT)
        assert controller.process.wait(PATIENCE) == 0
    (line,) = (line for line in log.read_text().splitlines() if "the recorder was ended before its last report" in line)
    assert line.endswith(f"cycles that it had not yet written to {tmp_path / 'runs'} are lost")
