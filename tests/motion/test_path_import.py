"""Paths of other programs as waypoints: units, arcs in every plane and dress, feeds, errors with line and remedy."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import check
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.i18n.error_messages import describe_error, describe_note
from rcilab.i18n.translator import Text
from rcilab.model.robot_model import load_model
from rcilab.motion import Program, Waypoint, plan_program
from rcilab.motion.path_import import TOOL_DOWN, read_path

MODEL = load_model("xMatePro7")
LIMIT = MODEL.limits.cartesian.translation_velocity
START = "G0 X500 Y0 Z300\n"


def gcode(text: str, **options) -> tuple[Waypoint, ...]:
    return read_path(text.encode(), "part.nc", MODEL, **options).waypoints


def table(text: str, **options) -> tuple[Waypoint, ...]:
    return read_path(text.encode(), "part.csv", MODEL, **options).waypoints


def test_moves_are_the_same_in_every_unit_and_mode():
    expected = gcode(START + "G1 X520 Y10 F600\nX520 Y30\nG2 X500 Y50 I-20 J0")
    same = (
        "%\nO1 (a part)\nN10 G21 G90 G17 G94 G40\nn20g0 x500y0 z300;up\nG1 F600\n"
        "X520. Y+10\nG01 Y30 (over)\ng02x500y50i-20 j0\nM30\njunk",
        START + "G91 G1 X20 Y10 F600\nY20\nG2 X-20 Y20 I-20 J0",
        START + "G90.1 G1 X520 Y10 F600\nY30\nG2 X500 Y50 I500 J30",
    )
    for text in same:
        found = gcode(text)
        assert [w.type for w in found] == ["joint", "line", "line", "arc"]
        for ours, theirs in zip(found, expected, strict=True):
            assert np.allclose(ours.position, theirs.position, atol=1e-12)
            assert (ours.wxyz, ours.speed) == (TOOL_DOWN, pytest.approx(theirs.speed))
    inches = gcode("G20 G0 X10 Y0 Z5\nG1 X12 F60")
    assert np.allclose(inches[1].position, (0.3048, 0.0, 0.127))
    assert inches[1].speed == pytest.approx(0.0254 / LIMIT)
    assert expected[1].speed == pytest.approx(0.01 / LIMIT)


@pytest.mark.parametrize(("plane", "axes"), [("G17", "XYZ"), ("G18", "ZXY"), ("G19", "YZX")])
@pytest.mark.parametrize("code", ["G2", "G3"])
@pytest.mark.parametrize("angle", [0.4, 2.0, 3.9])
def test_arcs_by_centre_and_by_radius_lie_on_the_circle_in_the_right_sense(plane, axes, code, angle):
    sense, radius, center = (-1.0 if code == "G2" else 1.0), 60.0, np.array((400.0, 50.0))
    turned = 0.7 + sense * np.array((0.0, 0.5, 1.0)) * angle
    start, middle, goal = (center + radius * np.array((math.cos(t), math.sin(t))) for t in turned)
    offsets = dict(zip("XYZ", "IJK", strict=True))
    begin = f"{plane} G0 {axes[0]}{start[0]:.9f} {axes[1]}{start[1]:.9f} {axes[2]}300\n"
    move = f"{code} {axes[0]}{goal[0]:.9f} {axes[1]}{goal[1]:.9f} "
    by_center = f"{offsets[axes[0]]}{center[0] - start[0]:.9f} {offsets[axes[1]]}{center[1] - start[1]:.9f}"
    by_radius = f"R{radius if angle <= math.pi else -radius}"
    for text in (by_center, by_radius):
        arc = gcode(begin + move + text)[1]
        assert arc.type == "arc"
        assert np.allclose(np.array(arc.via)[["XYZ".index(a) for a in axes]], [*middle / 1000.0, 0.3], atol=1e-9)


def test_a_full_circle_a_flat_arc_and_a_helix():
    circle = gcode(START + "G3 X500 Y0 I-20")[1]
    assert (circle.type, circle.axis, circle.angle) == ("circle", (0.0, 0.0, 1.0), None)
    assert np.allclose(circle.center, (0.48, 0.0, 0.3))
    assert gcode(START + "G2 I-20")[1].axis == (0.0, 0.0, -1.0)
    assert gcode(START + "G2 X500.01 Y0 R1000")[1].type == "line"
    helix = gcode(START + "G3 X480 Y20 Z290 I-20")
    assert {w.type for w in helix[1:]} == {"line"}
    points = np.array([w.position for w in helix])
    assert np.allclose(points[-1], (0.48, 0.02, 0.29))
    angles = np.arctan2(points[:, 1], points[:, 0] - 0.48)
    assert np.allclose(np.hypot(points[:, 0] - 0.48, points[:, 1]), 0.02)
    assert np.allclose(points[:, 2], 0.3 - 0.01 * angles / (math.pi / 2.0))
    assert 0.02 * (1.0 - math.cos(np.diff(angles).max() / 2.0)) <= 1.0001e-5


def test_feeds_beyond_the_arm_and_what_does_not_move_the_tool_are_noted_with_their_lines():
    text = "M3 S900\n" + START + "G1 X520 F1e2\n".replace("1e2", "900000") + "Y10\nG1 X530 F1\nM5\n"
    path = read_path(text.encode(), "part.nc", MODEL)
    assert [w.speed for w in path.waypoints[1:]] == [1.0, 1.0, 0.001]
    assert path.notes[0] == "part.nc, line 1: M3 is ignored, as it does not move the tool"
    fast = next(note for note in path.notes if note.code == "path_fast")
    assert "line 3" in fast
    assert fast.facts["count"] == 2
    for note in path.notes:
        assert "part.nc" in Text("zh", "rcilab.app").render(describe_note(note))


def test_the_path_begins_where_all_axes_are_known_and_dwells_belong_to_the_move_before():
    found = gcode("G0 Z350\nG0 X500 Y0\nG1 Z300 F600\nG4 P1.5\nG4 P0.5\nX510")
    assert [w.position[2] for w in found] == [0.35, 0.3, 0.3]
    assert [w.dwell for w in found] == [0.0, 2.0, 0.0]
    assert gcode("G0 X500 Y0\nG1 X510")[0].position == (0.5, 0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("G41", "line 2: 'G41' is cutter compensation"),
        ("G1 X1 A30", "line 2: 'A30' moves an axis"),
        ("G1 X#2", "line 2: 'X#2' is a subprogram or a variable"),
        ("hello", "line 2: 'HELLO' is not a word"),
        ("/G1 X1", "line 2: '/G1 X1' is a line that machines may skip"),
        ("G28 Z0", "line 2: 'G28' refers to coordinates of the machine"),
        ("G81 X1 Z-5 R2", "line 2: 'G81' is a canned cycle"),
        ("G95", "line 2: 'G95' is another kind of feed"),
        ("G12", "line 2: 'G12' is unknown"),
        ("G1 G2 X1", "line 2: 'G2' is a second motion"),
        ("G1 X1 X2", "line 2: 'X2' is a second X"),
        ("G1 X1 F0", "line 2 must be above 0: the feed per minute, got 'F0'"),
        ("G2 X510 Y10", "line 2: 'G2' is an arc without centre"),
        ("G2 X510 Y10 I10 R10", "line 2: 'R10' is given with a centre"),
        ("G2 X510 Y10 I12", "line 2: 10.198 mm is the radius at the end of the arc, but that at its start is 12 mm"),
        ("G2 X510 R4", "line 2: 'R4' is too small: the arc needs at least 5"),
        ("G2 X500 Y0 R4", "line 2: 'R4' gives no circle"),
        ("G2 X500 Y0 I4 P3", "line 2: 'P3' turns are too many"),
        ("G1 X20000", "line 2, position: (20.0, 0.0, 0.3) is beyond 10 m"),
    ],
)
def test_what_would_change_the_path_unseen_is_refused_with_its_line_in_both_languages(text, what):
    with pytest.raises(InvalidValueError) as caught:
        gcode(START + text)
    assert what in str(caught.value)
    assert "part.nc, line 2" in str(caught.value)
    shown = Text("zh", "rcilab.app").render(describe_error(caught.value))
    assert "part.nc" in shown
    assert re.search("[\u4e00-\u9fff]", shown)


_WORDS = st.builds(
    lambda letter, number, digits: f"{letter}{number:.{digits}f}",
    st.sampled_from("GGGXYZIJKRFPMNSE"),
    st.one_of(st.sampled_from((0.0, 1.0, 2.0, 3.0, 17.0, 18.0, 20.0, 90.1, 91.0)), st.floats(-1e10, 1e10)),
    st.integers(0, 3),
)
_LINES = st.lists(st.lists(_WORDS, max_size=6).map(" ".join), max_size=12).map("\n".join)


@settings(max_examples=300)
@given(st.one_of(_LINES, st.text(), st.binary().map(lambda content: content.decode("latin-1"))))
def test_any_file_is_a_path_or_refused(text):
    with suppress(InvalidValueError):
        assert gcode(START + text)
    with suppress(InvalidValueError):
        assert table(text)


def test_a_helix_without_end_and_a_file_without_end_are_refused():
    with pytest.raises(InvalidValueError, match="1 to 10000"):
        gcode(START + "G2 X500 Y0 Z301 I999000000")
    with pytest.raises(InvalidValueError, match="1 to 10000"):
        gcode("".join(f"G1 X{number % 100} Y0 Z0\n" for number in range(200_000)))


@pytest.mark.parametrize("text", ["G91 G0 X1 Y1 Z1", "G0 X1 Y1\nG2 X2 Y2 Z2 R2", "X1 Y2 Z3", "", "M30"])
def test_a_path_needs_a_start(text):
    with pytest.raises(InvalidValueError, match=r"part\.nc"):
        gcode(text)


def test_a_table_has_units_orientations_and_speeds():
    rows = "500, 0, 300, 180, 0, 90, 50\n520, 0, 300, 180, 0, 45, 25\n"
    first, second = table("x [mm],y_mm,z (mm),roll [deg],pitch [deg],yaw [deg],speed [mm/s]\n" + rows)
    assert np.allclose(second.position, (0.52, 0.0, 0.3))
    assert Pose(second.position, second.wxyz).is_close(Pose.from_rpy((0.52, 0.0, 0.3), np.radians((180.0, 0.0, 45.0))))
    assert (first.type, second.type) == ("joint", "line")
    assert second.speed == pytest.approx(0.025 / LIMIT)
    quaternion = table("t,z,y,x,qw,qx,qy,qz,speed\n0,0.3,0.1,0.5,0,1,0,0,0.4\n")[0]
    assert (quaternion.position, quaternion.wxyz, quaternion.speed) == ((0.5, 0.1, 0.3), (0.0, 1.0, 0.0, 0.0), 0.4)
    plain = table("0.5 0 0.3\n0.5 0 0.4\n0.5 0 0.4\n", frame="tray", wxyz=(0.0, 1.0, 0.0, 0.0), speed=0.3)
    assert len(plain) == 2
    assert {(w.frame, w.wxyz, w.speed) for w in plain} == {("tray", (0.0, 1.0, 0.0, 0.0), 0.3)}


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("x,y\n1,2", "line 1 must name x, y and z"),
        ("x,y,z\n500,0,300", "line 2: 500.0 m is beyond 10 m; if it is in another unit, name its column x [mm]"),
        ("x,y,z,qw,qx,qy,qz\n0.5,0,0.3,1,1,0,0", "line 2, wxyz: (1.0, 1.0, 0.0, 0.0) has length 1.414"),
        ("x,y,z,roll\n0.5,0,0.3,1", "line 1: 'roll' is not a whole orientation"),
        ("x,y,z,x_mm\n0.5,0,0.3,1", "line 1: 'x_mm' is a second column"),
        ("x,y,z\n0.5,0,0.3\n0.5,zero,0.3", "line 3: 'zero' in column 2"),
        ("x,y,z,speed\n0.5,0,0.3,0", "line 2, speed must be above 0"),
        ("1,2,3,4", "line 1: 4 columns; without a header"),
    ],
)
def test_a_bad_table_is_refused_with_its_line(text, what):
    with pytest.raises(InvalidValueError) as caught:
        table(text)
    assert what in str(caught.value)


def test_arguments_are_checked():
    for options in ({"speed": 0.0}, {"blend": 2.0}, {"frame": ""}, {"wxyz": (1.0, 1.0, 0.0, 0.0)}):
        with pytest.raises(InvalidValueError):
            gcode(START, **options)
    with pytest.raises(InvalidValueError, match=r"must end in one of \.csv, \.nc"):
        read_path(b"", "part.dxf", MODEL)
    with pytest.raises(InvalidValueError, match="1 to 10000"):
        gcode("".join(f"G1 X{500 + 0.001 * i:.3f} Y0 Z300\n" for i in range(10_001)))


def test_a_dense_polyline_runs_without_a_stop_and_stays_on_the_path(tmp_path):
    angles = np.linspace(0.0, math.tau, 200)
    file = tmp_path / "ring.csv"
    points = np.column_stack((0.48 + 0.05 * np.cos(angles), 0.05 * np.sin(angles), np.full(200, 0.4)))
    file.write_text("x,y,z,speed [mm/s]\n" + "".join(f"{x:.6f},{y:.6f},{z},100\n" for x, y, z in points))
    program = Program.from_path(file, MODEL, blend=0.005)
    assert program.name == "ring"
    motion = plan_program(MODEL, program)
    assert motion.notes == ()  # Each radius fits.
    assert check(motion, MODEL).ok
    inside = motion.segment >= 2
    tool = MODEL.position_path(motion.q[inside])
    speed = np.linalg.norm(np.diff(tool, axis=0), axis=1) / 1e-3
    assert speed[200:-200].min() > 0.05
    assert np.abs(np.hypot(tool[:, 0] - 0.48, tool[:, 1]) - 0.05).max() < 5e-5
    assert speed.max() < 0.1001


def test_notes_are_warnings_and_the_example_of_the_documentation_runs(tmp_path, monkeypatch):
    (tmp_path / "part.nc").write_text("M3\n" + START)
    with pytest.warns(UserWarning, match="line 1: M3 is ignored"):
        Program.from_path(tmp_path / "part.nc", MODEL)
    with pytest.raises(InvalidValueError, match="does not exist"):
        Program.from_path(tmp_path / "other.nc", MODEL)
    monkeypatch.chdir(tmp_path)
    text = (Path(__file__).parents[2] / "docs/paths.md").read_text(encoding="utf-8")
    exec(re.findall(r"```python\n(.*?)```", text, re.DOTALL)[0], {})
