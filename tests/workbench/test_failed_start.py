"""A controller that does not start: the page says so until it is started again, and the terminal says why."""

from __future__ import annotations

import pytest

from rcilab.app.run.readiness import connection_note, obstacle
from rcilab.app.run.run_actions import ChooseRobot
from rcilab.app.text import Text
from rcilab.cli.workbench import _print_problem
from rcilab.workbench.app import Workbench, WorkbenchConfig
from rcilab.workbench.panels.timeline import TimelinePanel
from tests.workbench.opened import wait

REASON = {
    "en": "The controller was not ready after 20 s: when this computer is less busy, press Start it again, or Connect.",
    "zh": "控制器 20 s 后仍未就绪：请在本机不太忙时按“重新启动”或“连接”。",
}


def test_a_controller_that_is_too_slow_is_named_until_it_is_started_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rcilab.control_process.launch.START_TIMEOUT", 0.0)
    with Workbench(WorkbenchConfig(port=0, quality="light")) as bench:
        wait(
            lambda: (now := bench.session.status()).phase == "crashed" and now.incident is None, "the end of the start"
        )
        state, status = bench.store.state, bench.session.status()
        printed = _print_problem(status, "")
        assert _print_problem(status, printed) == printed
        assert capsys.readouterr().err.count("the virtual controller was not ready after 0 s") == 1
        for language, reason in REASON.items():
            text = Text(language)
            for shown in (obstacle(state, status), connection_note(state, status)):
                assert shown is not None
                assert text.render(shown) == reason
            assert reason in TimelinePanel(text, lambda request: None)._read(state, status)
        monkeypatch.undo()
        bench.dispatcher.ask(ChooseRobot(target="virtual"))  # "Start it again".
        wait(lambda: bench.session.status().phase == "idle", "the arm")
        assert connection_note(bench.store.state, bench.session.status()) is None
        assert bench.dispatcher.errors == []
        assert bench.renderer.errors == []
