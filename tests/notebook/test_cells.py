"""Who ends what, and when: fifty re-runs leave nothing behind, an interrupt stops what moves."""

from __future__ import annotations

import gc
import os
import threading
from types import SimpleNamespace
from typing import Any

import pytest
from ipywidgets.widgets import widget

import rcilab
from rcilab import notebook
from rcilab.notebook import cells
from rcilab.notebook.cells import CellRegistry
from rcilab.notebook.kernel_reachability import KernelReachability
from tests.processes import processes

PRO7 = rcilab.load_model("xMatePro7")
HERE = KernelReachability(route="loopback")


class Shell:
    """As much of ipykernel's shell as `CellRegistry` needs: a cell at a time, by its id or by its text."""

    def __init__(self) -> None:
        self.events = self
        self.kernel = SimpleNamespace()
        self._hooks: dict[str, Any] = {}
        self._parent: dict[str, Any] = {}

    def register(self, event: str, hook: Any) -> None:
        self._hooks[event] = hook

    def get_parent(self) -> dict[str, Any]:
        return self._parent

    def run(self, act: Any, cell_id: str | None, code: str = "", error: BaseException | None = None) -> Any:
        self._parent = {"content": {"code": code}, "metadata": {} if cell_id is None else {"cellId": cell_id}}
        self._hooks["pre_run_cell"](SimpleNamespace(cell_id=cell_id, raw_cell=code))
        made = act()
        self._hooks["post_run_cell"](SimpleNamespace(error_in_exec=error))
        return made


class Thing:
    """Something that a cell owns."""

    def __init__(self, owner: CellRegistry) -> None:
        self.closed = self.halted = 0
        owner.adopt(self)

    def close(self) -> None:
        self.closed += 1

    def halt(self) -> None:
        self.halted += 1


class Unseen:
    """An arm without meshes: what is counted here is what serves them."""

    def __init__(self, *what: Any, **how: Any) -> None: ...
    def show(self, q: Any) -> None: ...
    def set_visible(self, visible: bool) -> None: ...


@pytest.fixture
def shell() -> Shell:
    return Shell()


@pytest.fixture
def owner(shell: Shell) -> CellRegistry:
    return CellRegistry(shell)


def test_a_cell_that_runs_again_ends_what_it_made_and_nothing_else(shell: Shell, owner: CellRegistry) -> None:
    first = shell.run(lambda: Thing(owner), "a")
    other = shell.run(lambda: Thing(owner), "b")
    second = shell.run(lambda: Thing(owner), "a")
    assert (first.closed, other.closed, second.closed) == (1, 0, 0)


def test_where_nobody_names_cells_their_text_does(shell: Shell, owner: CellRegistry) -> None:
    first = shell.run(lambda: Thing(owner), None, "Lab(model)")
    other = shell.run(lambda: Thing(owner), None, "Scene(model)")
    shell.run(lambda: Thing(owner), None, "Lab(model)")
    assert (first.closed, other.closed) == (1, 0)


def test_an_interrupted_cell_stops_everything_that_moves_and_closes_nothing(shell: Shell, owner: CellRegistry) -> None:
    thing = shell.run(lambda: Thing(owner), "a")
    shell.run(lambda: None, "b", error=KeyboardInterrupt())
    assert (thing.halted, thing.closed) == (1, 0)
    shell.run(lambda: None, "b", error=ValueError())
    assert thing.halted == 1


def test_the_end_of_the_kernel_ends_everything(shell: Shell, owner: CellRegistry) -> None:
    things = [shell.run(lambda: Thing(owner), name) for name in "abc"]
    owner.close()
    assert [thing.closed for thing in things] == [1, 1, 1]


def test_fifty_re_runs_leave_no_thread_no_socket_no_widget_and_no_process(
    shell: Shell, owner: CellRegistry, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, others = set(threading.enumerate()), processes()  # What other tests have left in this process.
    monkeypatch.setattr("rcilab.notebook.part.kernel_cells", lambda: owner)
    monkeypatch.setattr(cells, "_kernel_cells", owner)

    def run_cell() -> None:
        scene = notebook.Scene(PRO7, reachability=HERE)
        notebook.Timeline(scene)
        notebook.RunPanel(scene)

    def count() -> tuple[int, ...]:
        gc.collect()
        return threading.active_count(), len(os.listdir("/proc/self/fd")), len(widget._instances), len(processes())

    def run_everything(times: int) -> None:
        with monkeypatch.context() as patch:
            patch.setattr("rcilab.notebook.scene.ArmView", Unseen)
            for _ in range(times):
                shell.run(run_cell, "cell")
        shell.run(lambda: notebook.Lab(PRO7, reachability=HERE), "lab")
        shell.run(lambda: notebook.Lab(PRO7, reachability=HERE), "lab")
        shell.run(lambda: notebook.RunPanel(PRO7), "robot").connect.click()
        assert shell.run(lambda: notebook.RunPanel(PRO7), "robot").state.robot is None

    run_everything(1)  # What is opened once and for all, as by a library at its first use, is open from here on.
    once = count()
    run_everything(50)
    assert count() == once
    owner.close()
    assert [thread.name for thread in threading.enumerate() if thread not in before] == []
    assert processes() - others == set()
