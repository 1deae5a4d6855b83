"""What a bench starts ends with it: real processes, ended in every way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rcilab.diagnostics.bench.child_guard import guard, launch

PATIENCE = 30.0  # [s]
PROGRAM = """
import os, subprocess, sys, time
os.chdir(sys.argv[1])
helper = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
open("pids", "w").write(f"{os.getpid()} {helper.pid} .")
time.sleep(600)
"""
BENCH = """
import signal, sys, time
from rcilab.diagnostics.bench.child_guard import guard, launch
signal.signal(signal.SIGINT, signal.default_int_handler)  # What runs in the background is started to ignore it.
with guard(sys.argv[2:], directory=sys.argv[1]) as process:
    launch(process)
    time.sleep(600)
"""


def program(place: Path) -> list[str]:
    """A program with a helper; it writes down who they are, in a directory of its own."""
    return [sys.executable, "-c", PROGRAM, str(place)]


def pids_in(place: Path) -> list[int]:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        file = place / "pids"
        if file.exists() and len(words := file.read_text().split()) == 3:
            return [int(word) for word in words[:2]]
        time.sleep(0.02)
    raise AssertionError("the program did not start")


def runs(pid: int) -> bool:
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False


def await_end(pids: list[int], place: Path) -> None:
    deadline = time.monotonic() + PATIENCE
    while any(map(runs, pids)) or place.exists():
        assert time.monotonic() < deadline, [pid for pid in pids if runs(pid)]
        time.sleep(0.02)


@pytest.mark.parametrize("kind", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_a_signal_that_ends_the_bench_ends_the_program_its_helper_and_its_directory(tmp_path, kind):
    place = tmp_path / "profile"
    place.mkdir()
    bench = subprocess.Popen([sys.executable, "-c", BENCH, str(place), *program(place)], stderr=subprocess.DEVNULL)
    try:
        pids = pids_in(place)
        assert all(map(runs, pids))
        bench.send_signal(kind)
        bench.wait(PATIENCE)
        await_end(pids, place)
    finally:
        bench.kill()
        bench.wait()


def test_leaving_the_block_ends_the_program_too(tmp_path):
    place = tmp_path / "profile"
    place.mkdir()
    with guard(program(place), directory=str(place)) as process:
        assert not (place / "pids").exists()
        launch(process)
        pids = pids_in(place)
    assert process.returncode is not None
    await_end(pids, place)


def test_a_program_that_ends_by_itself_is_told_by_its_exit_code():
    with guard([sys.executable, "-c", "raise SystemExit(7)"]) as process:
        launch(process)
        assert process.wait(PATIENCE) == 7


def test_what_was_never_launched_never_ran(tmp_path):
    with guard([sys.executable, "-c", f"open({str(tmp_path / 'ran')!r}, 'w')"]) as process:
        pass
    assert process.returncode == 0
    assert os.listdir(tmp_path) == []
