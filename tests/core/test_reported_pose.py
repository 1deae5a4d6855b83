"""A pose of a state: read when somebody asks, and then like any other."""

import copy
import pickle

import numpy as np
import pytest

from rcilab import Pose, load_model, plan_line, simulate
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.spatial import IDENTITY

T = Pose.from_rpy((0.4, -0.1, 0.6), (0.1, -0.2, 0.3))


@pytest.mark.parametrize("numbers", [T.matrix, T.matrix.ravel()], ids=["matrix", "row-major"])
def test_a_reported_pose_is_the_pose_that_was_reported(numbers):
    pose = ReportedPose(numbers)
    assert pose.as_row_major() == T.as_row_major()
    assert pose.tobytes() == T.tobytes() == T.matrix.tobytes()
    assert np.array_equal(np.asarray(pose), T.matrix)
    assert np.array_equal(pose.position, T.position)
    assert np.array_equal(pose.wxyz, T.wxyz)
    assert (pose @ pose.inverse()).is_close(IDENTITY)
    assert repr(pose) == repr(T)


def test_it_can_be_copied_sent_and_has_no_other_names():
    for pose in (copy.deepcopy(ReportedPose(T.matrix)), pickle.loads(pickle.dumps(ReportedPose(T.matrix)))):
        assert pose.parts == T.parts
    with pytest.raises(AttributeError, match="'ReportedPose' object has no attribute 'positon'"):
        ReportedPose(T.matrix).positon  # noqa: B018


def test_its_matrix_is_a_copy():
    numbers = T.matrix
    pose = ReportedPose(numbers)
    np.asarray(pose)[0, 3] = pose.matrix[0, 3] = 9.0
    assert pose.position[0] == numbers[0, 3] == 0.4


def test_what_the_state_tells_goes_straight_into_what_takes_a_pose():
    model = load_model("xMatePro7")
    with simulate(model) as robot:
        robot.power_on()
        state = robot.state
        assert state.T_base_tool.is_close(model.forward(state.q))
        assert state.T_base_tool_c.is_close(model.forward(state.q_c))
        up = Pose([0.0, 0.0, 0.05]) @ state.T_base_tool_c
        motion = plan_line(model, state.q_c, up)
        assert model.forward(motion.q[-1]).is_close(up, 1e-6)
        robot.move_l(up, speed=0.3)
        assert robot.state.T_base_tool_c.is_close(up, 1e-6)
