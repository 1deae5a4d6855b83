"""What the library's errors and states are called on the page: in both languages, without a call of Python."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from rcilab.app.control_lock import ControlLock
from rcilab.app.planning import Plan, make_plan
from rcilab.app.robot_connection import RobotConnection
from rcilab.app.run.readiness import obstacle
from rcilab.app.run.run_actions import RunActions
from rcilab.app.status_text import (
    StartingError,
    describe_incident,
    describe_status,
    describe_success,
    explain_error,
    phase_code,
)
from rcilab.app.store import Store
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.control_process.status import MESSAGES, Incident
from rcilab.core.errors import CertificateError, ConnectionLostError, ControlError, InvalidValueError, RcilabError
from rcilab.core.state import RobotMode
from rcilab.makers.rokae.driver.address import parse_address
from rcilab.makers.rokae.faults import Fault
from rcilab.sim.api import WorldStatus
from rcilab.workbench.panels.health import health_html
from rcilab.workbench.panels.jog import note_html
from rcilab.workbench.panels.status import status_values

CALLS = ("()", "load_model", "error.run", "restart", "reconnect", "recover leads", "COMMAND_")


def status(**facts) -> SupervisorStatus:
    return SupervisorStatus(**{"phase": "idle", "code": "idle", "message": "", **facts})


def address_error() -> RcilabError:
    try:
        parse_address("http://robot")
    except InvalidValueError as error:
        return error
    raise AssertionError


@pytest.mark.parametrize(
    "error",
    [
        ControlError("recover() clears the fault; error.run holds the motion", [Fault.COLLISION]),
        ControlError("power_on()", [Fault.INSTABILITY_DETECTION]).coded("safety_stop", status="estop"),
        CertificateError("plan again from robot.state.q_c with plan_joint()"),
        ConnectionLostError("rci://127.0.0.1:9 went silent; look whether the cable is in"),
        StartingError("the control process is still starting"),
        address_error(),
    ],
)
def test_errors_say_what_to_press_and_name_no_call(error):
    for target in ("virtual", "rci://192.168.0.160:1337"):
        where = status(phase="lost", code="lost.silent", target=target)
        english, chinese = (Text(language).render(explain_error(error, where)) for language in ("en", "zh"))
        assert not any(call in english for call in CALLS)
        assert str(error) not in chinese
        assert ("cable" in english) == (target != "virtual" and isinstance(error, ConnectionLostError))


def test_an_emergency_stop_in_mid_motion_is_named_and_no_error_bit():
    error = ControlError("power_on()", [Fault.INSTABILITY_DETECTION]).coded("safety_stop", status="estop")
    said = Text("en").render(explain_error(error, status()))
    assert "an emergency stop is pressed: release it first" in said
    assert "Instability" not in said


@pytest.mark.parametrize("code", [code for code in MESSAGES if code.startswith(("crashed", "lost", "fault"))])
def test_states_and_incidents_are_told_from_the_catalogues(code):
    where = status(phase=code.partition(".")[0], code=code, message=MESSAGES[code], target="rci://192.168.0.160:1337")
    for said in (describe_status(where), describe_incident(code, MESSAGES[code], where)):
        for language in ("en", "zh"):
            sentence = Text(language).render(said)
            assert MESSAGES[code] not in sentence
            assert not any(call in sentence for call in CALLS)


@pytest.mark.parametrize(
    ("code", "english", "chinese"),
    [
        ("crashed.controller", "virtual controller stopped unexpectedly", "虚拟控制器意外退出"),
        ("crashed.worker", "control process stopped unexpectedly", "控制进程意外退出"),
    ],
)
def test_the_chip_names_what_died(code, english, chinese):
    died = status(phase="crashed", code=code)
    assert (Text("en")(phase_code(died)), Text("zh")(phase_code(died))) == (english, chinese)


def test_a_pressed_stop_is_not_called_ready():
    pressed = status(robot_mode=RobotMode.USER_STOPPED, powered=False)
    assert Text("en")(phase_code(pressed)) == "stop pressed, power off"
    assert Text("zh")(phase_code(pressed)) == "已按下停止，未上电"
    assert phase_code(status(powered=False)) == "phase.unpowered"
    assert phase_code(status(powered=True)) == "phase.idle"


def test_a_request_that_failed_with_its_controller_does_not_ask_for_a_cable():
    gone = status(
        incident=Incident(number=1, code="crashed.controller", message=""), phase="connecting", code="connecting"
    )
    said = explain_error(ConnectionLostError("look whether the cable is in"), gone)
    assert said.code == "incident.crashed.controller"


@pytest.mark.parametrize(
    ("phase", "is_restarted", "english"),
    [
        ("starting", True, "it is being restarted"),  # It has no process id yet.
        ("crashed", False, "press Start it again"),
        ("closed", False, "choose the destination again"),  # Where nothing is open there is no such button.
    ],
)
def test_what_to_do_about_a_process_that_died_can_be_done(phase, is_restarted, english):
    incident = Incident(number=1, code="crashed.controller", message="", is_restarted=is_restarted)
    said = describe_incident(incident.code, incident.message, status(phase=phase, code=phase, incident=incident))
    assert english in Text("en").render(said)


class Power:
    """A robot side whose control process comes late and refuses power once."""

    is_ready = True

    def __init__(self) -> None:
        self.is_there, self.asked = False, 0
        self.ticket = SimpleNamespace(done=True, error=RcilabError("busy"))

    def status(self) -> SupervisorStatus:
        return status(powered=False)

    def robot(self):
        if not self.is_there:
            raise StartingError("the control process is still starting")
        return self

    def power_on(self):
        self.asked += 1
        return self.ticket

    def drain(self):
        raise RcilabError("nothing recorded")


def test_the_virtual_arm_is_switched_on_however_late_its_control_process_comes(monkeypatch):
    store, side, now = Store(initial_state()), Power(), [100.0]
    monkeypatch.setattr("rcilab.app.run.run_actions.time.monotonic", lambda: now[0])
    robot = RunActions(store, cast(RobotConnection, side))
    robot.watch()
    assert (store.state.notice, side.asked) == (None, 0), "nobody asked for anything"
    side.is_there = True
    robot.watch()
    assert side.asked == 1
    now[0] += 10.0
    robot.watch()
    assert side.asked == 2, "it was refused, so it is asked for again"
    side.ticket.error = None
    now[0] += 10.0
    robot.watch()
    now[0] += 10.0
    robot.watch()
    assert side.asked == 2, "it has succeeded: a person may switch it off now"


def test_a_held_motion_has_its_own_word_and_the_cursor_stands_where_it_is_held():
    state = initial_state()
    plan = make_plan(state.model, state.model.home, state.model.home + 0.1, 0.5, "jerk_limited")
    assert isinstance(plan, Plan)
    state = replace(state, plan=plan, playhead=1.0)
    held = status(phase="moving", code="moving.held", motion_time=1.9, motion_plan_time=0.25, motion_duration=9.0)
    for language, word in (("en", "paused"), ("zh", "已暂停")):
        bar = status_values(state, held, Text(language), 2.0)
        chip = next(chip for chip in bar["chips"] if chip["id"] == "phase")
        assert (chip["value"], chip["tone"], chip["hint"]) == (word, "warn", word)
        assert bar["cursor"] == {"share": 0.125}, "the place in the plan, not how long it took to come there"


def test_health_says_how_many_cycles_in_a_row_had_no_command():
    world = WorldStatus(model="xMatePro7", plant="ideal", cycle=9, phase="move", lost=30, lost_in_row=12)
    state = initial_state()
    spoiled = replace(state, world=replace(state.world, status=world))
    row = "<th>Cycles in a row without a command (maximum)</th><td>12<br>"
    assert row in health_html(spoiled, status(), Text("en"))
    assert "<td>—<br>" in health_html(state, status(), Text("en")), "another controller does not tell"


def test_the_bar_and_the_reason_on_run_speak_of_the_same_death():
    state, died = initial_state(), status(phase="crashed", code="crashed.controller")
    reason = obstacle(state, died)
    assert reason is not None
    bar = status_values(state, died, Text("en"), 1.0)
    assert any(chip["value"] == "virtual controller stopped unexpectedly" for chip in bar["chips"])
    assert Text("en").render(reason).startswith("The virtual controller stopped unexpectedly")


@pytest.mark.parametrize(
    ("watched", "pages", "label"), [("", (1,), True), ("rci://it", (1,), False), ("rci://it", (1, 2), True)]
)
def test_a_single_page_that_watches_is_never_offered_the_controls(watched: str, pages: tuple[int, ...], label: bool):
    """Also while it is silent on a busy machine, so that no page has them."""
    state = replace(initial_state(), watched=watched, control_lock=ControlLock(pages))
    assert bool(status_values(state, status(), Text("en"), 1.0)["take"]) == label


@pytest.mark.parametrize(
    ("language", "holder", "note"),
    [("en", "its client", "this page moves no robot"), ("zh", "其客户端", "本页不驱动任何机器人")],
)
def test_a_page_that_watches_does_not_claim_to_move_the_arm(language: str, holder: str, note: str):
    state = replace(initial_state(), watched="rci://127.0.0.2:1337", control_lock=ControlLock((1,), 1))
    bar = status_values(state, status(), Text(language), 1.0)
    assert bar["stopHint"] == Text(language)("watch.stop")
    chips = {chip["id"]: chip for chip in bar["chips"]}
    assert chips["controls"]["value"] == holder
    assert "of" not in chips["controls"]
    assert note in note_html(state, Text(language))


def test_the_share_of_commands_in_time_is_that_of_a_motion_and_marked_as_past_after_it():
    state, facts = initial_state(), {"success_rate": 0.62, "rate_hz": 1000.0, "motion_time": 1.5}
    for phase, bar, table in (("moving", "62 %", "62.0 %<"), ("idle", "—", "62.0 % in the last motion<")):
        now = status(phase=phase, code=phase, **facts)
        chips = {chip["id"]: chip["value"] for chip in status_values(state, now, Text("en"), 1.0)["chips"]}
        assert chips["success"] == bar
        assert f"<td>{table}" in health_html(state, now, Text("en"))
    almost = status(phase="idle", code="idle", success_rate=0.9996, motion_time=1.5)
    assert Text("en").render(describe_success(almost)) == "99.9 % in the last motion", "100.0 % is every command"
    rested = status(success_rate=1.0)
    assert Text("en").render(describe_success(rested)) == "—", "no motion yet"


def test_the_bar_has_host_and_port_of_an_address_with_all_of_it_in_the_hint():
    address = "realman://127.0.0.2:8080?udp_port=42873"
    state = replace(initial_state(), watched=address, target=address)
    for language in ("en", "zh"):
        chips = {chip["id"]: chip for chip in status_values(state, status(), Text(language), 1.0)["chips"]}
        assert list(chips)[:2] == ["phase", "faults"], "what must not be left out comes first"
        assert chips["where"]["value"] == "127.0.0.2:8080"
        assert chips["where"]["hint"].endswith(address)
    chips = {chip["id"]: chip["value"] for chip in status_values(initial_state(), status(), Text("en"), 1.0)["chips"]}
    assert chips["where"] == "virtual controller, ideal arm"


def initial_state():
    from rcilab.app.goal.goal import goal_at
    from rcilab.app.store import UiState
    from rcilab.model.robot_model import load_model

    model = load_model("xMatePro7")
    return UiState(model=model, goal=goal_at(model, model.home))
