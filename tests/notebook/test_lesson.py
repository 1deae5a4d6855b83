"""What the lessons share."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.cycle_log import cycle_dtype
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from rcilab.notebook.browser_watchdog import PAGE_GONE
from rcilab.notebook.lesson import answer, language
from rcilab.recording.run import build_run

SESSION = "JPY_SESSION_NAME"


@pytest.mark.parametrize(
    ("name", "found"),
    [("/home/me/05_s_curves_and_limits.zh.ipynb", "zh"), ("05_s_curves_and_limits.ipynb", "en"), ("", "en")],
)
def test_the_name_of_the_notebook_decides_the_language(monkeypatch, name: str, found: str) -> None:
    monkeypatch.setenv(SESSION, name)
    assert language() == found


def test_vs_code_leaves_the_name_among_the_variables(monkeypatch) -> None:
    monkeypatch.delenv(SESSION, raising=False)
    shell = SimpleNamespace(user_ns={"__vsc_ipynb_file__": "/home/me/01_first_motion.zh.ipynb"})
    monkeypatch.setattr("IPython.core.getipython.get_ipython", lambda: shell)
    assert language() == "zh"


def test_without_a_notebook_it_is_english(monkeypatch) -> None:
    monkeypatch.delenv(SESSION, raising=False)
    assert language() == "en"


def test_an_answer_is_told_in_the_readers_language(monkeypatch, capsys) -> None:
    monkeypatch.setenv(SESSION, "01_first_motion.zh.ipynb")
    answer(True, "T = 1.952 s")
    monkeypatch.setenv(SESSION, "01_first_motion.ipynb")
    answer(False, "T = 0.700 s")
    assert capsys.readouterr().out == "✓ 正确: T = 1.952 s\n✗ not yet: T = 0.700 s\n"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mine.zh.ipynb", ("成功率", "条件", "目标")),
        ("mine.ipynb", ("success rate", "condition", "goal")),
    ],
)
def test_what_shows_itself_speaks_as_any_notebook_does(monkeypatch, name: str, words: tuple[str, str, str]) -> None:
    """Whether or not it is a lesson, and says so to nobody."""
    monkeypatch.setenv(SESSION, name)
    model = load_model("xMatePro7")
    motion = plan_joint(model, model.home, model.home + 0.1)
    run = build_run(np.zeros(0, cycle_dtype(7)), plan=None, realtime=False)
    for shown, word in zip((run, check(motion, model), motion), words, strict=True):
        assert word in shown._repr_html_()
    assert ("xMatePro7, motion" in check(motion, model)._repr_html_()) == (words[0] == "success rate")


def test_why_a_run_was_stopped_is_said_in_the_readers_language(monkeypatch) -> None:
    monkeypatch.setenv(SESSION, "mine.zh.ipynb")
    rows = np.zeros(0, cycle_dtype(7))
    assert "笔记本页面已不在" in build_run(rows, plan=None, realtime=False, stopped=PAGE_GONE)._repr_html_()
    assert "too hot" in build_run(rows, plan=None, realtime=False, stopped="too hot")._repr_html_()  # One's own reason.
