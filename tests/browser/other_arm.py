"""A page with an arm of another maker, for the tests of a module."""

from __future__ import annotations

from collections.abc import Iterator

from browser.page import BenchPage
from browser.test_settings import choose
from rcilab.app.run.run_actions import ChooseRobot
from rcilab.app.view_actions import SetView


def switch_arm(opened: BenchPage, name: str) -> Iterator[BenchPage]:
    """Chooses an arm by its full name in the settings; afterwards the arm of the other tests again."""
    opened.start_afresh()
    opened.open_tab("Settings")
    choose(opened, "Robot", name)
    opened.wait_for_arm(name.split()[-1])
    yield opened
    opened.bench.dispatcher.ask(SetView(name="language", value="en"))
    opened.bench.dispatcher.ask(ChooseRobot(model="xMatePro7"))
    opened.wait_for_arm("xMatePro7")
