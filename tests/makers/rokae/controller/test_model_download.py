"""What LoadRobotModel serves: laid out as the vendor's library reads it, and true for our arm."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from rcilab.makers.rokae.base_parameters import base_parameters, regressor
from rcilab.makers.rokae.controller.model_download import model_response
from rcilab.model.robot_model import load_model
from rcilab.robots import describe_robot

# Torques computed by the vendor's library from a served parameter vector (without friction).
VENDOR = json.loads((Path(__file__).parent / "vendor_torque.json").read_text(encoding="utf-8"))


def test_the_regressor_agrees_with_the_vendors_library() -> None:
    model = load_model(VENDOR["model"])
    for case in VENDOR["cases"]:
        matrix = regressor(model, np.array(case["q"]), np.array(case["dq"]), np.array(case["ddq"]))
        assert np.allclose(matrix @ VENDOR["parameters"], case["torque"], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7"])
def test_base_parameters_reproduce_the_torques_of_our_own_arm(name: str) -> None:
    model = load_model(name)
    parameters = base_parameters(model.description)
    random = np.random.default_rng(1)
    for _ in range(20):
        q, dq, ddq = random.uniform(-2.5, 2.5, (3, 7))
        assert np.allclose(regressor(model, q, dq, ddq) @ parameters, model.torque(q, dq, ddq).full, rtol=0, atol=1e-10)


def test_the_blocks_are_laid_out_as_the_vendors_library_reads_them() -> None:
    arm = describe_robot("xMatePro7")
    response = model_response(arm)
    x = base_parameters(arm).tolist()
    assert (len(response.dh), len(response.dimensions)) == (28, 21)
    assert response.dynamics == (x[0], 0.0, 0.0, *x[1:])
    assert response.dynamics_with_friction[:6] == (x[0], 0.0, 0.0, 0.0, 0.0, 0.0)
    assert response.dynamics_with_friction[6:16] == (*x[1:8], 0.0, 0.0, 0.0)
    assert len(response.dynamics_with_friction) == 66


def test_the_coulomb_friction_of_the_joints_is_served_with_each_block() -> None:
    arm, levels = describe_robot("xMatePro7"), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]
    served, bare = (model_response(arm, friction) for friction in (levels, None))
    assert served.dynamics == bare.dynamics
    numbers = list(served.dynamics_with_friction)
    assert [numbers[end - 3 : end] for end in range(6, 67, 10)] == [[0.0, level, 0.0] for level in levels]
    assert [numbers[end - 10 : end - 3] for end in range(16, 67, 10)] == [
        list(bare.dynamics_with_friction[end - 10 : end - 3]) for end in range(16, 67, 10)
    ]


def test_lengths_are_served_in_millimetres() -> None:
    dh = model_response(describe_robot("xMatePro7")).dh
    assert [dh[4 * row + 2] for row in (0, 2, 4, 6)] == pytest.approx([404.0, 437.5, 412.5, 275.5])
    assert [dh[4 * row + 1] for row in range(7)] == pytest.approx([x * math.pi / 2 for x in (-1, 1, -1, 1, -1, 1, 0)])


def test_a_6_axis_arm_gets_its_geometry_and_an_empty_seventh_row() -> None:
    response = model_response(describe_robot("xMate3"))
    assert response.dh[4:8] == pytest.approx((394.0, 0.0, 0.0, -math.pi / 2))
    assert response.dh[24:] == (0.0,) * 4
    assert not any(response.dynamics)
