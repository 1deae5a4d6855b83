"""Bad luck on a machine with a page and a moving arm. Each takes a plant; the long versions are in tests/endurance."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import msgspec
import numpy as np

from rcilab.app.goal.goal_actions import MoveJoint, PlanGoal, SetSpeed
from rcilab.app.run.run_actions import ChooseRobot, RobotCommand
from rcilab.app.view_actions import SetRecording
from rcilab.diagnostics.bench.cpu_stall_monitor import CpuStallMonitor
from rcilab.makers.rokae.faults import Fault
from rcilab.workbench.app import Workbench, WorkbenchConfig
from tests.fuzz.wires import open_page
from tests.workbench.opened import all_told, told, wait
from tests.workbench.test_surprises import is_ready, move_on, set_out

PROCESS_GROWTH = 1_000_000  # [bytes] Of controller and control process.
PAGE_GROWTH = 20_000_000
LONG_PAUSE = 0.02  # [s] Of a core: 20 commands in a row that are lost end a motion.


@contextmanager
def workbench(plant: str, runs: Path | None = None) -> Iterator[Workbench]:
    with Workbench(WorkbenchConfig(port=0, quality="light", runs=runs)) as bench:
        wait(lambda: is_ready(bench), "an idle arm")
        if plant == "mujoco":
            pid = bench.session.status().controller_pid
            bench.dispatcher.ask(ChooseRobot(plant="mujoco"))
            wait(lambda: bench.session.status().controller_pid not in (None, pid), "another controller")
            wait(lambda: is_ready(bench), "a powered arm")
        yield bench
        assert bench.dispatcher.errors == []
        assert bench.renderer.errors == []


def memory(pid: int | None) -> int:
    """What a process has in memory of its own, without what it shares with the others, [bytes]."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("Anonymous:"))


def stream_with_a_page(plant: str, seconds: float, warm_up: float) -> None:
    """One motion after the other with a page that reads; memory stays flat after the warm-up.

    A motion that ends because commands came too late is recovered from, and counted: the machine itself, an empty loop
    at the highest priority, must have been late at that time.
    """
    stops: list[float] = []
    with CpuStallMonitor() as machine, workbench(plant) as bench, open_page(bench) as page:
        status = bench.session.status()
        pids = (status.controller_pid, status.worker_pid, os.getpid())
        began, before = time.monotonic(), None
        while (elapsed := time.monotonic() - began) < seconds:
            if before is None and elapsed >= warm_up:
                before = [memory(pid) for pid in pids]
            if not swing(bench, may_be_late=True):
                stops.append(time.monotonic())
                bench.dispatcher.ask(RobotCommand(what="recover"))
            with suppress(TimeoutError):
                while True:
                    page.recv(timeout=0)
        assert before is not None
        grown = [memory(pid) - size for pid, size in zip(pids, before, strict=True)]
        now = bench.session.status()
        assert (now.controller_pid, now.worker_pid) == pids[:2], "nothing was restarted"
    print(
        f"grown by {grown} bytes; {len(stops)} stops; the empty loop {1e3 * machine.lateness.max():.0f} ms late at most"
    )
    assert max(grown[:2]) < PROCESS_GROWTH, f"controller and control process grew by {grown[:2]} bytes"
    assert grown[2] < PAGE_GROWTH, f"the page's process grew by {grown[2]} bytes"
    pauses = machine.pauses[np.diff(machine.pauses, axis=1)[:, 0] >= LONG_PAUSE]
    for stop in stops:
        assert ((pauses[:, 1] <= stop) & (pauses[:, 1] > stop - 1.0)).any(), "it stopped on a machine that was in time"


def swing(bench: Workbench, may_be_late: bool = False) -> bool:
    """One motion of joint 1, there or back; returns whether it arrived, which only one that may be late need not."""
    ask, status = bench.dispatcher.ask, bench.session.status
    wait(lambda: is_ready(bench), "an idle arm")
    goal = -0.4 if status().q_c[0] > 0.0 else 0.4
    ask(SetSpeed(speed=0.5))
    ask(MoveJoint(joint=0, angle=goal))
    wait(
        lambda: bench.store.state.plan is not None and abs(bench.store.state.plan.motion.goal[0] - goal) < 1e-9, "plan"
    )
    ask(PlanGoal())
    wait(lambda: bench.store.state.plan is not None and bench.store.state.plan.complete, "a judged plan")
    ask(RobotCommand(what="execute"))

    def arrived() -> bool:
        return abs(float(status().q_c[0]) - goal) < 1e-6

    def is_late() -> bool:
        return may_be_late and status().faults == (Fault.INSTABILITY_DETECTION,)

    wait(
        lambda: arrived() or is_late(),
        lambda: f"the arm to arrive ({status().message}; {all_told(bench)})",
    )
    return not is_late()


def stop_everything(plant: str, seconds: float) -> None:
    """Controller and control process stand still in mid-motion, as on a machine that was put to sleep."""
    with workbench(plant) as bench:
        start = set_out(bench)
        pids = [bench.session.status().controller_pid, bench.session.status().worker_pid]
        for pid in pids:
            os.kill(pid, signal.SIGSTOP)
        time.sleep(seconds)
        for pid in pids:
            with suppress(ProcessLookupError):  # It was replaced meanwhile.
                os.kill(pid, signal.SIGCONT)
        wait(lambda: bench.session.status().phase in ("idle", "fault", "lost"), "the arm to rest", 60.0)
        wait(lambda: told(bench) is not None, "to be told")
        if bench.session.status().phase == "lost":  # The controller slept for longer than it is waited for.
            bench.dispatcher.ask(ChooseRobot(target="virtual"))  # "Start it again".
            wait(lambda: is_ready(bench), "another controller", 60.0)
            start = float(bench.session.status().q_c[0])
        assert abs(float(bench.session.status().q_c[0]) - start) < 0.79, "it did not go on as if nothing had been"
        move_on(bench)


def open_and_never_read(plant: str, seconds: float) -> None:
    """A page that opens and reads nothing costs little, and the others nothing."""
    with workbench(plant) as bench:
        with open_page(bench), open_page(bench, reads=False):
            swing(bench)
            before = memory(os.getpid())
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                swing(bench)
            assert memory(os.getpid()) - before < PAGE_GROWTH


def upload(plant: str, megabytes: int) -> None:
    """A page announces and sends a file that is far too large."""
    with workbench(plant) as bench, open_page(bench) as page:
        inputs = bench.server.gui._gui_input_handle_from_uuid.items()
        button = next(uuid for uuid, handle in inputs if type(handle).__name__ == "GuiUploadButtonHandle")
        before = memory(os.getpid())
        for size in (megabytes * 1_000_000, 1000):
            _send(
                page, "FileTransferStartUpload", source_component_uuid=button, transfer_uuid=f"t{size}",
                filename="program.json", mime_type="application/json", part_count=megabytes, size_bytes=size,
            )  # fmt: skip
            for part in range(megabytes):
                _send(
                    page, "FileTransferPart", source_component_uuid=button, transfer_uuid=f"t{size}", part_index=part,
                    content=bytes(1_000_000),
                )  # fmt: skip
        swing(bench)
        assert memory(os.getpid()) - before < PAGE_GROWTH
        assert bench.store.state.program.draft.steps == ()


def fill_the_disk(plant: str, folder: Path) -> None:
    """The disk that runs are written to is full in the middle of a motion: the motion goes on, and it is told."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(folder)], check=True)
    try:
        with workbench(plant, folder) as bench:
            bench.dispatcher.ask(SetRecording(on=True))
            swing(bench)
            wait(lambda: bench.store.state.recording is not None, "the run")
            # That the arm has arrived is told right afterwards, and the page shows both.
            wait(lambda: {"record.unwritable", "notice.arrived"} <= all_told(bench), "to be told of both")
            move_on(bench)
            assert all(file.stat().st_size for file in folder.glob("*.rcirun"))
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


JUMPING = """
import time
_wall, _wall_ns = time.time, time.time_ns
def _jump():
    return (0, 3600, -86400, 31536000)[int(time.monotonic() * 5) % 4]
time.time = lambda: _wall() + _jump()
time.time_ns = lambda: _wall_ns() + _jump() * 1_000_000_000
"""

MOVING = """
import sys, rcilab
model = rcilab.load_model("xMatePro7")
with rcilab.simulate(model, plant=sys.argv[1]) as robot:
    robot.power_on()
    for step in range(int(sys.argv[2])):
        run = robot.move_j(model.home + (0.1 if step % 2 else -0.1))
        assert not run.faults and run.success_rate[-1] > 0.9, run
print("moved")
"""


def jump_the_clock(plant: str, motions: int, folder: Path) -> None:
    """The wall clock of every process jumps by an hour, a day and a year, five times a second, while the arm moves."""
    (folder / "sitecustomize.py").write_text(JUMPING)
    environ = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(
        [sys.executable, "-c", MOVING, plant, str(motions)],
        capture_output=True, text=True, timeout=600, check=False, env=environ,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "moved\n"), done.stderr


def _send(page, kind: str, **fields: object) -> None:
    page.send(msgspec.msgpack.encode({"type": kind, **fields}))
