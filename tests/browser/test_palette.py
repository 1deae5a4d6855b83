"""The command palette: every control of the page is found by its words and used as by hand, by keys alone."""

from __future__ import annotations

import pytest

from rcilab.app.cell.cell_actions import EditCell
from rcilab.app.setup.setup_actions import PressSetup
from rcilab.app.view_actions import SetView


@pytest.fixture
def search(page):
    """Opens the palette, types words, and returns the names that are found."""

    def find(words: str) -> list[str]:
        page.tab.keyboard.press("Control+k")
        page.tab.locator("#rl-palette input").fill(words)
        page.wait(lambda: page.tab.locator("#rl-commands [role=option]").count() > 0, "entries")
        page.tab.wait_for_timeout(100)
        return page.tab.locator("#rl-commands [role=option] b").all_inner_texts()

    tool = page.state.setup.wanted.tool
    yield find
    page.bench.dispatcher.ask(EditCell(what="clear"))
    if page.state.setup.wanted.tool is not tool:  # That of an example.
        page.bench.dispatcher.ask(PressSetup(what="undo"))
    page.bench.dispatcher.ask(SetView(name="theme", value="light"))
    page.bench.dispatcher.ask(SetView(name="language", value="en"))
    page.wait(lambda: page.state.setup.wanted.tool.is_close(tool), "the tool of before")
    page.wait(lambda: page.chip("where").startswith("virtual"), "the words of before")


def test_examples_options_switches_tabs_and_views_are_used_by_keys(page, search):
    assert search("pick and place") == ["Pick and place"]
    page.tab.keyboard.press("Enter")
    page.wait(lambda: page.state.cell.cell is not None, "the example")
    page.button("Machine tending").wait_for(state="visible")  # Its tab is open.
    found = search("settings theme")
    page.tab.keyboard.press("ArrowDown")
    page.tab.keyboard.press("ArrowUp")
    for _ in range(found.index("Theme: dark")):
        page.tab.keyboard.press("ArrowDown")
    page.tab.keyboard.press("Enter")
    page.wait(lambda: page.state.theme == "dark", "the option")
    assert "swept" not in page.state.scene.extras
    search("swept volume")
    page.tab.keyboard.press("Enter")
    page.wait(lambda: "swept" in page.state.scene.extras, "the switch")
    search("swept volume")
    page.tab.keyboard.press("Enter")
    page.wait(lambda: "swept" not in page.state.scene.extras, "the switch again")
    assert search("program")[0] == "Program"
    page.tab.keyboard.press("Enter")
    page.button("Plan all").wait_for(state="visible")
    page.open_tab("Jog")
    assert search("import path")[0] == "Import path"
    with page.tab.expect_file_chooser():
        page.tab.keyboard.press("Enter")


def test_what_is_disabled_is_not_used_and_held_buttons_are_not_listed(page, search):
    page.tab.locator("#rl-find").click()
    page.tab.locator("#rl-palette input").fill("plan all")
    row = page.tab.locator("#rl-commands [aria-disabled=true]")
    row.wait_for()
    page.tab.keyboard.press("Enter")
    assert page.tab.locator("#rl-palette").is_visible()
    page.tab.locator("#rl-palette input").fill("J1")
    page.wait(lambda: "J1 +" not in page.tab.locator("#rl-commands").inner_text(), "no button that is held")
    page.tab.keyboard.press("Control+k")
    page.wait(lambda: page.tab.locator("#rl-palette").count() == 0, "a closed palette")


def test_the_palette_is_in_the_language_of_the_page(page, search):
    page.bench.dispatcher.ask(SetView(name="language", value="zh"))
    page.wait(lambda: page.tab.locator("#rl-find").get_attribute("aria-label") == "全部命令", "the other language")
    assert "抓取与放置" in search("单元 示例")
    page.tab.keyboard.press("Escape")
    page.wait(lambda: page.tab.locator("#rl-palette").count() == 0, "a closed palette")
