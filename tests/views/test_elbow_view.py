"""The elbow's ring: where it is drawn, and how arcs are told apart."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np

from rcilab.model.robot_model import load_model
from rcilab.views.elbow_view import ARC_COLORS, OUTWARD, ElbowView, free_colors
from rcilab.views.null_scene import NullScene
from rcilab.views.swept_volume import swept_mesh

MODEL = load_model("xMatePro7")


def arc(start: float, end: float, kind: str) -> SimpleNamespace:
    return SimpleNamespace(start=start, end=end, kind=kind)


def lengths(scene: NullScene, kind: str) -> np.ndarray:
    ends = scene.nodes[f"/elbow/{kind}"].points.reshape(-1, 2, 3)
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def test_free_arcs_are_whole_and_forbidden_ones_are_dashed():
    scene, circle = NullScene(), MODEL.elbow_circle(MODEL.home)
    view = ElbowView(scene)
    assert not scene.is_shown("/elbow")
    view.show(circle, 0.0, [arc(-1.0, 1.0, "free"), arc(1.0, 2.0 * math.pi - 1.0, "limits")], np.full(36, 0.2))
    assert scene.is_shown("/elbow/free")
    radius = circle.radius + OUTWARD
    assert abs(lengths(scene, "free").sum() / radius - 2.0) < 0.01
    assert 0.5 < lengths(scene, "limits").sum() / radius / (2.0 * math.pi - 2.0) < 0.7
    assert lengths(scene, "singular").sum() == 0.0
    points = scene.nodes["/elbow/free"].points
    assert np.allclose(np.linalg.norm(points - circle.center, axis=1), radius)


def test_all_kinds_keep_their_number_of_segments_so_that_a_page_only_moves_points():
    scene, circle = NullScene(), MODEL.elbow_circle(MODEL.home)
    view = ElbowView(scene)
    counts = set()
    for kind in ARC_COLORS:
        view.show(circle, 0.0, [arc(-math.pi, math.pi, kind)], np.full(36, 0.2))
        counts |= {len(lengths(scene, other)) for other in ARC_COLORS}
        assert lengths(scene, kind).sum() > 0.3 * circle.radius * math.tau
    assert len(counts) == 1


def test_a_free_arc_is_amber_next_to_a_singularity():
    dexterity = np.array([0.01, 0.2, 0.2, 0.2])
    colors = free_colors(np.array([-math.pi, 0.0]), dexterity)
    assert colors[0, 0] > 200.0 > 100.0 > colors[1, 0]


def test_a_swept_volume_holds_the_arm_at_every_moment():
    q = np.stack([np.zeros(7), MODEL.home])
    mesh = swept_mesh(MODEL, q)
    one = swept_mesh(MODEL, q[:1])
    assert len(mesh.vertices) == 2 * len(one.vertices)
    for row in q:
        elbow = MODEL.joint_frames(row)[2].position
        assert np.linalg.norm(mesh.vertices - elbow, axis=1).min() < 0.12
