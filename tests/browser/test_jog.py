"""Jog as a person: hold a button with the mouse or a key, and every way in which that ends."""

from __future__ import annotations

import time

import numpy as np
import pytest

from browser.page import close_toasts
from rcilab.app.jog.jog_actions import SetJog


@pytest.fixture
def jogging(page):
    """The Jog tab with the robot under its buttons, switched on by hand."""
    box = page.tab.get_by_label("Move the robot", exact=True)
    box.check()
    page.wait(lambda: page.state.jog.robot, "the buttons to move the robot")
    yield page
    page.tab.mouse.up()
    page.bench.dispatcher.ask(SetJog(robot=False, step=0.0))
    page.wait(lambda: page.status.phase == "idle", "the arm to rest")


def moves(page) -> bool:
    return page.status.dq is not None and float(np.abs(page.status.dq).max()) > 0.01


def press(page, name: str) -> None:
    """Puts the mouse on a button and holds it down until the arm moves."""
    button = page.button(name)
    button.scroll_into_view_if_needed()
    button.hover()
    page.tab.mouse.down()
    page.wait(lambda: moves(page), f"the arm to move with {name}")


def require_rest(page) -> None:
    """Waits until the arm stands for longer than any pause between two words of a button that is held."""

    there, since = np.array(page.status.q_c), time.monotonic()

    def rests() -> bool:
        nonlocal there, since
        if not np.array_equal(page.status.q_c, there):
            there, since = np.array(page.status.q_c), time.monotonic()
        return time.monotonic() - since > 0.5

    page.wait(rests, "the arm to stand")


def require_room(page) -> None:
    """The arm was not stopped by a limit or by what is near, but because nobody holds the button any more."""
    assert page.state.jog.sentence is None


def test_a_held_button_moves_the_robot_until_it_is_let_go_in_any_way(jogging):
    page, mouse, keyboard = jogging, jogging.tab.mouse, jogging.tab.keyboard
    start = np.array(page.status.q_c)
    press(page, "J1 +")
    mouse.up()
    require_rest(page)
    moved = page.status.q_c - start
    assert moved[0] > 0.0
    assert np.abs(moved[1:]).max() < 1e-12
    press(page, "J1 −")
    mouse.move(5000, 5000)  # Far outside of the page.
    page.wait(lambda: moves(page), "the arm to go on")
    mouse.up()
    require_rest(page)
    press(page, "z −")
    page.tab.evaluate("window.dispatchEvent(new Event('blur'))")
    require_rest(page)
    require_room(page)
    mouse.up()
    press(page, "z +")
    page.tab.get_by_role("tab", name="Check").focus()
    keyboard.press("Enter")
    require_rest(page)
    require_room(page)
    mouse.up()
    page.open_tab("Jog")
    press(page, "J1 +")
    keyboard.press("Escape")
    require_rest(page)
    mouse.up()
    page.wait(lambda: page.status.phase == "idle", "an idle arm")
    page.button("J1 −").focus()
    keyboard.down("Space")
    page.wait(lambda: moves(page), "the arm to move with the key")
    keyboard.up("Space")
    require_rest(page)
    page.wait(lambda: page.status.phase == "idle", "an idle arm")
    page.wait(lambda: np.array_equal(page.state.goal.q, page.status.q_c), "the goal where the arm is")
    press(page, "J1 +")
    page.tab.goto("about:blank")
    require_rest(page)
    assert not page.state.jog.robot
    mouse.up()
    assert page.status.faults == ()
    page.tab.goto(f"{page.bench.url}?fixedDpr=0.2")
    page.wait_until_drawn()
    close_toasts(page.tab)


_PAD = """(pressed) => {
  const pad = { connected: true, mapping: "standard", axes: [0, pressed.stick, 0, 0],
                buttons: [...Array(17).keys()].map((n) => ({ pressed: pressed.buttons.includes(n) })) };
  navigator.getGamepads = () => pressed.gone ? [] : [pad];
  window.dispatchEvent(new Event(pressed.gone ? "gamepaddisconnected" : "gamepadconnected"));
}"""


def test_keys_and_a_gamepad_jog_as_the_buttons_do_and_only_with_its_dead_man_button(jogging):
    page, keyboard = jogging, jogging.tab.keyboard
    start = np.array(page.status.q_c)
    keyboard.down("2")
    page.wait(lambda: moves(page), "joint 2 to move")
    keyboard.up("2")
    require_rest(page)
    moved = page.status.q_c - start
    assert moved[1] > 0.0
    assert np.abs(np.delete(moved, 1)).max() < 1e-12
    page.wait(lambda: page.status.phase == "idle", "an idle arm")

    page.tab.evaluate(_PAD, {"stick": -1.0, "buttons": [], "gone": False})
    require_rest(page)
    assert np.array_equal(page.status.q_c, start + moved), "nothing moves without the dead-man button"
    before = page.state.model.forward(page.status.q_c).position
    page.tab.evaluate(_PAD, {"stick": -1.0, "buttons": [4], "gone": False})
    page.wait(lambda: moves(page), "the tool to move")
    page.tab.evaluate(_PAD, {"stick": -1.0, "buttons": [], "gone": False})
    require_rest(page)
    travel = page.state.model.forward(page.status.q_c).position - before
    assert travel[0] > 1e-3
    assert np.abs(travel[1:]).max() < 1e-4
    page.wait(lambda: page.status.phase == "idle", "an idle arm")
    page.tab.evaluate(_PAD, {"stick": 1.0, "buttons": [5], "gone": False})
    page.wait(lambda: moves(page), "the tool to move back")
    page.tab.evaluate(_PAD, {"stick": 1.0, "buttons": [5], "gone": True})
    require_rest(page)


def test_a_question_mark_lists_the_keys(page):
    page.tab.evaluate("document.activeElement.blur()")  # A field of an earlier test.
    page.tab.locator("body").press("?")
    page.wait(lambda: "Dead-man button" in page.tab.locator("#rl-help").inner_text(), "the list of keys")
    page.tab.locator("body").press("?")
    page.wait(lambda: page.tab.locator("#rl-help").count() == 0, "no list")


_SPACEMOUSE = """() => {
  const mouse = window.fakeMouse = new EventTarget();
  mouse.open = async () => {};
  mouse.report = (id, bytes) => mouse.dispatchEvent(Object.assign(
    new Event("inputreport"), { reportId: id, data: new DataView(new Uint8Array(bytes).buffer) }));
  mouse.deflect = (id, bytes) => { mouse.timer = setInterval(() => mouse.report(id, bytes), 10); };
  Object.defineProperty(navigator, "hid", { configurable: true, value: { requestDevice: async () => [mouse] } });
}"""
_UP = [0, 0, 0, 0, 0xD4, 0xFE]  # x, y, z as little-endian int16: -300, away from the table.
_TURNED = [*_UP[:4], 0, 0, 0, 0, 0, 0, 0x2C, 0x01]  # With the turns in the same report: 300 about z.


def test_a_spacemouse_jogs_only_with_a_button_pressed_and_stops_with_it_its_silence_and_its_cable(jogging):
    page, tab = jogging, jogging.tab
    tab.evaluate(_SPACEMOUSE)
    tab.locator("#rl-toolbar").get_by_role("button", name="SpaceMouse").click()
    page.wait(lambda: "SpaceMouse connected" in page.toast(), "the device")
    start = np.array(page.status.q_c)
    tab.evaluate("bytes => fakeMouse.deflect(1, bytes)", _UP)
    require_rest(page)
    assert np.array_equal(page.status.q_c, start), "nothing moves without a button"
    before = page.state.model.forward(start)
    tab.evaluate("fakeMouse.report(3, [1, 0])")
    page.wait(lambda: moves(page), "the tool to move")
    tab.evaluate("fakeMouse.report(3, [0, 0])")
    require_rest(page)
    travel = page.state.model.forward(page.status.q_c).position - before.position
    assert travel[2] > 1e-3
    assert np.abs(travel[:2]).max() < 1e-4
    page.wait(lambda: page.status.phase == "idle", "an idle arm")
    tab.evaluate(
        "bytes => { clearInterval(fakeMouse.timer); fakeMouse.report(3, [2, 0]); fakeMouse.deflect(1, bytes); }",
        _TURNED,
    )
    page.wait(lambda: moves(page), "the tool to turn")
    tab.evaluate("clearInterval(fakeMouse.timer)")
    require_rest(page)
    require_room(page)
    now = page.state.model.forward(page.status.q_c)
    assert np.linalg.norm(now.position - before.position - travel) < 1e-4
    page.wait(lambda: page.status.phase == "idle", "an idle arm")
    tab.evaluate("bytes => fakeMouse.deflect(1, bytes)", _UP)
    page.wait(lambda: moves(page), "the tool to move again")
    tab.evaluate(_UNPLUGGED)
    require_rest(page)
    tab.evaluate("clearInterval(fakeMouse.timer)")


_UNPLUGGED = """() => {
  const hid = Object.getOwnPropertyDescriptor(Navigator.prototype, "hid").get.call(navigator);
  hid.dispatchEvent(Object.assign(new Event("disconnect"), { device: fakeMouse }));
}"""
