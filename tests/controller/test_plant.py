from __future__ import annotations

import numpy as np
import pytest

from rcilab.controller.plant import Drive, IdealPlant, Setpoint
from rcilab.model import RobotModel, load_model


@pytest.fixture(params=["xMatePro7", "xMate3"])
def model(request: pytest.FixtureRequest) -> RobotModel:
    return load_model(request.param)


def test_the_ideal_plant_is_where_it_was_told_to_be(model: RobotModel) -> None:
    plant = IdealPlant(model)
    q, dq, ddq = model.home + 0.01, np.full(model.n, 0.2), np.full(model.n, 1.5)
    measured = plant.step(Setpoint(Drive.POSITION, q.tolist(), dq.tolist(), ddq.tolist()))
    assert np.array_equal(measured.q, q)
    assert np.array_equal(measured.dq, dq)
    assert np.array_equal(measured.tau, model.torque(q, dq, ddq).full)
    assert not measured.tau_ext.any()
    assert not measured.wrench_ext.any()


def test_an_arm_at_rest_answers_with_the_same_measurement(model: RobotModel) -> None:
    plant = IdealPlant(model)
    still = (0.0,) * model.n
    rest = plant.reset(model.home)
    assert plant.step(Setpoint(Drive.POSITION, model.home.tolist(), still, still)) is rest
    assert plant.step(Setpoint(Drive.BRAKED, still, still, still)) is rest


def test_the_torque_of_the_last_deceleration_does_not_stay(model: RobotModel) -> None:
    plant = IdealPlant(model)
    still, braking = (0.0,) * model.n, (-5.0,) * model.n
    q = model.home.tolist()
    plant.step(Setpoint(Drive.POSITION, q, still, braking))
    measured = plant.step(Setpoint(Drive.POSITION, q, still, still))
    assert np.array_equal(measured.tau, model.torque(model.home).full)


def test_brakes_stop_the_arm_where_it_is(model: RobotModel) -> None:
    plant = IdealPlant(model)
    still, moving = (0.0,) * model.n, (0.5,) * model.n
    there = (model.home + 0.001).tolist()
    plant.step(Setpoint(Drive.POSITION, there, moving, still))
    measured = plant.step(Setpoint(Drive.BRAKED, model.home.tolist(), still, still))
    assert measured.q.tolist() == there
    assert not measured.dq.any()
