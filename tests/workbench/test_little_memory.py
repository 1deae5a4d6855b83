"""A page on a machine that is out of memory: it says so, offers to connect again, and nothing of it is half alive."""

from __future__ import annotations

import errno
import threading

import pytest

from rcilab.app.robot_connection import RobotConnection
from rcilab.app.run.run_actions import ChooseRobot
from rcilab.control_process.layout import ControlBlock
from rcilab.control_process.supervisor import Supervisor
from rcilab.core.errors import UsageError
from rcilab.model.robot_model import load_model
from rcilab.workbench.app import Workbench, WorkbenchConfig
from tests.workbench.opened import told, wait
from tests.workbench.test_surprises import is_ready

MODEL = load_model("xMatePro7")
ERRORS = [OSError(errno.ENOMEM, "Cannot allocate memory"), RuntimeError("can't start new thread"), MemoryError()]


def raising(error: Exception):
    def fail(*_: object, **__: object) -> None:
        raise error

    return fail


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("place", [(ControlBlock, "create"), (Supervisor, "__init__"), (Supervisor, "start")])
def test_a_robot_side_that_finds_no_memory_is_told_and_can_be_started_again(place, error) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(*place, raising(error))
        with Workbench(WorkbenchConfig(port=0, quality="light")) as bench:
            wait(lambda: told(bench) == "notice.error", "to be told")
            assert bench.store.state.notice.text.values["text"].code == "error.starved"
            wait(lambda: bench.session.status().code == "crashed.no_start", "it can be connected")
            patch.undo()
            bench.dispatcher.ask(ChooseRobot(target="virtual"))
            wait(lambda: is_ready(bench), "an arm")


def test_a_thread_that_cannot_be_started_leaves_a_session_that_can_be_closed_and_opened(monkeypatch) -> None:
    session = RobotConnection(lambda error: None)
    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", raising(ERRORS[1]))
        with pytest.raises(UsageError, match="not enough free memory"):
            session.open(MODEL, "virtual")
    assert session.status().phase == "closed"
    session.open(MODEL, "virtual")
    wait(lambda: session.is_ready, "an arm")
    session.close()


@pytest.mark.parametrize("name", ["renderer", "dispatcher", "session", "operator"])
def test_a_page_that_cannot_start_one_of_its_threads_says_only_that(monkeypatch, name) -> None:
    start = threading.Thread.start

    def refuse(thread: threading.Thread) -> None:
        if thread.name == name:
            raise ERRORS[1]
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with (
        pytest.raises((RuntimeError, UsageError), match=r"start new thread|not enough free memory"),
        Workbench(WorkbenchConfig(port=0, quality="light")),
    ):
        pass
    left = {thread.name for thread in threading.enumerate()}
    assert not left & {"renderer", "dispatcher", "session", "operator", "rcilab-supervisor"}


def test_a_supervisor_without_a_thread_to_watch_leaves_no_process(monkeypatch) -> None:
    supervisor = Supervisor(MODEL)
    start = threading.Thread.start

    def refuse(thread: threading.Thread) -> None:
        if thread.name == "rcilab-supervisor":
            raise ERRORS[1]
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with pytest.raises(UsageError, match="not enough free memory"):
        supervisor.start()
    status = supervisor.status()
    assert (status.phase, status.worker_pid, status.controller_pid) == ("closed", None, None)


@pytest.mark.parametrize("name", ["held push", "simulation status"])
def test_a_thread_for_the_world_port_is_started_once_there_is_memory(monkeypatch, capfd, name) -> None:
    start, refused = threading.Thread.start, threading.Event()

    def refuse(thread: threading.Thread) -> None:
        if thread.name == name:
            refused.set()
            raise ERRORS[1]
        start(thread)

    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", refuse)
        with Workbench(WorkbenchConfig(port=0, quality="light")) as bench:
            wait(refused.is_set, "a thread to be refused")
            wait(lambda: told(bench) == "notice.error", "to be told")
            assert bench.store.state.notice.text.values["text"].code == "error.starved"
            assert sum(notice.cause == "tick" for notice in bench.store.state.notices) == 1
            patch.undo()
            wait(lambda: any(thread.name == name for thread in threading.enumerate()), "the thread")
            wait(lambda: all(notice.cause != "tick" for notice in bench.store.state.notices), "the notice to go")
            assert bench.dispatcher.errors == []
    assert "Traceback" not in capfd.readouterr().err
