"""In a real kernel: a cell that runs again replaces what it made, and whatever ends the kernel stops the arm."""

from __future__ import annotations

import ast
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty
from typing import TYPE_CHECKING, Any

import pytest

from tests.waiting import wait_for

if TYPE_CHECKING:
    from jupyter_client.blocking.client import BlockingKernelClient
    from jupyter_client.manager import KernelManager

MAKE = """
import os, threading, time, rcilab
from ipywidgets.widgets.widget import _instances
from rcilab.notebook import JogPanel, RunPanel, Scene
model = rcilab.load_model("xMatePro7")
def held():
    "Sockets, pipes and the like; files come and go, as IPython's history does."
    links = (f"/proc/self/fd/{fd}" for fd in os.listdir("/proc/self/fd"))
    return sum(os.path.islink(link) and not os.readlink(link).startswith("/") for link in links)
def until(condition):
    end = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)
"""
PARTS = "scene = Scene(model); jog = JogPanel(scene)"
COUNT = "len(_instances), threading.active_count(), held()"
CONNECT = """
panel = RunPanel(model)
panel.connect.click()
until(lambda: not panel.power_on.disabled)
panel.power_on.click()
until(lambda: panel.state.status.powered)
"""
MOVE = """
panel.state.outcome = None
sign = 1.0 if panel.state.here[0] < 0.0 else -1.0
panel.state.store.update(speed=0.005)  # Minutes: an arrival is no stop.
panel.state.pose(model.home + 0.5 * sign)
panel.state.make_plan()
panel._show()
panel.execute.click()
until(lambda: panel.state.status.phase == "moving" and (panel.state.status.motion_time or 0.0) > 0.02)
"""
ROBOT = """
robot = rcilab.simulate(model)
robot.power_on()
motion = rcilab.plan_joint(model, robot.state.q_c, model.home + 0.5, speed=0.005)  # Minutes, if nobody stops it.
"""
SESSION = f"""{ROBOT}
beside = RunPanel(robot)
beside.stop.comm.comm_id
"""
THREAD = f"""{ROBOT}
done = []
threading.Thread(target=lambda: done.append(robot.execute(motion).stopped)).start()
until(lambda: robot.is_moving)
"""
PAGE = """
from rcilab.notebook import browser_heartbeat
from rcilab.notebook.subshell_routing import handle_during_cells
from ipywidgets import Button
browser_heartbeat.INTERVAL = 0.2  # A second of silence is enough.
kernel_heartbeat = browser_heartbeat.kernel_heartbeat()
kernel_heartbeat.open()
slow = Button()
handle_during_cells(slow)
slow.on_click(lambda _: time.sleep(2.0))
[widget.comm.comm_id for widget in (*kernel_heartbeat._widgets[:2], slow)]
"""
CLICK: dict[str, Any] = {"method": "custom", "content": {"event": "click"}}
STANDS = """
until(lambda: panel.state.outcome is not None and panel.state.outcome.error is not None)
panel.state.status.phase, panel.state.status.motion_time < panel.state.now.plan.motion.duration - 1.0
"""


class Kernel:
    """A kernel that is asked as a notebook asks it."""

    def __init__(self, manager: KernelManager, client: BlockingKernelClient) -> None:
        self.manager, self.client = manager, client

    def run(self, code: str) -> Any:
        """Runs a cell and returns its value."""
        return self.value_of(self.client.execute(code))

    def open_subshell(self) -> str:
        """Returns the name of a thread that hears messages while a cell runs; JupyterLab has one for all widgets."""
        control = self.client.control_channel
        control.send(self.client.session.msg("create_subshell_request", {}))
        return control.get_msg(timeout=20)["content"]["subshell_id"]

    def notify(self, comm: str, subshell: str | None, **data: Any) -> None:
        """Says what a widget in the page would, the way JupyterLab sends it; without a subshell that of VS Code."""
        message = self.client.session.msg("comm_msg", {"comm_id": comm, "data": data})
        message["header"]["subshell_id"] = subshell
        self.client.shell_channel.send(message)

    def answer(self, question: str, answer: str, subshell: str | None, seconds: float) -> None:
        """Is a page that sends every question back, for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            with suppress(Empty):
                message = self.client.get_iopub_msg(timeout=0.05)
                content = message["content"]
                assert message["msg_type"] != "execute_result", f"the cell has ended: {content}"
                if message["msg_type"] == "comm_msg" and content["comm_id"] == question:
                    self.notify(answer, subshell, method="update", state=content["data"]["state"], buffer_paths=[])

    def value_of(self, message: str) -> Any:
        value: Any = None
        while True:
            reply = self.client.get_iopub_msg(timeout=60)
            if reply["parent_header"].get("msg_id") != message:
                continue
            content = reply["content"]
            if reply["msg_type"] == "error":
                raise AssertionError("\n".join(content["traceback"]))
            if reply["msg_type"] == "execute_result":
                value = ast.literal_eval(content["data"]["text/plain"])
            if reply["msg_type"] == "status" and content["execution_state"] == "idle":
                return value


@contextmanager
def start_kernel() -> Iterator[Kernel]:
    from jupyter_client.manager import start_new_kernel

    manager, client = start_new_kernel(startup_timeout=60)
    yield Kernel(manager, client)
    client.stop_channels()
    manager.shutdown_kernel(now=True)


def descendants(pid: int) -> set[int]:
    """Returns every process below one."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    children = {int(child) for task in tasks for child in (task / "children").read_text(encoding="ascii").split()}
    return children.union(*(descendants(child) for child in children))


@pytest.fixture(scope="module")
def kernel() -> Iterator[Kernel]:
    with start_kernel() as started:
        yield started


@pytest.fixture
def another_kernel() -> Iterator[Kernel]:
    with start_kernel() as started:
        yield started


def test_a_cell_that_runs_again_leaves_no_widget_no_thread_and_no_socket(kernel: Kernel) -> None:
    kernel.run(MAKE)
    kernel.run(PARTS)
    kernel.run(PARTS)
    once = kernel.run(COUNT)
    for _ in range(5):
        kernel.run(PARTS)
    wait_for(lambda: kernel.run(COUNT) == once, what="as many as once")  # A socket takes a moment to close.
    assert once[0] > 50


def test_an_interrupt_stops_the_arm_whether_a_cell_runs_or_not(kernel: Kernel, tmp_path: Path) -> None:
    kernel.run(MAKE + CONNECT)
    kernel.run(MOVE)
    kernel.manager.interrupt_kernel()
    assert kernel.run(STANDS) == ("idle", True)
    kernel.run(MOVE)
    begun = tmp_path / "begun"
    sleeping = kernel.client.execute(  # Without `stop_on_error` what comes right after it runs, too.
        f"open({str(begun)!r}, 'w').close(); time.sleep(60)", stop_on_error=False
    )
    wait_for(begun.exists, what="the cell to begin")
    kernel.manager.interrupt_kernel()
    with pytest.raises(AssertionError, match="KeyboardInterrupt"):
        kernel.value_of(sleeping)
    assert kernel.run(STANDS) == ("idle", True)


def test_an_interrupt_stops_the_arm_while_a_cell_awaits_or_a_widget_is_served(kernel: Kernel, tmp_path: Path) -> None:
    begun = tmp_path / "begun"
    kernel.run(MAKE + CONNECT)
    kernel.run(MOVE)
    awaiting = kernel.client.execute(
        f"import asyncio; open({str(begun)!r}, 'w').close(); await asyncio.sleep(60)", stop_on_error=False
    )
    wait_for(begun.exists, what="the cell to begin")
    kernel.manager.interrupt_kernel()
    with pytest.raises(AssertionError):
        kernel.value_of(awaiting)
    assert kernel.run(STANDS) == ("idle", True)
    begun.unlink()
    kernel.run(MOVE)
    slow = kernel.run(
        f"from ipywidgets import Button; slow = Button(); "
        f"slow.on_click(lambda _: (open({str(begun)!r}, 'w').close(), time.sleep(60))); slow.comm.comm_id"
    )
    kernel.notify(slow, None, **CLICK)
    wait_for(begun.exists, what="the button to be served")
    kernel.manager.interrupt_kernel()
    assert kernel.run(STANDS) == ("idle", True)


def test_an_interrupt_stops_what_a_thread_of_somebodys_own_moves(kernel: Kernel) -> None:
    kernel.run(MAKE + PARTS + THREAD)
    kernel.manager.interrupt_kernel()
    assert kernel.run("until(lambda: done); done[0]") == "the kernel was interrupted"
    kernel.run("robot.close()")


@pytest.mark.parametrize("names_one", [True, False], ids=["JupyterLab", "VS Code"])
def test_stop_is_heard_while_the_cell_that_moves_the_arm_runs(kernel: Kernel, names_one: bool) -> None:
    subshell = kernel.open_subshell() if names_one else None
    stop = kernel.run(MAKE + SESSION)
    moving = kernel.client.execute("robot.execute(motion).stopped")
    time.sleep(0.5)  # Soon or late, a press counts from the start of the call on.
    kernel.notify(stop, subshell, **CLICK)
    assert kernel.value_of(moving) == "on request"
    kernel.run("beside.close(); robot.close()")


@pytest.mark.parametrize("names_one", [True, False], ids=["JupyterLab", "VS Code"])
def test_a_page_that_falls_silent_stops_what_a_cell_moves_and_one_that_nobody_hears_does_not(
    another_kernel: Kernel, names_one: bool
) -> None:
    kernel = another_kernel
    subshell = kernel.open_subshell() if names_one else None
    kernel.run(MAKE + SESSION)
    question, answer, slow = kernel.run(PAGE)
    moving = kernel.client.execute("robot.execute(motion).stopped")
    time.sleep(1.2)  # Nobody has ever answered, so nobody is missed.
    kernel.answer(question, answer, subshell, 1.0)
    kernel.notify(slow, subshell, **CLICK)  # Now who hears answers is busy, for twice as long as silence may last.
    time.sleep(1.6)
    kernel.answer(question, answer, subshell, 1.0)
    assert kernel.value_of(moving) == "the notebook's page is gone"
    kernel.run("until(lambda: 'page did not answer' in beside._outcome.value)")
    kernel.run("beside.close(); robot.close()")


def test_an_interrupt_that_reaches_all_below_the_kernel_ends_none_of_them(kernel: Kernel) -> None:
    kernel.run(MAKE + CONNECT)
    kernel.run(MOVE)
    pids = kernel.run("panel.state.status.worker_pid, panel.state.status.controller_pid")
    below = descendants(kernel.run("os.getpid()"))
    assert below >= set(pids)
    for pid in below:  # As VS Code does: microsoft/vscode-jupyter, src/kernels/raw/launcher/kernelProcess.node.ts.
        os.kill(pid, signal.SIGINT)
    kernel.manager.interrupt_kernel()
    assert kernel.run(STANDS) == ("idle", True)
    assert descendants(kernel.run("os.getpid()")) == below


def test_a_kernel_that_is_killed_takes_the_control_process_with_it(kernel: Kernel) -> None:
    kernel.run(MOVE)
    pids = kernel.run("panel.state.status.worker_pid, panel.state.status.controller_pid")
    assert all(os.path.exists(f"/proc/{pid}") for pid in pids)
    kernel.manager.provisioner.process.kill()  # type: ignore[union-attr]  # Nothing in the kernel can act any more.
    deadline = time.monotonic() + 10.0
    while any(os.path.exists(f"/proc/{pid}") for pid in pids):
        assert time.monotonic() < deadline, f"{pids} outlive the kernel"
        time.sleep(0.02)
