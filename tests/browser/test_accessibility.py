"""The page by keyboard and for those who hear it read: names, contrast, order, judged by axe and by what we ask for."""

from __future__ import annotations

import os
from importlib.resources import files
from importlib.util import find_spec

import pytest

from rcilab.app.view_actions import SetView

WORST = ("serious", "critical")
_UNNAMED = """() => [...document.querySelectorAll('#root button, #root input:not([type=hidden]):not([type=file]), '
  + '#root [role=slider], #root [role=tab], #root textarea, #rl-bar button')]
  .filter((c) => c.getClientRects().length && !c.closest('[aria-hidden=true]'))
  .filter((c) => !(c.getAttribute('aria-label') || c.textContent.trim() || c.title
    || [...(c.labels || [])].some((l) => l.textContent.trim())
    || (c.getAttribute('aria-labelledby') || '').split(' ').some((id) => id && document.getElementById(id))))
  .map((c) => c.outerHTML.slice(0, 160))"""
_UNSEEN = """() => [...document.querySelectorAll('#root .mantine-Button-root:not([data-variant=outline])')]
  .filter((button) => !button.disabled)
  .filter((button) => button.getClientRects().length)
  .filter((button) => getComputedStyle(button).backgroundColor === 'rgba(0, 0, 0, 0)')
  .map((button) => button.textContent)"""
_UNHINTED = """() => [...document.querySelectorAll('#root button:has(svg[data-rl-hint])')]
  .filter((button) => button.title.length < 4).map((button) => button.textContent)"""


@pytest.fixture
def axe(page):
    """axe-core in the page; it is no part of rcilab, only of its tests."""
    if find_spec("axe_playwright_python") is None:
        reason = "axe-playwright-python is not installed: pip install 'rcilab[test]'"
        pytest.fail(reason) if os.environ.get("CI") == "true" else pytest.skip(reason)
    if not page.tab.evaluate("!!window.axe"):
        page.tab.evaluate(files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8"))
    return page


def violations(page) -> list[str]:
    """What axe calls serious or worse, viser's own widgets included."""
    options = (
        "{resultTypes: ['violations'], runOnly: {type: 'tag', values: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa']}}"
    )
    found = page.tab.evaluate(f"async () => (await axe.run(document, {options})).violations")
    worst = [rule for rule in found if rule["impact"] in WORST]
    return [f"{rule['id']}: {node['html'][:140]}" for rule in worst for node in rule["nodes"]]


def test_in_every_tab_controls_have_names_buttons_are_seen_stop_too_and_axe_finds_nothing_serious(axe):
    page, tab = axe, axe.tab
    page.plan_to(1, 20)  # With a plan there are more buttons to press.
    names = [name for name in tab.get_by_role("tab").all_inner_texts() if name != "Timeline and plots"]
    assert len(names) >= 7
    hinted = 0
    for name in names:
        page.open_tab(name)
        page.wait(lambda: tab.evaluate(_UNNAMED) == [], lambda: str(tab.evaluate(_UNNAMED)))
        page.wait(lambda: tab.evaluate(_UNSEEN) == [], lambda: str(tab.evaluate(_UNSEEN)))
        page.wait(lambda: tab.evaluate(_UNHINTED) == [], lambda: str(tab.evaluate(_UNHINTED)))
        hinted += tab.evaluate("document.querySelectorAll('#root button[title] svg[data-rl-hint]').length")
        assert page.button("Stop").is_visible(), name
    assert hinted > 20
    assert violations(page) == []
    tab.evaluate("document.querySelector('#root [role=slider]').dataset.kept = ''")
    page.bench.dispatcher.ask(SetView(name="theme", value="dark"))
    page.wait(lambda: tab.evaluate("document.documentElement.dataset.rlTheme") == "dark", "a dark page")
    assert tab.evaluate("!!document.querySelector('#root [data-kept]')"), "the panels are not made anew for it"
    page.wait(lambda: tab.evaluate(_UNNAMED) == [], "names in the dark panels")
    page.open_tab("Jog")
    assert violations(page) == []
    page.bench.dispatcher.ask(SetView(name="theme", value="light"))
    page.wait(lambda: tab.evaluate("document.documentElement.dataset.rlTheme") == "light", "a light page")


def test_a_slider_has_its_joints_name_a_folder_opens_by_key_and_the_focus_is_seen(page):
    slider = page.tab.get_by_role("slider", name="J3", exact=True)
    slider.wait_for()
    before = float(page.state.goal.q[2])
    slider.focus()
    page.tab.keyboard.press("ArrowRight")
    page.wait(lambda: page.state.goal.q[2] > before, "joint 3 to turn by a key")
    page.tab.get_by_role("textbox", name="J3", exact=True).wait_for()
    folder = page.tab.get_by_role("button", name="Plots and loop", expanded=False)
    folder.focus()
    assert page.tab.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    page.tab.keyboard.press("Enter")
    page.tab.get_by_role("checkbox", name="Torque (with load)").press("Space")
    page.wait(lambda: "tau" in page.state.plots, "the plot of torques to be chosen")
    page.tab.locator(".rl-plot-title", has_text="Torque").wait_for()
    page.tab.get_by_role("checkbox", name="Torque (with load)").press("Space")
    page.wait(lambda: "tau" not in page.state.plots, "and no longer")
    page.tab.get_by_role("button", name="Plots and loop", expanded=True).press("Enter")
    page.tab.get_by_role("button", name="Plots and loop", expanded=False).wait_for()
