"""Parameters of a controller that bound every motion are limits of the model."""

from __future__ import annotations

import numpy as np

from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, tool_limits_of
from rcilab.makers.maker import parameters_of
from rcilab.makers.parameters import default_parameters
from rcilab.model.robot_model import load_model


def test_a_model_has_the_bounds_and_keeps_the_ratio_of_jerk_to_acceleration():
    model = load_model("RM65")
    control = ControllerParameters(
        joint_velocity=(1.0,) * 6, joint_acceleration=(5.0,) * 6, tool_limits=(0.2, 1.0, 0.5, 3.0)
    )
    limits = RobotConfiguration(control=control).applied_to(model).limits
    assert limits.joint.velocity.tolist() == [1.0] * 6
    np.testing.assert_allclose(limits.joint.jerk, 500.0)
    assert tool_limits_of(limits) == (0.2, 1.0, 0.5, 3.0)
    assert limits.cartesian.translation_jerk == 100.0


def test_the_limits_do_not_depend_on_the_values_before():
    model = load_model("RM75")
    first = ControllerParameters(joint_acceleration=(3.3,) * 7)
    defaults = RobotConfiguration(control=default_parameters(parameters_of(model)))
    direct = defaults.applied_to(model).limits
    after = defaults.applied_to(RobotConfiguration(control=first).applied_to(model)).limits
    assert np.array_equal(direct.joint.jerk, after.joint.jerk)
    assert direct.cartesian == after.cartesian


def test_other_parameters_leave_a_model_as_it_is():
    model = load_model("xArm6")
    assert RobotConfiguration(control=default_parameters(parameters_of(model))).applied_to(model).limits is model.limits
