"""`rcilab controller --record FOLDER`, as the command a user starts, with a client that is not rcilab."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from rcilab.cli import main
from rcilab.recording.run import load_run
from tests.peers import programs
from tests.peers.arena import Process
from tests.peers.robot import PATIENCE, Robot
from tests.waiting import wait_for

NEAR = tuple(angle + 0.02 for angle in programs.START[7])  # [rad]


def test_the_last_motion_is_written_before_the_command_ends(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "runs"
    with Process("--record", str(folder), "--lockstep") as controller:
        with Robot(
            controller.host, controller.port, start_sleep=0.0, receive_timeout=PATIENCE, first_timeout=PATIENCE
        ) as robot:
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
        with Robot(
            controller.host, controller.port, start_sleep=0.0, receive_timeout=PATIENCE, first_timeout=PATIENCE
        ) as robot:
            programs.prepare(robot, NEAR, factor=1.0)
            assert not any(state.errors for state in robot.states)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    assert main(["controller", "--model", "xMatePro7", "--port", "0", "--record", str(tmp_path / "file" / "x")]) == 2
    assert "--record" in (line := capsys.readouterr().err)
    assert "is not a folder that can be written to: Not a directory" in line
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers
