"""`rcilab watch` in a browser: the motion of a program that is not rcilab, on a page that sends nothing."""

from __future__ import annotations

import numpy as np

from browser.page import BenchPage, close_toasts
from rcilab.execution.simulation_control import SimulationControl
from rcilab.workbench.app import Workbench, WorkbenchConfig
from tests.peers import programs
from tests.peers.arena import Process

NEAR = tuple(angle + 0.1 for angle in programs.START[7])  # [rad]


def toast(tab) -> str:
    """The text of the newest toast, also of one that is fading."""
    return tab.evaluate("document.querySelector('#rl-toast')?.textContent || ''")


def test_the_motion_of_a_foreign_client_is_followed(chromium, tmp_path) -> None:
    with Process("--lockstep", "--record", str(tmp_path)) as controller:
        address = f"{controller.host}:{controller.world_port}"
        with Workbench(WorkbenchConfig(port=0, quality="light", watch=address)) as bench:
            tab = chromium.new_page(viewport={"width": 960, "height": 620})
            page = BenchPage(tab, bench)
            tab.on("pageerror", lambda error: page.problems.append(str(error)))
            tab.goto(f"{bench.url}?fixedDpr=0.2")
            tab.wait_for_function("() => !!window.__viserMutable?.nodeRefFromName?.['/live']", timeout=40_000)
            close_toasts(tab)
            opened = tab.locator('[role="tab"][aria-selected="true"]')
            page.wait(lambda: "Run" in opened.all_inner_texts(), "the Run tab")
            with controller.connect() as robot:
                programs.prepare(robot, NEAR, factor=1.0)
                page.wait(lambda: "Motion 1 of 127.0.0.1 has ended" in toast(tab), "the end of the motion")
                q = np.array(robot.receive_fresh_state().q[:7])
                page.wait(lambda: page.shows("live", q), "the arm where the program has moved it")
                page.wait(lambda: page.chip("phase") == "watched", "the state in the bar")
            assert bench.store.state.plan is not None
            assert bench.store.state.plan.report.ok
            text = tab.locator(".rl-note:visible").first.inner_text()
            assert text.startswith("This page only watches rci://127.0.0.2:")
            assert page.button("Execute").is_disabled()
            tab.keyboard.press("Escape")
            page.wait(lambda: "This page only watches: stop the program" in toast(tab), "what Stop cannot do")
            page.unfold("Safety buttons")
            page.button("Emergency stop").click()
            with SimulationControl(controller.host, controller.world_port) as world:
                page.wait(lambda: world.status().button == "estop", "the emergency stop at the controller")
            page.wait(lambda: page.status.is_pressed, "the stop in the status")
            controller.process.terminate()
            page.wait(lambda: page.chip("phase") == "controller ended", "the end of the controller in the bar")
            page.wait(
                lambda: "start “rcilab watch”" in tab.locator(".rl-note:visible").first.inner_text(),
                "what to do",
            )
            assert page.problems == []
            tab.close()
