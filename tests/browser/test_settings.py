"""Language, another arm, two pages, and a page of a foreign origin."""

from __future__ import annotations

import http.server
import threading
import time

import numpy as np
import pytest

from browser.page import BenchPage, close_toasts
from rcilab.app.text import Text
from rcilab.app.view_actions import SetView
from rcilab.i18n.translator import message
from rcilab.i18n.units import USUAL

_WRAPPED = """() => [...document.querySelectorAll('#root label')].filter((label) => label.offsetParent
  && label.getBoundingClientRect().height > 1.5 * parseFloat(getComputedStyle(label).lineHeight))
  .map((label) => label.textContent)"""
_UNFOLD_AND_LEAVE = """async () => {
  const press = async (what, name) => {
    for (const end = performance.now() + 15000; performance.now() < end; await new Promise((go) => setTimeout(go))) {
      const found = [...document.querySelectorAll(what)].find((it) => it.textContent.trim().startsWith(name));
      if (found) {
        for (const kind of ["pointerdown", "pointerup", "click"])
          found.dispatchEvent(new PointerEvent(kind, { bubbles: true, isPrimary: true, pointerId: 1 }));
        return;
      }
    }
    throw new Error(name + " is not there");
  };
  await press('[role="tab"]', "Setup");
  await press(".mantine-Paper-root > .mantine-Paper-root:first-child", "Soft joint limits");
  await press('[role="tab"]', "Settings");
}"""  # Sooner than the page looks at what it shows.


def test_the_language_changes_everywhere_and_back(page):
    page.open_tab("Settings")
    choose(page, "Language", "中文")
    page.tab.get_by_role("tab", name="点动").wait_for()
    page.wait(lambda: page.tab.locator("#rl-stop").inner_text().startswith("停止"), "Stop in Chinese")
    assert page.tab.locator("[data-id=model] small").inner_text() == "机器人"
    page.tab.locator('[role="tab"][aria-selected="true"]', has_text="设置").wait_for()  # The tab stays open.
    choose(page, "语言", "English")
    page.tab.get_by_role("tab", name="Settings").wait_for()


def test_every_label_of_the_chinese_page_is_on_one_line(page):
    page.bench.dispatcher.ask(SetView(name="language", value="zh"))
    for tab, group, label in (
        ("目标", "", "四元数"),
        ("配置", "到达软限位时", "auto_limit"),
        ("运行", "数字输出与输入", "输出接到输入"),
        ("设置", "", "关节坐标系"),
    ):
        page.open_tab(tab)
        if group:
            page.unfold(group)
        page.tab.locator("label:visible", has_text=label).wait_for()
        assert page.tab.evaluate(_WRAPPED) == []


def test_a_warning_stays_beside_later_good_news_and_keeps_its_colour(page):
    store, text = page.bench.store, Text("en")
    said = message("record.unwritable", file="run.rcirun", why="cannot be written"), message("notice.arrived")
    try:
        for at, (tone, news) in enumerate(zip(("warn", "good"), said, strict=True)):
            page.tab.evaluate(f"Date.now = () => {1e12 + 2000 * at}")
            store.notify(tone, news)
            store.changed.set()
            page.wait(lambda news=news: text.render(news) in page.toast(), "the notice")
        assert text.render(said[0]) in page.toast()
        assert "rl-warn" in page.tab.locator("#rl-toast.rl-shown").get_attribute("class")
    finally:
        page.tab.evaluate("Date.now = () => Math.floor(performance.timeOrigin + performance.now())")


def test_another_arm_stands_there_without_a_restart(page):
    page.tab.evaluate(_UNFOLD_AND_LEAVE)
    choose(page, "Robot", "ROKAE xMate3")
    page.wait(lambda: page.state.model.name == "xMate3", "the other model", 30)
    page.wait(lambda: page.status.q is not None and len(page.status.q) == 6, "states of a 6-axis arm", 30)
    page.wait(lambda: page.shows("live", page.status.q), "the other arm in the scene", 30)
    page.open_tab("Jog")
    page.wait(lambda: page.rows().get_by_role("slider").count() == 6, "six sliders")
    page.open_tab("Setup")
    page.wait(lambda: page.tab.get_by_text("J6 ≥", exact=False).is_visible(), "the unfolded group with its content")
    page.tab.locator("[aria-expanded]:visible", has_text="Soft joint limits").click()
    page.open_tab("Settings")
    choose(page, "Robot", "ROKAE xMatePro7")
    page.wait(lambda: page.status.q is not None and len(page.status.q) == 7, "the first arm again", 30)
    page.wait(lambda: page.shows("live", page.status.q), "the first arm in the scene", 30)


def test_the_second_page_watches_asks_for_the_controls_and_is_given_them(page, chromium):
    context = chromium.new_context(viewport={"width": 960, "height": 620})
    other = BenchPage(context.new_page(), page.bench)
    other.tab.goto(f"{page.bench.url}?fixedDpr=0.2")
    other.wait_until_drawn()
    close_toasts(other.tab)
    page.wait(lambda: len(page.state.control_lock.pages) == 2, "two pages")
    before = np.array(page.state.goal.q)
    other.type_joint(1, "33")
    other.wait(lambda: "holds the controls" in other.toast(), "to be told that it only watches")
    assert np.array_equal(page.state.goal.q, before)
    assert page.toast() != other.toast(), "the page that holds the controls need not be told"
    assert (page.chip("controls"), other.chip("controls")) == ("this page, 1 of 2", "page 1; this is page 2")
    looks = "(box) => getComputedStyle(box).opacity"
    assert float(other.slider(1).locator("xpath=ancestor::*[contains(@class,'Slider-root')]").evaluate(looks)) < 0.6
    assert float(page.slider(1).locator("xpath=ancestor::*[contains(@class,'Slider-root')]").evaluate(looks)) == 1.0
    assert page.tab.locator("#rl-take").is_hidden()
    seen = "Boolean(__viserMutable.nodeRefFromName['/target']?.visible)"
    other.wait(lambda: other.tab.evaluate(seen) is False, "no handles on a page that cannot use them")
    assert page.tab.evaluate(seen) is True
    other.button("Ask for the controls").first.click()
    question = page.tab.get_by_role("alertdialog", name="Page 2 asks for the controls")
    question.wait_for()
    assert other.tab.get_by_role("alertdialog").count() == 0
    other.wait(lambda: "You have asked page 1" in other.toast(), "the page that asks to be told so")
    assert "asked page 1" not in page.toast()
    question.get_by_role("button", name="Keep them").click()
    other.wait(lambda: "was refused" in other.toast(), "the answer")
    other.button("Ask for the controls").first.click()
    question.get_by_role("button", name="Hand over").click()
    other.wait(lambda: page.chip("controls") == "page 2; this is page 1", "the first page to see who has the controls")
    page.tab.locator("#rl-take").wait_for()
    other.wait(lambda: other.tab.evaluate(seen) is True, "handles for the page that has the controls now")
    page.wait(lambda: page.tab.evaluate(seen) is False, "none for the first page")
    context.close()
    page.wait(
        lambda: page.state.control_lock.pages == (page.state.control_lock.holder,),
        "the controls back with the first page",
    )
    page.wait(lambda: page.tab.evaluate(seen) is True, "the handles back")


def test_a_blind_click_on_a_tab_right_after_a_change_counts_and_nothing_moves(page):
    page.open_tab("Settings")
    names = ("Run", "Check", "Target")
    boxes = {name: page.tab.get_by_role("tab", name=name).bounding_box() for name in names}
    scene = page.tab.locator("canvas").first.bounding_box()
    for name, label, option in zip(
        names, ("Angles", "Theme", "Angles"), ("radians (rad)", "dark", "degrees (deg)"), strict=True
    ):
        page.open_tab("Settings")
        page.tab.get_by_label(label, exact=True).or_(
            page.tab.get_by_role("textbox", name=label, exact=True)
        ).first.click()
        page.tab.get_by_role("option", name=option, exact=True).click()
        page.tab.mouse.click(boxes[name]["x"] + boxes[name]["width"] / 2, boxes[name]["y"] + boxes[name]["height"] / 2)
        page.tab.wait_for_timeout(300)
        page.wait(lambda name=name: is_chosen(page, name), f"{name} to be open")
    page.wait(lambda: page.state.units.angle == "deg" and page.state.theme == "dark", "all changes")
    page.tab.wait_for_timeout(500)
    assert is_chosen(page, "Target")
    assert page.tab.locator("canvas").first.bounding_box() == scene
    page.bench.dispatcher.ask(SetView(name="theme", value="light"))


def is_chosen(page: BenchPage, name: str) -> bool:
    return page.tab.get_by_role("tab", name=name).get_attribute("aria-selected") == "true"


def test_units_change_everywhere_and_a_typed_number_keeps_its_sign(page):
    page.open_tab("Settings")
    change(page, "Angles", "radians (rad)", lambda: page.state.units.angle == "rad")
    page.open_tab("Jog")
    page.tab.get_by_text("Joint angles [rad]").wait_for()
    field = page.joint_field(2)
    field.fill("0.5")
    page.wait(lambda: abs(page.state.goal.q[1] - 0.5) < 1e-9, "0.5 rad")
    page.wait(lambda: field.input_value() == "0.5000", "the number in the page's own spelling")
    field.press("ControlOrMeta+a")
    field.press_sequentially("-0.25")  # viser's own number boxes make +0.25 of it.
    page.wait(lambda: abs(page.state.goal.q[1] + 0.25) < 1e-9, "-0.25 rad")
    field.fill("9")
    page.wait(lambda: any("outside -2.09 rad to 2.09 rad" in said for said in page.alerts()), "why 9 is refused")
    field.fill("10 deg")
    page.wait(lambda: abs(page.state.goal.q[1] - np.radians(10.0)) < 1e-9, "a number with its own unit")
    page.bench.dispatcher.ask(SetView(name="angle", value="deg"))
    page.tab.get_by_text("Joint angles [deg]").wait_for()
    assert page.state.units == USUAL


def test_a_page_of_a_foreign_origin_gets_no_websocket(page, chromium):
    class Foreign(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"<title>foreign</title>")

        def log_message(self, *_):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Foreign) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        context = chromium.new_context()
        tab = context.new_page()
        tab.goto(f"http://127.0.0.1:{server.server_port}/")
        script = """([port, path, protocol]) => new Promise((done) => {
          const s = protocol ? new WebSocket(`ws://127.0.0.1:${port}${path}`, [protocol]) : new WebSocket(`ws://127.0.0.1:${port}${path}`);
          s.onopen = () => done('open'); s.onerror = () => done('refused'); })"""
        answers = [
            tab.evaluate(script, [page.bench.port, path, protocol])
            for path, protocol in (("/", "viser-v1.1.1"), ("/rcilab/live", None))
        ]
        context.close()
        server.shutdown()
    assert answers == ["refused", "refused"]


_FILL = """(said) => {
  for (const [id, text] of Object.entries(said)) document.querySelector(`.rl-chip[data-id=${id}] b`).textContent = text;
  const bar = document.querySelector("#rl-chips").getBoundingClientRect();
  return [...document.querySelectorAll(".rl-chip")].map((chip) => {
    const box = chip.getBoundingClientRect(), text = chip.lastChild;
    const isSeen = box.top < bar.bottom - 1 && box.right <= bar.right + 0.5;
    return [chip.dataset.id, isSeen && text.scrollWidth <= text.clientWidth];
  });
}"""
"""Puts long texts into the bar; returns which of its entries are seen whole, as the bar is then."""


@pytest.mark.parametrize("width", [960, 1280])
@pytest.mark.parametrize(
    "said",
    [
        {"phase": "stopped by a fault", "faults": "joint_velocity_violation", "where": "192.168.100.160:8080 " * 2},
        {
            "phase": "虚拟控制器意外停止运行",
            "faults": "关节位置限制违反",
            "where": "虚拟控制器，刚体动力学（MuJoCo）" * 2,
        },
    ],
    ids=["en", "zh"],
)
def test_state_faults_and_stop_are_seen_whole_beside_long_texts(page, width, said):
    size = page.tab.viewport_size
    page.tab.set_viewport_size({"width": width, "height": 620})
    try:
        seen = dict(page.tab.evaluate(_FILL, {**said, "controls": "page 1; this is page 2", "mode": "joint_position"}))
        right = page.tab.evaluate("document.querySelector('#rl-stop').getBoundingClientRect().right")
    finally:
        page.tab.set_viewport_size(size)
    assert seen["phase"]
    assert seen["faults"]
    assert not seen["success"], "what matters least is left out"
    assert right <= width


def choose(page: BenchPage, label: str, option: str) -> None:
    """Chooses as a person does: looks whether the click hit, which a page that is being drawn anew can swallow."""
    field = page.tab.get_by_label(label, exact=True).or_(page.tab.get_by_role("textbox", name=label, exact=True)).first
    for _ in range(3):
        field.click()
        page.tab.get_by_role("option", name=option, exact=True).click()
        deadline = time.monotonic() + 3.0
        while time.monotonic() < deadline:
            if field.evaluate_all("found => found.map(one => one.value)") in ([], [option]):
                return  # Taken; nothing is found when the labels are in another language by now.
            time.sleep(0.1)
    raise AssertionError(f"{label} did not take {option}")


def change(page: BenchPage, label: str, option: str, changed) -> None:
    """Chooses, and again when the page was just being built anew and the choice went down with the old controls."""
    for _ in range(3):
        choose(page, label, option)
        deadline = time.monotonic() + 6.0
        while time.monotonic() < deadline:
            if changed():
                return
            page.tab.wait_for_timeout(100)
    raise AssertionError(f"{label} did not change to {option}")


def test_the_tabs_stay_in_sight_of_a_long_panel_and_the_next_one_begins_at_its_top(page):
    page.open_tab("Run")
    panel = page.tab.locator('[data-rl~="tabbed"] > .mantine-ScrollArea-viewport')
    page.wait(lambda: panel.evaluate("box => { box.scrollTop = 300; return box.scrollTop; }") > 100, "a long panel")
    assert page.covered_tabs() == []
    page.open_tab("Jog")
    page.wait(lambda: panel.evaluate("box => box.scrollTop") == 0, "the top of the next panel")
