"""An arm in a scene: where its links are, what it sends, how it looks."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from rcilab.robots.shapes import ROLE_COLORS
from rcilab.views.arm_view import ArmView
from rcilab.views.null_scene import NullScene


def world_pose(scene: NullScene, name: str) -> Pose:
    """Returns the pose of a node in the world: the product of all transforms above it."""
    T_world_node, path = Pose(), ""
    for part in name.strip("/").split("/"):
        path += f"/{part}"
        node = scene.nodes[path]
        T_world_node = T_world_node @ Pose(node.position, node.wxyz)
    return T_world_node


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_the_tool_is_drawn_where_forward_kinematics_puts_it(name: str) -> None:
    model = load_model(name, tool=Pose.from_rpy([0.03, -0.02, 0.12], [0.4, -0.2, 1.1]))
    scene = NullScene()
    arm = ArmView(scene, "live", model)
    rng = np.random.default_rng(7)
    for q in rng.uniform(model.limits.joint.lower, model.limits.joint.upper, (100, model.n)):
        arm.show(q)
        assert world_pose(scene, arm.tool_node).is_close(model.forward(q), 1e-9)


def test_nodes_are_named_as_documented() -> None:
    scene = NullScene()
    arm = ArmView(scene, "live", load_model("xMate3"))
    assert arm.root == "/live"
    assert arm.joint_nodes[2] == "/live/joint1/joint2/joint3"
    assert arm.tool_node == "/live/joint1/joint2/joint3/joint4/joint5/joint6/flange/tool"
    assert {"/live/base_shell", "/live/joint1/shell", "/live/joint1/cap"} <= set(scene.nodes)


def test_only_joints_that_moved_are_sent_and_in_one_batch() -> None:
    scene = NullScene()
    model = load_model("xMatePro7")
    arm = ArmView(scene, "live", model)
    arm.show(model.home)
    moves, batches = scene.moves, scene.batches
    arm.show(model.home)
    assert (scene.moves, scene.batches) == (moves, batches)
    q = np.array(model.home)
    q[3] += 0.1
    arm.show(q)
    assert (scene.moves, scene.batches) == (moves + 1, batches + 1)


def test_joint_angles_that_are_none_leave_the_arm_as_it_was() -> None:
    scene = NullScene()
    model = load_model("xMatePro3")
    arm = ArmView(scene, "live", model)
    arm.show(model.home)
    before = world_pose(scene, arm.tool_node)
    for wrong in (model.home[:6], [np.nan] * 7, "home"):
        with pytest.raises(InvalidValueError, match="q"):
            arm.show(wrong)
    assert world_pose(scene, arm.tool_node).is_close(before, 0.0)


def test_a_ghost_is_tinted_thinner_translucent_and_without_base() -> None:
    scene = NullScene()
    model = load_model("xMatePro3")
    ArmView(scene, "live", model, quality="coarse")
    ArmView(scene, "plan", model, "plan")
    live, plan = (
        scene.nodes["/live/joint2/shell".replace("joint2", "joint1/joint2")],
        scene.nodes["/plan/joint1/joint2/shell"],
    )
    assert live.color == ROLE_COLORS["shell"]
    assert live.opacity == 1.0
    assert plan.opacity < 0.5
    assert plan.color != live.color
    assert live.points is not None
    assert plan.points is not None
    assert np.linalg.norm(plan.points - live.points, axis=1) == pytest.approx(0.002, abs=1e-6)
    assert "/live/base_shell" in scene.nodes
    assert "/plan/base_shell" not in scene.nodes


def test_four_arms_of_different_style_stand_in_one_scene() -> None:
    scene = NullScene()
    model = load_model("xMate7")
    arms = [ArmView(scene, style, model, style) for style in ("live", "commanded", "plan", "candidate")]  # type: ignore[arg-type]
    arms[3].show(model.home)
    assert world_pose(scene, arms[0].tool_node).is_close(model.forward(np.zeros(6)))
    assert world_pose(scene, arms[3].tool_node).is_close(model.forward(model.home))


def test_hiding_and_restyling_reach_every_part() -> None:
    scene = NullScene()
    arm = ArmView(scene, "plan", load_model("xMate3"), "plan")
    arm.set_visible(False)
    assert not scene.is_shown("/plan/joint1/joint2/shell")
    arm.set_visible(True)
    arm.set_look(color=(200, 0, 0), opacity=0.8)
    meshes = [node for node in scene.nodes.values() if node.kind == "mesh"]
    assert {node.opacity for node in meshes} == {0.8}
    assert all(node.color[0] > 0 and node.color[1:] == (0, 0) for node in meshes)


def test_a_tool_can_be_changed_while_the_arm_stands() -> None:
    scene = NullScene()
    model = load_model("xMatePro7")
    arm = ArmView(scene, "live", model)
    arm.show(model.home)
    tool = Pose.from_rpy([0.0, 0.0, 0.2], [0.0, 0.5, 0.0])
    arm.show_tool(tool)
    assert world_pose(scene, arm.tool_node).is_close(model.with_tool(tool).forward(model.home))


def test_removing_leaves_nothing_and_using_it_again_is_said_plainly() -> None:
    scene = NullScene()
    model = load_model("xMate3")
    arm = ArmView(scene, "live", model)
    other = ArmView(scene, "live2", model)
    arm.remove()
    arm.remove()
    assert all(name.startswith("/live2") for name in scene.nodes)
    with pytest.raises(UsageError, match="removed"):
        arm.show(model.home)
    other.show(model.home)
