"""A page whose workbench is started again at its address."""

from __future__ import annotations

from urllib.parse import urlparse

import pytest

from tests.browser.page import wait_for

pytestmark = pytest.mark.browser
_READY = "document.documentElement.dataset.rlReady !== undefined"


def test_a_page_loads_itself_again_when_another_workbench_answers_at_its_address(chromium, tmp_path) -> None:
    from rcilab.workbench.app import Workbench, WorkbenchConfig

    context = chromium.new_context(viewport={"width": 640, "height": 480})
    try:
        with Workbench(WorkbenchConfig(port=0, quality="light", runs=tmp_path)) as first:
            port = urlparse(first.url).port
            tab = context.new_page()
            tab.goto(f"{first.url}?fixedDpr=0.2")
            wait_for(lambda: tab.evaluate(_READY), "the page", 30.0, tab)
            tab.evaluate("window.before = true")
        wait_for(lambda: tab.evaluate("document.querySelector('.rl-lost') !== null"), "the loss to show", 15.0, tab)
        with Workbench(WorkbenchConfig(port=port, quality="light", runs=tmp_path)):
            wait_for(lambda: tab.evaluate("window.before === undefined"), "the page to load itself again", 30.0, tab)
            wait_for(lambda: tab.evaluate(_READY), "the panels", 30.0, tab)
            assert tab.evaluate("document.querySelector('.rl-lost') === null")
    finally:
        context.close()


def test_without_a_connection_the_arm_is_translucent_and_nothing_is_called_passed(page) -> None:
    bench, tab = page.bench, page.tab
    opacity = """(() => { const arm = __viserMutable.nodeRefFromName["/live"]; let found = null;
      if (arm) arm.traverse((node) => { if (node.material && found === null) found = node.material.opacity; });
      return found; })()"""
    wait_for(lambda: tab.evaluate(opacity) == 1.0, "a solid arm", 20.0, tab)
    target = bench.store.state.target
    bench.session.disconnect()
    try:
        wait_for(lambda: (tab.evaluate(opacity) or 1.0) < 0.5, "a translucent arm", 20.0, tab)
    finally:
        bench.session.open(bench.store.state.model, target, bench.store.state.plant)
        wait_for(lambda: bench.session.is_ready, "the connection", 30.0)
    wait_for(lambda: tab.evaluate(opacity) == 1.0, "a solid arm again", 20.0, tab)


def test_a_browser_without_a_graphics_card_draws_lightly_and_a_change_of_graphics_loads_the_page_again(
    chromium, tmp_path
) -> None:
    from rcilab.workbench import requests
    from rcilab.workbench.app import Workbench, WorkbenchConfig

    drawn = "document.documentElement.dataset.rlReady !== undefined && document.documentElement.dataset.rlQuality"
    context = chromium.new_context(viewport={"width": 640, "height": 480})
    try:
        with Workbench(WorkbenchConfig(port=0, runs=tmp_path)) as bench:
            tab = context.new_page()
            tab.goto(f"{bench.url}?fixedDpr=0.2")
            wait_for(lambda: tab.evaluate(drawn) == "light", "light graphics", 40.0, tab)
            for quality in ("full", "light"):
                bench.conductor.ask(requests.SetView(name="quality", value=quality))
                wait_for(lambda wanted=quality: tab.evaluate(drawn) == wanted, f"{quality} graphics", 40.0, tab)
    finally:
        context.close()
