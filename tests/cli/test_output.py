"""What a shell does to the output of a command: a full disk, a closed stream, a small alphabet, a hostile file."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from tests.waiting import wait_for

START = [0, 0.5235987755982988, 0, 1.0471975511965976, 0, 1.5707963267948966, 0]
PROGRAM = {
    "format": "rcilab program", "version": 1, "model": "xMatePro7", "start": START,
    "waypoints": [{"type": "joint", "q": [0.1, *START[1:]]}],
}  # fmt: skip


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "program.json"
    file.write_text(json.dumps(PROGRAM))
    return file


def shell(command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Runs `rcilab COMMAND` in a real shell."""
    return subprocess.run(
        ["sh", "-c", f'"{sys.executable}" -m rcilab.cli {command}'],
        capture_output=True, text=True, timeout=60, check=False, stdin=subprocess.DEVNULL,
        env={**os.environ, "PYTHONUTF8": "0", **environment},
    )  # fmt: skip


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("command", ["check FILE", "check FILE --json", "urdf xMatePro7"])
def test_an_output_that_cannot_be_written_is_one_sentence_and_no_verdict(program, command):
    ran = shell(f"{command} >/dev/full".replace("FILE", str(program)))
    assert ran.stderr == "rcilab: the output could not be written: No space left on device\n"
    assert ran.returncode == 2


def test_a_closed_output_is_a_reader_that_has_gone(program):
    ran = shell(f"check {program} >&-")
    assert (ran.returncode, ran.stderr) == (0, "")
    ran = shell(f"check {program} 2>&-")
    assert ran.returncode == 0
    assert "Traceback" not in ran.stdout


def test_what_an_encoding_lacks_is_printed_with_its_escapes(program):
    ran = shell(f"check {program} --explain zh", PYTHONIOENCODING="ascii")
    assert ran.returncode == 0
    assert "\\u" in ran.stdout
    assert ran.stderr == ""


@pytest.mark.parametrize("key", ["\x1b[2J\nfake: all good", "\x1b]0;name\x07", "\ud800", "\u202egnp", "\x9b2J"])
def test_a_hostile_file_acts_on_no_terminal(program, key):
    hostile = {**PROGRAM, "waypoints": [{"type": "joint", "q": START, key: 1}]}
    program.write_text(json.dumps(hostile))
    ran = shell(f"check {program}")
    assert ran.returncode == 2
    assert len(ran.stderr.splitlines()) == 1
    assert "is unknown; known: type, q" in ran.stderr
    assert all(letter.isprintable() for letter in ran.stderr[:-1])


def test_what_an_error_says_of_a_long_value_is_short(program):
    program.write_text(json.dumps({**PROGRAM, "model": 5_000_000 * "x"}))
    ran = shell(f"check {program}")
    assert ran.returncode == 2
    assert len(ran.stderr) < 500


def test_a_program_of_too_many_waypoints_is_refused_by_their_number(program):
    program.write_text(json.dumps({**PROGRAM, "waypoints": 10_001 * [{}]}))
    ran = shell(f"check {program}")
    assert "waypoints must be 1 to 10000, got 10001" in ran.stderr


@pytest.mark.parametrize(
    "command",
    [
        ("controller", "--model", "xMatePro7", "--port", "0"),
        ("--no-browser", "--port", "0"),
        ("doctor",),
        ("check", "missing.npz", "--model", "xMatePro7"),
    ],
)
def test_an_interrupt_ends_a_command_whose_output_was_full_from_the_start(command: tuple[str, ...]) -> None:
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with suppress(BlockingIOError):
        while True:
            os.write(writer, bytes(4096))
    os.set_blocking(writer, True)
    with subprocess.Popen([sys.executable, "-m", "rcilab", *command], stdout=writer, stderr=writer) as process:
        try:
            blocked = Path(f"/proc/{process.pid}/wchan")
            wait_for(lambda: "pipe_write" in blocked.read_text() or process.poll() is not None)
            process.send_signal(signal.SIGINT)
            assert process.wait(60.0) in (0, 130)
        finally:
            process.kill()
            os.close(writer)
            os.close(reader)
