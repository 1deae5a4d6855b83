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
