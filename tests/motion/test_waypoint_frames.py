"""Waypoints in named frames: there and back, followed when a frame moves, refused where the frame is missing."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.cell.cell import Cell
from rcilab.cell.entries import Frame
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, Program, Waypoint, plan_program

MODEL = load_model("xMatePro7")
HOME = MODEL.forward(MODEL.home)
TRAY = Pose.from_rpy((0.4, -0.1, 0.2), (0.1, -0.2, 0.8))


def moved(x: float, y: float, z: float) -> Pose:
    return Pose(HOME.position + (x, y, z), HOME.wxyz)


IN_BASE = (
    Waypoint.joint(moved(0.0, 0.05, 0.0), psi=0.1, speed=0.9, blend=0.01),
    Waypoint.line(moved(0.0, 0.1, 0.0), speed=0.9),
    Waypoint.arc(moved(-0.05, 0.12, 0.0), moved(-0.1, 0.1, 0.0), speed=0.9),
    Waypoint.circle(moved(-0.13, 0.1, 0.0).position, (0.0, 0.0, 2.0), 2.0, dwell=0.02, speed=0.9),
    Waypoint.nullspace(0.3, speed=0.9),
)
IN_TRAY = tuple(w if w.type == "nullspace" else w.in_frame(TRAY, "tray") for w in IN_BASE)


def program(*waypoints: Waypoint) -> Program:
    return Program(model=MODEL.name, start=MODEL.home, waypoints=waypoints)


def cell(T_base_tray: Pose) -> Cell:
    """A cell whose arm is not at the origin of the world, with a tray on a table."""
    base, table = Pose.from_rpy((0.1, 0.2, 0.7), (0.0, 0.0, 1.0)), Pose((0.5, 0.0, 0.7))
    return Cell(
        model=MODEL.name,
        T_world_base=base,
        frames=(
            Frame(name="table", T_parent_frame=table),
            Frame(name="tray", parent="table", T_parent_frame=table.inverse() @ base @ T_base_tray),
        ),
    )


def assert_close(a: Waypoint, b: Waypoint) -> None:
    """Requires the same waypoint, but for rounding; a quaternion and its negative are the same."""
    assert (a.type, a.frame, a.psi, a.angle, a.speed, a.blend, a.dwell) == (
        b.type, b.frame, b.psi, b.angle, b.speed, b.blend, b.dwell,
    )  # fmt: skip
    for name in ("position", "via", "center", "axis"):
        one, other = getattr(a, name), getattr(b, name)
        assert (one is None) == (other is None)
        assert one is None or np.allclose(one, other, rtol=0.0, atol=1e-12)
    for name in ("wxyz", "via_wxyz"):
        one, other = getattr(a, name), getattr(b, name)
        assert (one is None) == (other is None)
        assert one is None or Pose(wxyz=one).is_close(Pose(wxyz=other), 1e-12)


coordinates = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
turns = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)


@settings(max_examples=30)
@given(coordinates, turns)
def test_a_waypoint_in_a_frame_comes_back(position, rpy):
    T = Pose.from_rpy(position, rpy)
    for waypoint in IN_BASE[:-1]:
        inside = waypoint.in_frame(T, "tray")
        assert inside.frame == "tray"
        assert_close(inside.in_base(T), waypoint)
    assert IN_BASE[1].in_base(T) is IN_BASE[1]


def test_numbers_in_a_frame_are_those_seen_from_there():
    T = Pose.from_rpy((1.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2.0))
    line = Waypoint.line(Pose((0.5, 0.0, 0.1)), frame="a").in_base(T)
    assert np.allclose(line.position, (1.0, 0.5, 0.1))
    assert line.frame is None
    assert line.pose.is_close(T @ Pose((0.5, 0.0, 0.1)))
    circle = Waypoint.circle((0.5, 0.0, 0.1), (3.0, 0.0, 0.0), frame="a").in_base(T)
    assert np.allclose((circle.center, circle.axis), ((1.0, 0.5, 0.1), (0.0, 3.0, 0.0)))
    arc = Waypoint.arc((0.5, 0.0, 0.1), Pose((0.6, 0.0, 0.1)), frame="a").in_base(T)
    assert np.allclose((arc.via, arc.position), ((1.0, 0.5, 0.1), (1.0, 0.6, 0.1)))
    assert arc.via_wxyz is None
    assert Waypoint.joint(Pose((0.5, 0.0, 0.1)), frame="a").retyped("arc", (0.1, 0.0, 0.1)).frame == "a"


def test_the_motion_is_that_of_the_numbers_in_base_and_moves_with_the_frame():
    in_tray = program(*IN_TRAY)
    assert (in_tray.frames, program(*IN_BASE).frames) == (("tray",), ())
    planned = plan_program(MODEL, program(*IN_BASE))
    poses = cell(TRAY).frame_poses
    assert set(poses) == {"world", "table", "tray"}
    assert poses["tray"].is_close(TRAY)
    assert all(pose.is_close(cell(TRAY).T_base(name)) for name, pose in poses.items())
    resolved = in_tray.resolved(poses)
    assert resolved.frames == ()
    motion = plan_program(MODEL, resolved)
    assert len(motion) == len(planned)
    assert np.allclose(motion.q, planned.q, rtol=0.0, atol=1e-9)  # Rounding of a product of poses, on a 1 m arm.
    step = Pose((0.02, -0.03, 0.01))
    shifted = plan_program(MODEL, in_tray.resolved(cell(step @ TRAY).frame_poses))
    for number in (1, 2):
        end = np.flatnonzero(planned.segment == number)[-1]
        there = np.flatnonzero(shifted.segment == number)[-1]
        difference = MODEL.forward(shifted.q[there]).position - MODEL.forward(planned.q[end]).position
        assert np.allclose(difference, step.position, rtol=0.0, atol=1e-6)  # The last row before the stop.


@pytest.mark.parametrize(
    ("act", "expected"),
    [
        (lambda: plan_program(MODEL, program(*IN_TRAY)), r"waypoint 1 \(joint\), frame: 'tray' is not base: plan cell"),
        (lambda: program(*IN_TRAY).resolved({"table": TRAY, "world": TRAY}),
         r"waypoint 1 \(joint\), frame: 'tray' does not exist; there are: table, world"),
        (lambda: program(*IN_TRAY).resolved({}), "there are: none"),
        (lambda: program(*IN_TRAY).resolved(None), r"frames must be poses by name, got None; use cell\.frame_poses"),
        (lambda: program(*IN_TRAY).resolved({"tray": Pose((50.0, 0.0, 0.0))}), r"waypoint 1 .*position: .*beyond 10 m"),
        (lambda: program(*IN_TRAY).resolved({"tray": 7}), "pose of the frame must be a Pose"),
        (lambda: Waypoint.joint(MODEL.home, frame="tray"), "frame: 'tray' has no meaning with q: .*give position"),
        (lambda: IN_BASE[-1].in_frame(TRAY, "tray"), "frame: 'tray' has no meaning here; nullspace takes: psi, way"),
        (lambda: IN_TRAY[0].in_frame(TRAY, "table"), r"frame: 'tray' is the frame of this waypoint; use in_base"),
        (lambda: IN_BASE[0].in_frame(TRAY, " "), "frame must be the name of a frame, text in one line, got ' '"),
        (lambda: Waypoint.line(HOME, frame=3), "frame must be the name of a frame, text in one line, got 3"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_frame_is_said(act, expected):
    with pytest.raises(InvalidValueError, match=expected):
        act()


def test_the_script_takes_the_frames_of_a_cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    cell(TRAY).save(tmp_path / "cell.json")
    monkeypatch.chdir(tmp_path)
    scope: dict[str, object] = {"__name__": "script"}
    exec(program(*IN_TRAY).to_python(), scope)
    motion = scope["motion"]
    assert isinstance(motion, Motion)
    expected = plan_program(MODEL, program(*IN_BASE), law="torque_rate_limited")
    assert np.allclose(motion.q, expected.q, rtol=0.0, atol=1e-9)
