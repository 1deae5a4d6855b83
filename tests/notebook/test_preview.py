from __future__ import annotations

import base64
import re
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import umsgpack

import rcilab
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.notebook.preview import Preview, preview
from rcilab.robots.upright import upright_joints

PRO7 = rcilab.load_model("xMatePro7")
MOTION = rcilab.plan_joint(PRO7, PRO7.home, PRO7.home + np.linspace(-0.7, 0.7, 7))


@pytest.fixture
def live() -> Iterator[Preview]:
    with preview(MOTION, PRO7, live=True) as scene:
        yield scene


def commands(page: str) -> list[dict[str, Any]]:
    """What a written-out page will draw, in order."""
    return [umsgpack.unpackb(base64.b64decode(data)) for data in re.findall(r"base64,([A-Za-z0-9+/=]+)\"", page)]


def flange_of(page: str) -> np.ndarray:
    """Pose of the arm's flange in base, multiplied up the tree of nodes that the page draws."""
    transforms = {
        command["path"]: np.array(command["matrix"]).reshape(4, 4).T
        for command in commands(page)
        if command["type"] == "set_transform"
    }
    T, path = np.eye(4), "/meshcat/arm"
    for joint in range(1, PRO7.n + 1):
        path += f"/joint{joint}"
        T = T @ transforms[path]
    return T


def test_a_pose_is_drawn_where_forward_kinematics_says() -> None:
    q = PRO7.home + 0.1
    np.testing.assert_allclose(
        flange_of(preview(q, PRO7, live=False).html()), PRO7.forward(q).matrix, atol=1e-6
    )  # Single precision on its way to the page.


def test_the_animation_runs_through_the_motion_and_rests_at_the_goal(live: Preview) -> None:
    (animation,) = [command for command in commands(live.html()) if command["type"] == "set_animation"]
    assert len(animation["animations"]) == PRO7.n
    for number, (clip, joint) in enumerate(
        zip(animation["animations"], upright_joints(PRO7.description), strict=True), start=1
    ):
        assert clip["path"].endswith(f"/joint{number}")
        (track,) = clip["clip"]["tracks"]
        times = np.array([key["time"] for key in track["keys"]]) / clip["clip"]["fps"]
        assert times[0] == 0.0
        assert times[-1] == pytest.approx(MOTION.duration + 1.0)
        for t, key in zip(times, track["keys"], strict=True):
            half = MOTION.at(t).q[number - 1] / 2.0
            np.testing.assert_allclose(key["value"], [*(np.sin(half) * joint.axis), np.cos(half)], atol=1e-12)


def test_the_goal_stands_there_as_a_ghost(live: Preview) -> None:
    meshes = [c for c in commands(live.html()) if c["type"] == "set_object" and "/goal/" in c["path"]]
    assert meshes
    assert all(command["object"]["materials"][0]["opacity"] < 0.6 for command in meshes)


def test_live_it_is_served_on_loopback_and_shown_in_a_frame(live: Preview) -> None:
    assert live.url is not None
    assert live.url.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(live.url, timeout=5) as answer:
        assert answer.status == 200
    assert f'<iframe src="{live.url}"' in live._repr_html_()
    assert len(live._repr_html_()) < 1000


def test_static_it_is_whole_and_needs_nobody(tmp_path: Path) -> None:
    scene = preview(MOTION, PRO7, live=False)
    assert scene.url is None
    assert "srcdoc=" in scene._repr_html_()
    scene.save(tmp_path / "motion.html")
    page = (tmp_path / "motion.html").read_text(encoding="utf-8")
    assert not re.findall(r"(?:src|href)\s*=\s*[\"']https?://", page)
    assert any(command["type"] == "set_animation" for command in commands(page))


def test_on_a_hub_it_is_static_unless_a_proxy_leads_to_the_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JUPYTERHUB_SERVICE_PREFIX", "/user/somebody/")
    monkeypatch.setattr("rcilab.notebook.kernel_reachability.find_spec", lambda name: None)
    assert preview(PRO7.home, PRO7).url is None
    monkeypatch.setattr("rcilab.notebook.kernel_reachability.find_spec", lambda name: object())
    with preview(PRO7.home, PRO7) as scene:
        assert scene.url is not None
        assert scene.url.startswith("/user/somebody/proxy/")


def test_showing_a_pose_ends_the_animation(live: Preview) -> None:
    q = PRO7.home - 0.2
    live.show(q)
    (animation,) = [command for command in commands(live.html()) if command["type"] == "set_animation"]
    assert animation["animations"] == []
    assert live.url is not None
    assert live.url.endswith("/?plain")  # The viewer's own menu has nothing to play.
    np.testing.assert_allclose(flange_of(live.html()), PRO7.forward(q).matrix, atol=1e-6)


def test_a_closed_preview_keeps_its_picture_and_refuses_to_move() -> None:
    scene = preview(PRO7.home, PRO7, live=True)
    before = scene.html()
    scene.close()
    scene.close()
    assert scene.html() == before
    with pytest.raises(UsageError, match="make a new one"):
        scene.show(PRO7.home)


def test_a_pose_that_is_none_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="q: "):
        preview([0.0, 1.0], PRO7)
    with pytest.raises(InvalidValueError, match="finite"):
        preview([np.nan] * 7, PRO7)


def test_a_motion_of_another_arm_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="needs \\(6,\\)"):
        preview(MOTION, rcilab.load_model("xMate3"))
