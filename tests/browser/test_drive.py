"""Drive the arm as a person: an impedance mode, a pause, the network lab, another destination and back."""

from __future__ import annotations

from browser.test_settings import choose
from rcilab.app.goal.goal_actions import SetSpeed
from rcilab.app.run.mode_actions import SetDrive


def test_a_soft_motion_is_held_gone_on_with_and_a_spoiled_network_is_noticed(heard):
    page = heard
    page.bench.dispatcher.ask(SetSpeed(speed=0.02))
    page.plan_to(1, -50.0 if page.status.q_c[0] > 0 else 50.0)
    page.open_tab("Run")
    page.unfold("Mode")
    choose(page, "Control mode", "joint impedance")
    page.wait(lambda: page.state.drive.mode == "joint_impedance", "the mode")
    field = page.tab.get_by_text("Joint stiffness [").first
    assert "N·m/rad" in field.inner_text()
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: page.status.code == "moving" and (page.status.motion_time or 0.0) > 0.1, "the arm on its way")
    page.button("Pause").click()
    page.wait(lambda: page.status.code == "moving.held", "the pause")
    page.wait(lambda: "Paused at" in page.tab.get_by_role("status").first.inner_text(), "the page to say so")
    assert page.status.code == "moving.held", page.status
    page.button("Resume").dispatch_event("click")
    page.wait(lambda: page.status.code == "moving", "the way on")
    place = page.status.motion_plan_time
    page.wait(lambda: page.status.motion_plan_time > place + 0.1, "the arm on its way again")
    page.button("Stop").click()
    page.wait(lambda: page.status.phase == "idle", "rest")
    page.unfold("Network lab")
    page.button("Pull the cable").click()
    page.wait(lambda: page.status.phase == "lost", "the client to notice")
    page.button("Plug the cable in").click()
    page.wait(lambda: page.status.phase == "idle", "states again")
    page.tab.get_by_text("Network lab").first.click()
    page.bench.dispatcher.ask(SetDrive(mode="joint_position"))


def test_the_question_about_an_address_goes_when_another_one_is_typed(page):
    page.open_tab("Run")
    choose(page, "Destination", "a controller at an address")
    field = page.tab.locator("label:visible", has_text="Address").locator(
        "xpath=ancestor::div[contains(@class,'Flex-root')][1]"
    )
    box = field.locator("input").first
    box.fill("127.0.0.1:9")
    page.button("Connect").click()
    page.button("Yes, connect").wait_for()
    box.fill("127.0.0.1:99")
    page.wait(lambda: page.button("Yes, connect").count() == 0, "the question to go")
    assert page.state.typed_address == ""
    box.fill("999.1.1.1")
    page.button("Connect").click()
    page.wait(lambda: "999.1.1.1" in page.toast(), "the refusal")
    assert page.button("Yes, connect").count() == 0
    assert page.state.target == "virtual"
    choose(page, "Destination", "virtual controller, ideal arm")
    page.wait(lambda: page.status.phase == "idle" and bool(page.status.powered), "the virtual controller", 30.0)
