"""Jogging without a browser: what a held button does to goal and robot, and all that ends it."""

from __future__ import annotations

import math
import re
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rcilab.app.control_lock import ControlLock
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import GoalActions, PoseGoal
from rcilab.app.goal.named_pose_actions import NamedPose
from rcilab.app.jog import jog_actions
from rcilab.app.jog.jog_actions import JogActions, SetJog
from rcilab.app.jog.jog_state import (
    AXES,
    FASTEST_TOOL,
    STANDING,
    Axis,
    HoldJog,
    JogState,
    PressJog,
    box_share,
    jog_velocity,
    safe_share,
)
from rcilab.app.jog.jog_step import step_pose, take_step
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.core.errors import ControlError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.units import Units
from rcilab.makers.configuration import RobotConfiguration
from rcilab.model.robot_model import load_model
from rcilab.workbench.panels.jog import margin_html
from tests.workbench.opened import opened, wait

MODEL = load_model("xMatePro7")
IDLE = SupervisorStatus(phase="idle", code="idle", powered=True, q_c=MODEL.home, q=MODEL.home, dq=np.zeros(7))
JOGGED = replace(IDLE, phase="moving", code="moving.jog")
FLOOR = np.radians([0.0, 65.0, 0.0, 60.0, 0.0, 69.0, 0.0])  # The wrist 65 mm above the floor.


class FakeSupervisor:
    """Keeps what is held and what is executed."""

    def __init__(self) -> None:
        self.held: tuple[str, np.ndarray] | None = None
        self.motion = None
        self.ticket = SimpleNamespace(done=False, error=None)

    def jog(self, kind, values, *, continues=None, stops=None):
        self.held = kind, np.array(values)
        return self.ticket

    def release_jog(self) -> None:
        self.held = None

    def execute(self, motion, certificate, *, stops=None):
        self.motion = motion
        return self.ticket


class FakeSession:
    """Stands for the robot side."""

    def __init__(self) -> None:
        self.shown, self.fake = IDLE, FakeSupervisor()

    def status(self) -> SupervisorStatus:
        return self.shown

    def robot(self) -> FakeSupervisor:
        return self.fake


@pytest.fixture
def store() -> Store:
    store = Store(UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home)))
    store.update(control_lock=ControlLock((1, 2), 1))
    return store


@pytest.fixture
def session() -> FakeSession:
    return FakeSession()


@pytest.fixture
def jog(store, session, monkeypatch) -> JogActions:
    monkeypatch.setattr(jog_actions, "HOLD_TIMEOUT", 30.0)  # No test hangs on how busy the machine is.
    jog = JogActions(store, session, GoalActions(store, session))
    jog.tick(0.03)
    return jog


@pytest.fixture
def robot(jog, session):
    """The robot under the buttons; returns what is held of it."""
    jog.set_jog(SetJog(page=1, robot=True))
    return session.fake


def hold(jog, axis="joint.1", sign=1, page=1) -> None:
    jog.hold(HoldJog(page=page, axis=axis, sign=sign))


def said(store) -> str | None:
    return None if store.state.jog.sentence is None else store.state.jog.sentence.code


def test_no_jog_moves_the_tool_faster_than_the_reduced_speed():
    for axis in (*(f"joint.{joint}" for joint in range(7)), *AXES):
        kind, values = jog_velocity(MODEL, MODEL.home, JogState(speed=1.0), Axis(axis, -1))
        twist = MODEL.jacobian(MODEL.home) @ values if kind == "joint" else values
        assert np.linalg.norm(twist[:3]) <= FASTEST_TOOL * (1.0 + 1e-9)
        assert np.flatnonzero(values).size == 1


def test_a_step_goes_along_and_about_the_axes_of_base_or_tool():
    T = Pose.from_rpy((0.4, 0.1, 0.5), (0.3, -0.4, 1.2))
    for index, name in enumerate(AXES):
        for frame in ("base", "tool"):
            moved = step_pose(T, Axis(name, -1), 5.0, frame)
            way, R = moved.position - T.position, moved.rotation @ T.rotation.T
            way, R = (T.rotation.T @ way, T.rotation.T @ moved.rotation) if frame == "tool" else (way, R)
            wanted = np.zeros(6)
            wanted[index] = -0.005 if index < 3 else -math.radians(5.0)
            assert way == pytest.approx(wanted[:3], abs=1e-12)
            assert pytest.approx(Pose.from_rpy((0, 0, 0), wanted[3:]).rotation, abs=1e-12) == R


def test_a_step_to_a_limit_stops_there_and_says_which():
    near = np.array(MODEL.home)
    near[5] = MODEL.limits.joint.upper[5] - math.radians(2.0)
    result = take_step(MODEL, near, JogState(step=5.0), Axis("joint.5", 1))
    assert result.q[5] == pytest.approx(MODEL.limits.joint.upper[5], abs=2e-4)
    assert (result.sentence.code, result.sentence.values["joint"]) == ("jog.at_upper", 6)
    again = take_step(MODEL, result.q, JogState(step=5.0), Axis("joint.5", 1))
    assert (again.q, again.sentence.code) == (None, "jog.at_upper")
    back = take_step(MODEL, result.q, JogState(step=5.0), Axis("joint.5", -1))
    assert back.sentence is None


def test_a_held_button_moves_the_goal_as_the_robot_would_go_and_undo_brings_it_back(jog, store, session):
    hold(jog, "joint.0", -1)
    for _ in range(10):
        jog.tick(0.03)
    held = store.state.goal.q[0]
    assert held < -0.01
    jog.press(PressJog(page=1, axis="joint.0", sign=-1))
    for _ in range(10):
        jog.tick(0.03)
    rest = store.state.goal.q[0]
    jog.tick(0.03)
    assert store.state.goal.q[0] == rest < held
    assert store.state.plan is not None
    GoalActions(store, session).pose_goal(PoseGoal(name="undo"))
    assert np.array_equal(store.state.goal.q, MODEL.home)
    assert session.fake.held is None


def test_a_goal_that_is_held_against_a_limit_stands_there_and_says_so(jog, store):
    jog.set_jog(SetJog(speed=1.0))
    hold(jog, "joint.5")
    for _ in range(50):
        hold(jog, "joint.5")
        jog.tick(0.1)
    assert store.state.goal.q[5] == pytest.approx(MODEL.limits.joint.upper[5], abs=2e-4)
    assert said(store) == "jog.at_upper"


@pytest.mark.parametrize(("axis", "sign"), [("joint.7", 1), ("joint.-1", 1), ("w", 1), ("x", 0), ("x", 9), ("", 1)])
def test_what_is_no_button_moves_nothing(jog, store, robot, axis, sign):
    hold(jog, axis, sign)
    jog.press(PressJog(page=1, axis=axis, sign=sign))
    assert robot.held is None
    assert np.array_equal(store.state.goal.q, MODEL.home)


@pytest.mark.parametrize(
    ("request_", "field", "value"),
    [
        (SetJog(speed=math.nan), "speed", 0.3),
        (SetJog(speed=7.0), "speed", 1.0),
        (SetJog(speed=-1.0), "speed", 0.01),
        (SetJog(step=3.3), "step", 0.0),
        (SetJog(step=math.nan), "step", 0.0),
        (SetJog(frame="world"), "frame", "base"),
    ],
)
def test_settings_that_do_not_exist_are_ignored(jog, store, request_, field, value):
    jog.set_jog(request_)
    assert getattr(store.state.jog, field) == value


def test_a_held_button_jogs_the_robot_and_its_release_ends_that_at_once(jog, robot):
    hold(jog, "joint.1", -1)
    kind, values = robot.held
    assert (kind, np.flatnonzero(values).tolist()) == ("joint", [1])
    assert values[1] < 0.0
    jog.press(PressJog(page=1, axis="joint.1", sign=-1))
    assert robot.held is None
    jog.set_jog(SetJog(frame="tool"))
    hold(jog, "z", 1)
    assert robot.held[0] == "tool"


@pytest.mark.parametrize(
    ("name", "joint", "units", "shown"),
    [
        ("FR3", 0, Units(), "-157…157|157° left"),  # 157.569
        ("FR3", 3, Units(), "-174…-9|◆ 0.0° left"),  # -174.6 to -8.354
        ("xArm7", 3, Units(), "-11…225|11° left"),
        ("FR3", 0, Units(angle="rad"), "-2.75…2.75|2.75 left"),
    ],
)
def test_limits_and_the_way_to_them_are_rounded_inwards(name, joint, units, shown):
    limits = load_model(name).limits.joint
    html = margin_html(0.0, float(limits.lower[joint]), float(limits.upper[joint]), Text("en", units))
    assert re.sub(r"\|+", "|", re.sub(r"<[^>]*>", "|", html)).strip("|") == shown


def test_silence_ends_it(jog, robot, monkeypatch):
    hold(jog)
    jog.tick(0.03)
    assert robot.held is not None
    monkeypatch.setattr(jog_actions, "HOLD_TIMEOUT", 0.0)
    jog.tick(0.03)
    assert robot.held is None


@pytest.mark.parametrize("lock", [ControlLock((1, 2), 2), ControlLock((2,), 2), ControlLock()])
def test_who_loses_the_controls_or_goes_away_lets_go_and_the_switch_is_off_again(jog, store, robot, lock):
    hold(jog)
    store.update(control_lock=lock)
    jog.tick(0.03)
    assert robot.held is None
    assert not store.state.jog.robot


def test_another_robot_is_not_under_the_buttons(jog, store, robot):
    store.update(target="rci://192.168.0.160:1337")
    jog.tick(0.03)
    assert not store.state.jog.robot


def test_a_foreign_robot_is_jogged_only_after_a_second_yes(jog, store, session):
    store.update(target="rci://192.168.0.160:1337")
    jog.tick(0.03)
    jog.set_jog(SetJog(robot=True, agreed=True))  # A yes to a question that nobody has seen.
    assert (store.state.jog.robot, store.state.jog.asked) == (False, True)
    hold(jog)
    assert session.fake.held is None
    jog.set_jog(SetJog(robot=True, agreed=True))
    assert (store.state.jog.robot, store.state.jog.asked) == (True, False)
    hold(jog, "joint.2")
    assert session.fake.held is not None


@pytest.mark.parametrize(
    ("status", "code"),
    [
        (replace(IDLE, powered=False), "ready.power"),
        (replace(IDLE, phase="moving", code="moving"), "ready.moving"),
        (replace(IDLE, phase="moving", code="moving.guided"), "ready.guided"),
        (replace(IDLE, phase="fault", code="fault"), "ready.fault"),
        (SupervisorStatus(phase="starting", code="starting"), "ready.starting"),
    ],
)
@pytest.mark.parametrize("step", [0.0, 1.0])
def test_a_robot_that_cannot_be_jogged_says_why(jog, store, session, robot, status, code, step):
    session.shown = status
    jog.set_jog(SetJog(step=step))
    hold(jog)
    jog.press(PressJog(page=1, axis="joint.1", sign=1)) if step else None
    assert said(store) == code
    session.shown = IDLE
    hold(jog)  # Still held: it stays refused until it is pressed anew.
    assert robot.held is None
    assert robot.motion is None


def test_a_jog_that_was_stopped_stays_stopped_though_the_button_is_still_held(jog, store, session, robot):
    hold(jog)
    session.shown = JOGGED
    jog.tick(0.03)
    robot.ticket.done, robot.ticket.error, robot.held = True, ControlError("stopped"), None
    session.shown = replace(IDLE, code="idle.stopped")
    hold(jog)
    jog.tick(0.03)
    hold(jog)
    assert robot.held is None
    assert said(store) == "jog.stopped"
    robot.ticket = SimpleNamespace(done=False, error=None)
    jog.press(PressJog(page=1, axis="joint.1", sign=1))
    hold(jog)
    assert robot.held is not None


def test_what_the_control_process_refuses_is_told(jog, store, robot, monkeypatch):
    def refuse(*_, **__):
        raise UsageError("nobody is at the controls")

    monkeypatch.setattr(robot, "jog", refuse)
    hold(jog)
    assert said(store) == "notice.error"


def test_the_robot_slows_down_before_it_touches_the_floor_and_goes_back_freely(jog, store, session, robot):
    kind, down = jog_velocity(MODEL, FLOOR, JogState(speed=1.0), Axis("joint.1", 1))
    share, links = safe_share(MODEL, FLOOR, kind, down)
    assert 0.02 < share < 0.7
    assert -1 in links
    for frame in ("base", "tool"):
        twist = MODEL.jacobian(FLOOR) @ down
        R = MODEL.forward(FLOOR).rotation if frame == "tool" else np.eye(3)
        inside = np.concatenate([R.T @ twist[:3], R.T @ twist[3:]])
        assert safe_share(MODEL, FLOOR, frame, inside)[0] < 1.0
    assert safe_share(MODEL, FLOOR, kind, -down)[0] == 1.0
    low = np.array(FLOOR)
    while MODEL.clearance(low).distance > 0.02:
        low[1] += 1e-3
    session.shown = replace(IDLE, q_c=low)
    hold(jog, "joint.1", 1)
    assert (robot.held, said(store)) == (None, "jog.near")
    hold(jog, "joint.1", -1)
    assert robot.held is not None
    assert said(store) is None


def test_a_step_that_would_touch_the_floor_is_refused(jog, store, session, robot):
    low = np.array(FLOOR)
    while MODEL.clearance(low).distance > 0.005:
        low[1] += 1e-3
    session.shown = replace(IDLE, q_c=low)
    jog.set_jog(SetJog(step=10.0))
    jog.press(PressJog(page=1, axis="joint.1", sign=1))
    assert said(store) == "jog.unsafe"
    assert robot.motion is None


def test_a_step_of_the_robot_is_a_judged_motion_that_ends_where_it_shall(jog, robot):
    jog.set_jog(SetJog(step=1.0))
    hold(jog, "z", -1)
    assert robot.held is None
    jog.press(PressJog(page=1, axis="z", sign=-1))
    way = MODEL.forward(robot.motion.goal).position - MODEL.forward(MODEL.home).position
    assert way == pytest.approx([0.0, 0.0, -0.001], abs=1e-7)


def test_with_the_real_controller_the_goal_follows_the_arm_and_undo_brings_it_back(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    with opened() as bench:
        ask, store, status = bench.dispatcher.ask, bench.store, bench.session.status
        wait(lambda: store.state.plan is None and np.array_equal(store.state.goal.q, status().q_c), "the first look")
        start = np.array(store.state.goal.q)
        ask(SetJog(robot=True, speed=0.5))

        def moved() -> bool:
            ask(HoldJog(axis="joint.3", sign=-1))
            time.sleep(0.05)
            return status().q_c[3] < start[3] - 0.05

        wait(moved, "the arm to move")
        ask(PressJog(axis="joint.3", sign=-1))
        wait(lambda: status().code == "idle.jogged", "the arm to rest")
        wait(lambda: np.array_equal(store.state.goal.q, status().q_c), "the goal where the arm is")
        wait(lambda: getattr(store.state.no_plan, "code", "") == "plan.here", "the plan of nothing")
        assert np.delete(status().q_c, 3) == pytest.approx(np.delete(start, 3), abs=1e-12)
        ask(PoseGoal(name="undo"))
        wait(lambda: np.array_equal(store.state.goal.q, start) and store.state.plan is not None, "the goal of before")
        ask(NamedPose(what="store", name="start"))
        wait(lambda: store.state.jog.poses == ("start",), "the pose to be stored")
        ask(PoseGoal(name="zero"))
        ask(NamedPose(what="recall", name="start"))
        wait(lambda: np.allclose(store.state.goal.q, start, atol=1e-8), "the pose to come back")
        for what, name, code in (("store", " ", "poses.no_name"), ("store", "start", "poses.taken")):
            ask(NamedPose(what=what, name=name))
            wait(lambda code=code: store.state.notice.text.code == code, code)
        ask(NamedPose(what="delete", name="start"))
        wait(lambda: store.state.jog.poses == (), "the pose to be gone")
        (tmp_path / "rcilab" / "poses.json").write_text("{")
        ask(NamedPose(what="store", name="start"))
        wait(lambda: store.state.notice.text.code == "poses.file", "the bad file to be told")
        assert (tmp_path / "rcilab" / "poses.json").read_text() == "{"


def test_a_step_that_would_swing_the_arm_is_refused(store):
    model = load_model("xMate3")
    q = np.radians([-134.2, -43.0, 90.4, 21.6, -83.6, 44.7])
    result = take_step(model, q, JogState(step=1.0, frame="base"), Axis("pitch", 1))
    if result.q is None:
        assert result.sentence.code in ("jog.far", "jog.no_way")
    else:
        assert np.abs(result.q - q).max() < np.radians(20.0)


@pytest.mark.parametrize("axis", ["joint.0", "joint.1", "x", "yaw"])
def test_no_step_moves_the_tool_faster_than_the_reduced_speed(jog, store, session, robot, axis):
    stretched = np.radians([0.0, 60.0, 0.0, 20.0, 0.0, 60.0, 0.0])
    session.shown = replace(IDLE, q_c=stretched, q=stretched)
    jog.set_jog(SetJog(step=10.0, speed=1.0))
    jog.press(PressJog(page=1, axis=axis, sign=1))
    motion = robot.motion
    assert motion is not None, said(store)
    tool = MODEL.forward_path(motion.q)[:, :3, 3]
    speed = np.linalg.norm(np.diff(tool, axis=0), axis=1).max() * 1000.0
    assert speed < 1.02 * FASTEST_TOOL


def test_a_tool_that_is_jogged_slows_down_before_a_face_of_the_safety_box_and_goes_back_freely():
    T = MODEL.forward(MODEL.home)
    box = SafetyBox(size=(0.1, 1.0, 1.0), T_base_box=Pose(T.position))
    twist = np.array([0.25, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert box_share(MODEL, MODEL.home, "base", twist, box) == pytest.approx((0.05 - 1e-3) / (0.25 * 0.5), rel=0.05)
    near = SafetyBox(size=(0.1, 1.0, 1.0), T_base_box=Pose(T.position - [0.0495, 0.0, 0.0]))
    assert box_share(MODEL, MODEL.home, "base", twist, near) < STANDING
    assert box_share(MODEL, MODEL.home, "base", -twist, near) == 1.0
    off = SafetyBox(size=near.size, T_base_box=near.T_base_box, active=False)
    assert box_share(MODEL, MODEL.home, "base", twist, off) == 1.0


def test_a_robot_that_was_not_told_its_set_up_is_neither_jogged_nor_stepped(jog, store, session, robot):
    wanted = store.state.setup.wanted.updated(RobotConfiguration(tool=Pose([0.0, 0.0, 0.1])))
    store.update(
        target="rci://127.0.0.9:1337", setup=replace(store.state.setup, wanted=wanted, touched=frozenset({"tool"}))
    )
    hold(jog)
    assert said(store) == "ready.setup_unsent"
    assert robot.held is None


def test_after_stop_a_gap_in_what_is_heard_begins_no_new_jog(jog, store, session, robot, monkeypatch):
    monkeypatch.setattr(jog_actions, "HOLD_TIMEOUT", 0.0)
    hold(jog)
    robot.ticket.done, robot.ticket.error, robot.held = True, ControlError("stopped"), None
    session.shown = replace(IDLE, code="idle.stopped")
    jog.tick(0.03)
    jog.tick(0.03)
    hold(jog)
    assert robot.held is None
