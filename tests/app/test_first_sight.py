"""The arm is seen for the first time: what was planned a moment before stays."""

from __future__ import annotations

import numpy as np

from rcilab.app.dispatcher import Dispatcher
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import MoveJoint
from rcilab.app.run.readiness import describe_move
from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.status_text import StartingError
from rcilab.app.store import Store, UiState
from rcilab.control_process import SupervisorStatus
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")
IDLE = SupervisorStatus(phase="idle", code="idle", powered=True, q=MODEL.home, q_c=MODEL.home)


class Robot:
    """A robot at an address, which has just come to rest."""

    is_ready = True

    def status(self) -> SupervisorStatus:
        return IDLE

    def robot(self) -> None:
        raise StartingError("it is not asked for anything here")


def test_a_question_that_is_quicker_than_the_first_look_at_the_arm_stays():
    store = Store(UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home), target="rci://192.0.2.1:1337"))
    dispatcher = Dispatcher(store, Robot())
    dispatcher.act(MoveJoint(joint=0, angle=0.1))
    dispatcher.act(RobotCommand(what="execute"))
    asked = describe_move(store.state)
    assert asked is not None
    dispatcher.tick(0.03)
    assert describe_move(store.state) == asked
    assert dispatcher.errors == []


def test_the_arm_that_is_seen_has_a_goal_planned_that_was_posed_before():
    store = Store(UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home)))
    dispatcher = Dispatcher(store, Robot())
    store.update(goal=goal_at(MODEL, MODEL.home + 0.1))
    dispatcher.tick(0.03)
    np.testing.assert_array_equal(store.state.plan.motion.goal, MODEL.home + 0.1)
