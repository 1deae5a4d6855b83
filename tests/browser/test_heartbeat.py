"""A page that is slow, and one that is gone."""

from __future__ import annotations

import time

import numpy as np
import pytest

from rcilab.app.goal.goal_actions import SetSpeed
from rcilab.app.run.run_actions import RobotCommand
from tests.browser.page import BenchPage
from tests.waiting import wait_for

pytestmark = pytest.mark.browser


def test_a_page_that_is_held_up_by_drawing_keeps_the_controls(page) -> None:
    store = page.bench.store
    wait_for(lambda: store.state.control_lock.holder is not None, what="a holder", timeout=20.0, tab=page.tab)
    holder = store.state.control_lock.holder
    page.tab.evaluate("setTimeout(() => { const end = Date.now() + 3500; while (Date.now() < end); }, 0)")
    end, holders = time.monotonic() + 3.0, set()
    while time.monotonic() < end:  # Without a word to the page: it could not answer.
        holders.add(store.state.control_lock.holder)
        time.sleep(0.05)
    assert holders == {holder}


def test_a_page_that_is_closed_is_gone_at_once(chromium, page) -> None:
    store = page.bench.store
    before = store.state.control_lock.pages
    context = chromium.new_context(viewport={"width": 400, "height": 300})
    tab = context.new_page()
    tab.goto(f"{page.bench.url}?fixedDpr=0.2")
    wait_for(lambda: len(store.state.control_lock.pages) == len(before) + 1, what="another page", timeout=30.0, tab=tab)
    tab.close()
    wait_for(lambda: store.state.control_lock.pages == before, what="the page to be gone", timeout=2.0 + 3.0)
    context.close()


@pytest.mark.parametrize("way", ["closed", "hung"])
def test_a_moving_arm_stops_when_the_page_that_holds_the_controls_is_gone(chromium, tmp_path, way: str) -> None:
    from rcilab.workbench.app import Workbench, WorkbenchConfig

    context = chromium.new_context(viewport={"width": 640, "height": 480})
    try:
        with Workbench(WorkbenchConfig(port=0, quality="light", runs=tmp_path)) as bench:
            tab = context.new_page()
            page = BenchPage(tab, bench)
            tab.goto(f"{bench.url}?fixedDpr=0.2")
            page.wait_until_drawn()
            page.wait(lambda: page.status.phase == "idle" and bool(page.status.powered), "a powered, idle arm", 30.0)
            page.wait(lambda: page.state.control_lock.holder is not None, "a holder", 20.0)
            bench.dispatcher.ask(SetSpeed(speed=0.01))
            page.plan_to(1, 50.0)
            bench.dispatcher.ask(RobotCommand(what="execute"))
            page.wait(lambda: page.status.code == "moving" and (page.status.motion_time or 0.0) > 0.1, "a moving arm")
            if way == "closed":
                tab.close()
            else:
                tab.evaluate("setTimeout(() => { const end = Date.now() + 20000; while (Date.now() < end); }, 0)")
            wait_for(lambda: page.status.code == "idle.operator", what=lambda: f"the stop: {page.status}", timeout=12.0)
            assert np.abs(page.status.q_c - bench.store.state.plan.motion.q[-1]).max() > 0.05, "on its way"
    finally:
        context.close()
