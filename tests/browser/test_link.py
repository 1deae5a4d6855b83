"""A link is copied on one page and opened on another, with a question where it replaces something."""

from __future__ import annotations

from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import LoadProgram
from rcilab.motion import Program, Waypoint
from tests.browser.page import close_toasts


def test_a_copied_link_asks_and_opens_and_a_page_loaded_with_one_shows_it(page):
    home, ask = page.state.model.home, page.bench.dispatcher.ask
    steps = lambda: page.state.program.draft.steps  # noqa: E731
    program = Program(model=page.state.model.name, start=home, waypoints=(Waypoint.joint(home + 0.1),))
    ask(EditProgram(what="clear"))
    ask(LoadProgram(name="one.json", content=program.to_json().encode()))
    page.wait(lambda: len(steps()) == 1, "a program")
    page.open_tab("Program")
    page.tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.button("Copy link").click()
    page.wait(lambda: "The link is copied." in page.toast(), "the copy")
    address = page.tab.evaluate("navigator.clipboard.readText()")
    fragment = address.partition("#")[2]
    assert address.startswith(page.bench.url.partition("?")[0])
    assert fragment.startswith("rcilab=")
    ask(EditProgram(what="duplicate", key=steps()[0].key))
    page.wait(lambda: len(steps()) == 2, "another program")
    for answer, count in (("Keep this page", 2), ("Open", 1)):
        page.tab.evaluate("fragment => { location.hash = fragment; }", fragment)
        page.button(answer).click()
        page.wait(lambda: page.state.link is None, "the answer")
        assert len(steps()) == count
        assert page.tab.evaluate("location.hash") == ""
    ask(EditProgram(what="clear"))
    page.wait(lambda: not steps(), "an empty page")
    page.tab.evaluate(
        "fragment => history.replaceState(null, '', location.pathname + location.search + '#' + fragment)", fragment
    )
    page.tab.reload()
    page.wait_until_drawn()
    close_toasts(page.tab)
    page.wait(lambda: len(steps()) == 1, "the program of the link")
    assert page.tab.evaluate("location.hash") == ""
    ask(EditProgram(what="clear"))
