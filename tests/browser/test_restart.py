"""A page whose workbench is started again at its address."""

from __future__ import annotations

from urllib.parse import urlparse

import pytest
from playwright.sync_api import Error

from tests.waiting import wait_for

pytestmark = pytest.mark.browser
_READY = "document.documentElement.dataset.rlReady !== undefined"
_OPACITY = """(() => { const arm = __viserMutable.nodeRefFromName["/live"]; let found = null;
  if (arm) arm.traverse((node) => { if (node.material && found === null) found = node.material.opacity; });
  return found; })()"""


def look(tab, code: str) -> object:
    """The value of an expression in a page; None while the page is being loaded."""
    try:
        return tab.evaluate(code)
    except Error:
        return None


def test_a_page_loads_itself_again_when_another_workbench_answers_at_its_address(chromium, tmp_path) -> None:
    from rcilab.workbench.app import Workbench, WorkbenchConfig

    context = chromium.new_context(viewport={"width": 640, "height": 480})
    try:
        with Workbench(WorkbenchConfig(port=0, quality="light", runs=tmp_path)) as first:
            port = urlparse(first.url).port
            tab = context.new_page()
            tab.goto(f"{first.url}?fixedDpr=0.2")
            wait_for(lambda: look(tab, _READY), what="the page", timeout=60.0, tab=tab)
            tab.evaluate("window.before = true")
        wait_for(
            lambda: look(tab, "document.querySelector('.rl-lost') !== null"),
            what="the loss to show",
            timeout=15.0,
            tab=tab,
        )
        with Workbench(WorkbenchConfig(port=port, quality="light", runs=tmp_path)):
            wait_for(
                lambda: look(tab, "window.before === undefined"),
                what="the page to load itself again",
                timeout=60.0,
                tab=tab,
            )
            wait_for(lambda: look(tab, _READY), what="the panels", timeout=60.0, tab=tab)
            assert tab.evaluate("document.querySelector('.rl-lost') === null")
    finally:
        context.close()


def test_a_browser_without_a_graphics_card_draws_lightly_and_a_change_of_graphics_loads_the_page_again(
    chromium, tmp_path
) -> None:
    from rcilab.app.view_actions import SetView
    from rcilab.workbench.app import Workbench, WorkbenchConfig

    drawn = "document.documentElement.dataset.rlReady !== undefined && document.documentElement.dataset.rlQuality"
    context = chromium.new_context(viewport={"width": 640, "height": 480})
    try:
        with Workbench(WorkbenchConfig(port=0, runs=tmp_path)) as bench:
            tab = context.new_page()
            tab.goto(f"{bench.url}?fixedDpr=0.2")
            wait_for(lambda: look(tab, drawn) == "light", what="light graphics", timeout=60.0, tab=tab)
            for quality in ("full", "light"):
                bench.dispatcher.ask(SetView(name="quality", value=quality))
                wait_for(
                    lambda wanted=quality: look(tab, drawn) == wanted, what=f"{quality} graphics", timeout=60.0, tab=tab
                )
            wait_for(lambda: look(tab, _OPACITY) == 1.0, what="a solid arm", timeout=60.0, tab=tab)
            bench.session.disconnect()
            wait_for(
                lambda: (look(tab, _OPACITY) or 1.0) < 0.5,
                what="a translucent arm without a connection",
                timeout=60.0,
                tab=tab,
            )
    finally:
        context.close()
