"""Pushing and guiding without a browser: what is asked for becomes a force on the arm only while it is held."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rcilab.app.control_lock import ControlLock
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import MoveJoint, PlanGoal, SetSpeed
from rcilab.app.run import push_actions
from rcilab.app.run.active_force import SPRING, STRONGEST, TOOL, place_of, spring_force
from rcilab.app.run.mode_actions import SetDrive
from rcilab.app.run.push_actions import DragLink, HoldPush, PushActions, SetPush
from rcilab.app.run.run_actions import ChooseRobot, RobotCommand, RunActions
from rcilab.app.store import Store, UiState
from rcilab.control_process import SupervisorStatus
from rcilab.core.errors import UsageError
from rcilab.model.robot_model import load_model
from rcilab.workbench.app import Workbench
from tests.workbench.opened import opened, told, wait

MODEL = load_model("xMatePro7")
OWN = SupervisorStatus(phase="idle", powered=True, target="virtual", world_address="127.0.0.1:1", q=MODEL.home)


class FakePush:
    """Stands for `HeldPush`: keeps what is held."""

    def __init__(self, world) -> None:
        self.held = None
        self.error = None

    def hold(self, wrench, link=None, point=None) -> None:
        self.held = np.array(wrench), link, np.array(point)

    def release(self) -> None:
        self.held = None

    def pop_error(self):
        error, self.error = self.error, None
        return error

    def close(self) -> None:
        self.held = None


class FakeSession:
    """Stands for the robot side."""

    shown = OWN
    is_ready = True

    def status(self) -> SupervisorStatus:
        return self.shown

    def robot(self):
        raise UsageError("there is none")


@pytest.fixture
def store():
    store = Store(UiState(model=MODEL, plant="mujoco", goal=goal_at(MODEL, MODEL.home)))
    store.update(control_lock=ControlLock((1, 2), 1))
    return store


@pytest.fixture
def session():
    return FakeSession()


@pytest.fixture
def actions(store, session, monkeypatch):
    monkeypatch.setattr(push_actions, "ExternalForceHold", FakePush)
    monkeypatch.setattr(push_actions, "HOLD_TIMEOUT", 0.05)
    actions = PushActions(store, session)
    tick(actions)
    return actions


def held(actions):
    return actions._push.held


def tick(actions):
    actions.tick(actions._connection.status())


def grab(actions, link: int, page: int = 1):
    """Takes hold of the link's origin and pulls it 0.1 m along y; returns where that is."""
    start = place_of(MODEL, MODEL.home, link, np.zeros(3))
    hand = start + (0.0, 0.1, 0.0)
    actions.pull(DragLink(page=page, link=link, grabbed=tuple(start), hand=tuple(hand), phase="start"))
    return start


def test_a_held_button_pushes_where_and_as_hard_as_is_set_and_silence_ends_it(actions, store):
    actions.set_push(SetPush(link=4, direction="-z", newtons=33.0))
    actions.hold(HoldPush(page=1))
    tick(actions)
    wrench, link, point = held(actions)
    assert wrench == pytest.approx([0.0, 0.0, -33.0, 0.0, 0.0, 0.0])
    assert (link, point.tolist()) == (4, [0.0, 0.0, 0.0])
    assert store.state.push.acting.start == pytest.approx(place_of(MODEL, MODEL.home, 4, np.zeros(3)))
    time.sleep(0.06)
    tick(actions)
    assert held(actions) is None
    assert store.state.push.acting is None


@pytest.mark.parametrize(("newtons", "taken"), [(77.0, STRONGEST), (-5.0, 0.0), (math.nan, 20.0), (math.inf, 20.0)])
def test_a_force_beyond_its_range_is_taken_at_the_bound_and_no_number_is_ignored(actions, store, newtons, taken):
    actions.set_push(SetPush(newtons=newtons, link=9, direction="up", guiding_kind="joint.sideways"))
    push = store.state.push
    assert (push.newtons, push.link, push.direction, push.guiding_kind) == (taken, 0, "+y", "joint.free")


def test_the_mouse_pulls_with_a_spring_that_goes_along_with_the_arm(actions, session):
    start = grab(actions, 5)
    tick(actions)
    wrench, link, point = held(actions)
    assert link == 5
    assert wrench[:3] == pytest.approx([0.0, 0.1 * SPRING, 0.0])
    assert point == pytest.approx(np.zeros(3), abs=1e-12)
    q = MODEL.home + np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    session.shown = replace(OWN, q=q)
    tick(actions)
    moved = place_of(MODEL, q, 5, np.zeros(3))
    assert held(actions)[0][:3] == pytest.approx(SPRING * (start + (0.0, 0.1, 0.0) - moved))
    actions.pull(DragLink(page=1, link=5, grabbed=(0, 0, 0), hand=(0, 0, 0), phase="end"))
    tick(actions)
    assert held(actions) is None


def test_a_spring_pulls_no_harder_than_a_hand():
    assert np.linalg.norm(spring_force(np.zeros(3), np.array([3.0, 4.0, 0.0]))) == pytest.approx(STRONGEST)


@pytest.mark.parametrize("lock", [ControlLock((1, 2), 2), ControlLock((2,), 2), ControlLock()])
def test_who_loses_the_controls_or_goes_away_lets_go(actions, store, lock):
    grab(actions, 3)
    actions.hold(HoldPush(page=1))
    tick(actions)
    assert held(actions) is not None
    store.update(control_lock=lock)
    tick(actions)
    assert held(actions) is None


def test_numbers_that_are_none_take_hold_of_nothing(actions):
    for link, hand in ((3, (math.nan, 0.0, 0.0)), (8, (0.0, 0.0, 0.0)), (0, (0.0, 0.0, 0.0))):
        actions.pull(DragLink(page=1, link=link, grabbed=(0, 0, 0), hand=hand, phase="start"))
        tick(actions)
        assert held(actions) is None


def test_in_the_ideal_plant_a_drag_turns_the_camera_unless_the_arm_is_guided(actions, store, session):
    store.update(plant="ideal")
    grab(actions, 3)
    tick(actions)
    assert held(actions) is None
    session.shown = replace(OWN, phase="moving", code="moving.guided")
    grab(actions, 3)
    tick(actions)
    assert held(actions) is not None


def test_an_arm_at_an_address_cannot_be_pushed_and_that_is_said(actions, store, session):
    session.shown = replace(OWN, target="rci://192.168.0.160:1337", world_address=None)
    tick(actions)
    actions.hold(HoldPush(page=1))
    tick(actions)
    assert store.state.notice.text.code == "push.no_world"
    assert store.state.push.acting is None


def test_guiding_that_ends_because_nobody_is_there_is_told(store, session):
    robot = RunActions(store, session)
    for phase, code in (("moving", "moving.guided"), ("stopping", "stopping"), ("idle", "idle.operator")):
        session.shown = replace(OWN, phase=phase, code=code)
        robot.watch()
    assert store.state.notice.text.code == "notice.operator"


def test_a_real_arm_is_freed_only_when_asked_twice(store, session, monkeypatch):
    freed = []
    supervisor = SimpleNamespace(
        start_guiding=lambda *way, stops: freed.append(way) or SimpleNamespace(done=True, error=None),
        **dict.fromkeys(("recover", "power_on", "power_off", "reconnect", "stop_guiding")),
    )
    monkeypatch.setattr(session, "robot", lambda: supervisor)
    store.update(target="rci://192.168.0.160:1337")
    robot = RunActions(store, session)
    robot.drive(RobotCommand(page=1, what="guide"))
    assert store.state.notice.text.code == "guide.sure"
    assert freed == []
    robot.drive(RobotCommand(page=1, what="guide"))
    assert freed == [("joint", "free")]


def test_the_plant_is_not_chosen_for_a_robot_at_an_address(store, session):
    store.update(target="rci://192.168.0.160:1337")
    RunActions(store, session).choose_robot(ChooseRobot(page=1, plant="ideal"))
    assert store.state.notice.text.code == "plant.address"
    assert store.state.plant == "mujoco"


@pytest.fixture(scope="module")
def bench() -> Iterator[Workbench]:
    with opened() as found:
        yield found


def test_another_plant_keeps_goal_and_plan_and_is_refused_in_mid_motion(bench):
    ask = bench.dispatcher.ask
    wait(lambda: bench.store.state.plan is None and bench.session.status().q_c is not None, "the first look")
    angle = float(bench.session.status().q_c[0]) + 0.4
    ask(MoveJoint(joint=0, angle=angle))
    wait(lambda: bench.store.state.plan is not None and bench.store.state.plan.complete, "a plan")
    goal, plan = bench.store.state.goal, bench.store.state.plan
    pid = bench.session.status().controller_pid
    ask(ChooseRobot(plant="mujoco"))
    wait(lambda: bench.session.status().controller_pid not in (None, pid), "another controller")
    wait(lambda: bench.session.status().phase == "idle" and bool(bench.session.status().powered), "a powered arm")
    assert bench.store.state.plant == "mujoco"
    assert bench.store.state.goal is goal
    assert bench.store.state.plan is plan
    ask(PlanGoal())
    ask(RobotCommand(what="execute"))
    wait(lambda: bench.session.status().phase == "moving", "the arm to move")
    ask(ChooseRobot(plant="ideal"))
    wait(lambda: told(bench) == "notice.moving", "the refusal")
    assert bench.store.state.plant == "mujoco"
    ask(RobotCommand(what="stop"))
    wait(lambda: bench.session.status().phase == "idle", "the arm to rest")


def test_a_guided_arm_follows_the_button(bench):
    ask = bench.dispatcher.ask
    wait(lambda: bench.session.status().phase == "idle" and bool(bench.session.status().powered), "a powered arm")
    ask(RobotCommand(what="guide"))
    wait(lambda: bench.session.status().code == "moving.guided", "a free arm")
    start = np.array(bench.session.status().q)

    def pushed() -> bool:
        ask(HoldPush())
        return float(np.abs(bench.session.status().q - start).max()) > 0.05

    wait(pushed, "the arm to follow")
    ask(RobotCommand(what="unguide"))
    wait(lambda: bench.session.status().code == "idle.guided", "the arm to be held again")
    wait(lambda: bench.store.state.push.acting is None, "the push to end")


@pytest.mark.parametrize("mode", ["joint_impedance", "cartesian_impedance"])
def test_an_arm_that_is_pushed_in_a_soft_motion_gives_way_comes_back_arrives_and_is_recorded(bench, mode):
    ask, status = bench.dispatcher.ask, bench.session.status
    wait(lambda: status().phase == "idle" and bool(status().powered) and told(bench) != "notice.moving", "a rest")
    if bench.store.state.plant != "mujoco":
        pid = status().controller_pid
        ask(ChooseRobot(plant="mujoco"))
        wait(lambda: status().controller_pid not in (None, pid), "another controller")
        wait(lambda: status().phase == "idle" and bool(status().powered), "a powered arm")
    ask(SetDrive(mode=mode))
    ask(SetPush(link=TOOL, direction="+z", newtons=40.0))
    ask(SetSpeed(speed=0.05))
    last, q = bench.store.state.last_run, status().q_c
    angle = float(q[0]) + (0.5 if q[0] < 0.1 else -0.5)
    ask(MoveJoint(joint=0, angle=angle))

    def planned() -> bool:
        plan = bench.store.state.plan
        return plan is not None and plan.complete and plan.mode == mode and abs(plan.motion.goal[0] - angle) < 1e-9

    wait(planned, "a plan that was judged for the mode")
    motion = bench.store.state.plan.motion
    ask(RobotCommand(what="execute"))
    wait(lambda: status().code == "moving" and (status().motion_time or 0.0) > 0.3, "the arm on its way")

    def height() -> float:
        """How far the tool is above where it is told to be, [m]."""
        now = status()
        return float(MODEL.forward(now.q).position[2] - MODEL.forward(now.q_c).position[2])

    still = height()

    def given_way() -> bool:
        ask(HoldPush())
        return height() > still + 0.003

    wait(given_way, "the arm to give way")
    assert status().code == "moving"
    wait(lambda: bench.store.state.push.acting is None, "the push to end")
    wait(lambda: (r := bench.store.state.last_run) not in (None, last) and r.run is not None, "the arrival")
    assert (status().code, status().faults) == ("idle.arrived", ())
    run = bench.store.state.last_run.run
    assert (run.setup.mode, run.setup.plant, run.stopped) == (mode, "mujoco", None)
    assert run.plan.goal == pytest.approx(motion.goal, abs=1e-9)
    away = [
        MODEL.forward(q).position[2] - MODEL.forward(q_c).position[2]
        for q, q_c in zip(run.cycles["q"][::20], run.cycles["q_c"][::20], strict=True)
    ]
    pushed = int(np.argmax(away))
    assert away[pushed] > still + 0.002, "the recording shows the push"
    back = [pushed + row for row, gap in enumerate(away[pushed:]) if abs(gap - still) < 0.001]
    assert 20 * back[0] < len(run.plan), "it came back while it went on"
    ask(SetDrive(mode="joint_position"))
