"""What is drawn of a set-up, in a scene without a screen."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.configuration_view import ConfigurationView, inertia_ellipsoid, outside_runs
from rcilab.views.null_scene import NullScene

BOX = SafetyBox(size=(0.4, 0.2, 0.6), T_base_box=Pose.from_rpy((0.3, 0.1, 0.5), (0.0, 0.0, 0.5)))


def test_a_solid_ellipsoid_gets_its_half_axes_back():
    a, b, c = 0.05, 0.03, 0.08
    inertia = np.diag((b * b + c * c, a * a + c * c, a * a + b * b)) * 2.0 / 5.0
    turn = Pose.from_rpy((0, 0, 0), (0.3, -0.4, 1.0)).rotation
    axes, radii = inertia_ellipsoid(Payload(mass=2.0, inertia=turn @ inertia @ turn.T))
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes @ np.diag(radii**2) @ axes.T == pytest.approx(turn @ np.diag((a * a, b * b, c * c)) @ turn.T)
    assert inertia_ellipsoid(Payload())[1].tolist() == [0.0, 0.0, 0.0]


def test_only_the_part_of_a_path_outside_the_box_is_returned():
    path = np.stack([np.linspace(-1.0, 1.6, 27), np.full(27, 0.1), np.full(27, 0.5)], axis=1)
    runs = outside_runs(path, BOX)
    assert len(runs) == 2
    inside = BOX.excess_path(path) < 0.0
    assert inside.any()
    assert sum(map(len, runs)) == len(path) - inside.sum() + 1  # The second begins with the last point inside.
    assert outside_runs(path, None) == []
    assert outside_runs(path, SafetyBox(size=BOX.size, T_base_box=BOX.T_base_box, active=False)) == []
    assert [len(run) for run in outside_runs(path[:1].repeat(1, axis=0).repeat(2, axis=0), BOX)] == [2]


def test_what_is_shown_stands_where_the_set_up_says_and_what_is_hidden_is_hidden():
    scene = NullScene()
    model = load_model("xMate3")
    arm = ArmView(scene, "live", model, "live", quality="coarse")
    flange = arm.tool_node.rpartition("/")[0]
    view = ConfigurationView(scene, flange)
    tool = Pose((0.0, 0.02, 0.15))
    view.show_tool(tool)
    view.show_box(BOX)
    view.show_load(Payload(mass=1.0, center_of_mass=(0.0, 0.0, 0.04), inertia=np.diag((0.002, 0.002, 0.001))))
    view.show_force(tool)
    assert scene.nodes[f"{flange}/setup_tool"].position == pytest.approx((0.0, 0.02, 0.15))
    assert scene.nodes["/safety_box"].visible
    for show in (view.show_tool, view.show_box, view.show_load, view.show_force):
        show(None)
    assert not any(scene.nodes[name].visible for name in ("/safety_box", f"{flange}/setup_tool"))
    view.remove_box()
    arm.remove()
    assert not [name for name in scene.nodes if "setup" in name or "safety" in name]
