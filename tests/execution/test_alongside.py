"""What other threads may ask while a motion runs is answered while one begins, too."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.core.errors import RcilabError
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")


@pytest.fixture
def robot():
    with simulate(MODEL) as robot:
        robot.power_on()
        yield robot


@pytest.mark.parametrize(
    "ask",
    [
        lambda robot: robot.state,
        lambda robot: robot.is_powered(),
        lambda robot: robot.rci.safety_stop(),
        lambda robot: robot.rci.motor_state(),
        lambda robot: robot.rci.get_di(0),
        lambda robot: robot.rci.set_do(0, True),
        lambda robot: robot.rci.set_cart_imp_desired_tau(np.zeros(6)),
    ],
    ids=["state", "is_powered", "safety_stop", "motor_state", "get_di", "set_do", "set_cart_imp_desired_tau"],
)
def test_a_thread_that_watches_is_answered_whenever_a_motion_begins(robot, ask):
    over, answers, errors = threading.Event(), [], []

    def watch() -> None:
        while not over.is_set():
            try:
                answers.append(ask(robot))
            except Exception as error:
                errors.append(error)
            time.sleep(0.001)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        for step in range(4):
            robot.move_j(MODEL.home + 0.02 * (step % 2 == 0), 0.5)
    finally:
        over.set()
        watcher.join(10.0)
    assert errors == []
    assert len(answers) > 20


@pytest.mark.parametrize("delay", [0.0, 0.002, 0.005, 0.01, 0.02, 0.04])
def test_power_off_ends_a_motion_that_is_about_to_begin(robot, delay):
    ended = []

    def move() -> None:
        try:
            ended.append(robot.move_j(MODEL.home + 0.5, 0.05))
        except RcilabError as error:
            ended.append(error)

    mover = threading.Thread(target=move)
    mover.start()
    time.sleep(delay)
    robot.power_off()
    mover.join(20.0)
    assert isinstance(ended[0], RcilabError)
    assert not robot.rci.motor_state()
    assert np.abs(robot.state.q_c - MODEL.home).max() < 0.4
