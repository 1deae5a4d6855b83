"""Every scene does the same with the same calls."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from rcilab.core.errors import UsageError
from rcilab.model.robot_model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.meshcat_scene import MeshcatScene
from rcilab.views.null_scene import NullScene
from rcilab.views.scene import Scene
from rcilab.views.viser_scene import ViserScene
from rcilab.views.viser_stage import add_environment, camera_position, place_camera

TRIANGLE = ([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0, 1, 2]])


@pytest.fixture(params=["null", "viser", "meshcat"])
def scene(request: pytest.FixtureRequest) -> Iterator[Scene]:
    if request.param == "null":
        yield NullScene()
    elif request.param == "meshcat":
        page = MeshcatScene()
        yield page
        page.close()
    else:
        import viser

        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        yield ViserScene(server)
        server.stop()


def test_it_is_a_scene(scene: Scene) -> None:
    assert isinstance(scene, Scene)


def test_an_arm_moves_hides_changes_colour_and_goes(scene: Scene) -> None:
    model = load_model("xMatePro3")
    arm = ArmView(scene, "live", model, axes_length=0.1)
    arm.show(model.home)
    arm.set_look(color=(10, 20, 30), opacity=0.5)
    arm.set_look(opacity=1.0)
    arm.set_visible(False)
    arm.remove()
    with pytest.raises(UsageError, match="no node"):
        scene.set_transform("/live/joint1", wxyz=(1.0, 0.0, 0.0, 0.0))
    ArmView(scene, "live", model).show(model.home)


def test_segments_move_and_change_in_number(scene: Scene) -> None:
    ends = np.arange(12.0).reshape(2, 2, 3)
    scene.add_segments("/lines", ends, color=(255, 0, 0))
    scene.add_segments("/lines", ends + 1.0, color=np.full((2, 2, 3), 7.0))
    scene.add_segments("/lines", ends[:1], color=(0, 0, 255))
    scene.set_visible("/lines", False)
    scene.remove("/lines")
    with pytest.raises(UsageError, match="segments need"):
        scene.add_segments("/lines", ends[0], color=(255, 0, 0))
    with pytest.raises(UsageError, match="fit neither"):
        scene.add_segments("/lines", ends, color=(1.0, 2.0))


def test_a_node_can_be_replaced_under_its_name(scene: Scene) -> None:
    scene.add_frame("/a", position=(1.0, 0.0, 0.0))
    scene.add_mesh("/a/mesh", *TRIANGLE, color=(255, 0, 0))
    scene.add_mesh("/a/mesh", *TRIANGLE, color=(0, 255, 0), opacity=0.5)
    scene.set_style("/a/mesh", opacity=1.0)
    scene.set_visible("/a/mesh", False)
    scene.remove("/a")
    with pytest.raises(UsageError, match="/a/mesh"):
        scene.set_visible("/a/mesh", True)


def test_removing_a_node_spares_others_whose_name_begins_alike(scene: Scene) -> None:
    scene.add_frame("/arm")
    scene.add_frame("/arm2")
    scene.remove("/arm")
    scene.set_transform("/arm2", position=(0.0, 0.0, 1.0))


def test_polylines_take_one_colour_or_one_a_point(scene: Scene) -> None:
    path = np.linspace([0.0, 0.0, 0.0], [1.0, 1.0, 0.5], 20)
    scene.add_polyline("/path", path, color=(255, 0, 0))
    scene.add_polyline("/path", path, color=np.tile([0, 128, 255], (20, 1)))
    scene.remove("/path")


@pytest.mark.parametrize(
    ("points", "color"), [([[0, 0, 0]], (1, 2, 3)), ([[0, 0], [1, 1]], (1, 2, 3)), (np.eye(3), (1, 2))]
)
def test_lines_that_are_none_are_refused(scene: Scene, points: list, color: tuple) -> None:
    with pytest.raises(UsageError, match="shape"):
        scene.add_polyline("/path", points, color=color)


def test_the_stage_can_be_set_again_while_the_page_is_open() -> None:
    import viser

    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        place_camera(server)
        add_environment(server, full=True)
        add_environment(server, full=False, dark=True)
        assert server.initial_camera.fov < 1.0  # [rad] a portrait lens
    finally:
        server.stop()


@pytest.mark.parametrize("aspect", [2.0, 1.0, 0.7, 0.4, 0.1])
def test_the_arm_and_the_handles_of_its_target_fit_beside_the_panels(aspect: float) -> None:
    model = load_model("xMatePro7")
    camera, look_at = camera_position(aspect), np.array([0.17, 0.02, 0.49])
    ahead = (look_at - camera) / np.linalg.norm(look_at - camera)
    aside = np.cross(ahead, (0.0, 0.0, 1.0))
    aside /= np.linalg.norm(aside)
    tool = model.forward(model.home).position
    for point in (np.zeros(3), tool, tool + 0.25 * aside):
        away = point - camera
        assert abs(away @ aside) < aspect * np.tan(0.375) * (away @ ahead)
