"""Programs as values, files and scripts: exact there and back, and kind to whoever wrote something else."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rcilab
from rcilab.core.errors import InvalidValueError, ModelError, VersionMismatchError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, Program, Waypoint, located_json, plan_program
from rcilab.motion.waypoint_types import ALLOWED, CHOICES

MODEL = load_model("xMatePro7")
HOME = MODEL.forward(MODEL.home)
ROOT = Path(rcilab.__file__).parents[1]


def moved(*step) -> Pose:
    return Pose(HOME.position + step, HOME.wxyz)


PROGRAM = Program(
    name="pick 'n' place \"1\" 件",
    model="XMATEPRO7",
    start=MODEL.home,
    tool=(0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0),
    waypoints=(
        Waypoint.joint(MODEL.home + 0.1, blend=0.02, speed=0.9),
        Waypoint.line(moved(0.0, 0.1, 0.0), blend=0.03, psi=0.1, speed=0.9),
        Waypoint.arc(moved(-0.05, 0.12, 0.0), moved(-0.1, 0.1, 0.0), blend=0.01, speed=0.9),
        Waypoint.circle(moved(-0.13, 0.1, 0.0).position, (0.0, 0.0, 2.0), 2.0, dwell=0.02, speed=0.9),
        Waypoint.nullspace(0.3, speed=0.9),
    ),
)
TEXT = PROGRAM.to_json()

angles = st.floats(-12.0, 12.0)
places = st.tuples(*[st.floats(-10.0, 10.0)] * 3)
rests = {
    "speed": st.floats(0.001, 1.0),
    "blend": st.floats(0.0, 1.0),
    "dwell": st.floats(0.0, 3600.0),
}
psis = st.none() | st.floats(-math.pi, math.pi)
turns = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda x: math.hypot(*x) > 0.1)
poses = st.builds(Pose, places, turns)
printable = st.text(st.characters(exclude_categories=("C", "Z")))
frames = st.none() | printable.filter(bool)
waypoints = st.one_of(
    st.builds(Waypoint.joint, st.tuples(*[angles] * 7), **rests),
    st.builds(Waypoint.line, poses, psi=psis, frame=frames, **rests),
    st.builds(Waypoint.arc, places | poses, poses, psi=psis, frame=frames, **rests),
    st.builds(
        Waypoint.circle,
        places,
        places.filter(lambda x: math.hypot(*x) > 0.01),
        st.floats(0.1, 6.2),
        orientation=st.sampled_from(["held", "turning"]),
        frame=frames,
        **rests,
    ),
    st.builds(Waypoint.nullspace, st.floats(-math.pi, math.pi), way=st.sampled_from(["shorter", "longer"]), **rests),
)


@cache
def validator():
    import jsonschema  # Takes 2 s, which other workers need not wait for.

    return jsonschema.Draft202012Validator(
        json.loads((ROOT / "rcilab/motion/program.schema.json").read_text(encoding="utf-8"))
    )


@settings(max_examples=40)
@given(st.tuples(*[angles] * 7), st.lists(waypoints, min_size=1, max_size=5), printable)
def test_json_and_script_give_back_the_same_program_to_the_last_bit(start, steps, name):
    program = Program(model="xMatePro7", start=start, waypoints=tuple(steps), name=name)
    text = program.to_json()
    assert Program.from_json(text) == program
    assert Program.from_json(text).to_json() == text
    validator().validate(json.loads(text))
    scope = {}
    exec(program.to_python().split("model = ")[0], scope)
    assert scope["program"] == program


def test_a_file_comes_back(tmp_path):
    PROGRAM.save(tmp_path / "a.json")
    assert Program.load(tmp_path / "a.json") == PROGRAM
    assert PROGRAM.model == "xMatePro7"
    assert repr(PROGRAM).endswith("for xMatePro7: 1 joint, 1 line, 1 arc, 1 circle, 1 nullspace>")
    with pytest.raises(InvalidValueError, match="does not exist"):
        Program.load(tmp_path / "b.json")
    with pytest.raises(InvalidValueError, match="cannot be read"):
        Program.load(tmp_path)
    (tmp_path / "c.json").mkdir()
    with pytest.raises(InvalidValueError, match="cannot be written"):
        PROGRAM.save(tmp_path / "c.json")
    with pytest.raises(InvalidValueError, match="must be a file name"):
        Program.load(7)


def test_the_script_runs_without_a_screen_and_gives_the_same_motion_to_the_last_sample(tmp_path):
    script, out = tmp_path / "program.py", tmp_path / "motion.npz"
    script.write_text(PROGRAM.to_python(), encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "DISPLAY": ""}
    done = subprocess.run(
        [sys.executable, str(script), str(out)], capture_output=True, text=True, env=environment, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "conforms" in done.stdout
    motion = plan_program(MODEL.with_tool(Pose((0.0, 0.0, 0.1))), PROGRAM, law="torque_rate_limited")
    again = Motion.load(out)
    assert np.array_equal(again.q, motion.q)
    assert np.array_equal(again.segment, motion.segment)
    assert again.fingerprint == motion.fingerprint


def test_the_schema_knows_what_the_class_knows():
    schema = validator().schema
    validator().check_schema(schema)
    properties = schema["$defs"]["waypoint"]["properties"]
    assert set(properties) == {"type", *(name for names in ALLOWED.values() for name in names)}
    assert properties["type"]["enum"] == list(ALLOWED)
    for key, default in (("speed", 0.2), ("blend", 0.0), ("dwell", 0.0)):
        assert properties[key]["default"] == default
    for key, words in CHOICES.items():
        assert properties[key]["enum"] == list(words)
        assert properties[key]["default"] == words[0]
    alone = {**schema, "$ref": "#/$defs/waypoint", "required": [], "properties": {}, "additionalProperties": True}
    waypoint_alone = validator().evolve(schema=alone)
    for kind, allowed in ALLOWED.items():
        assert waypoint_alone.is_valid({"type": kind, **_least(kind)})
        for key in set(properties) - {"type", *allowed}:
            value = {"angle": 1.0, "psi": 1.0, "orientation": "held", "way": "longer", "frame": "tray"}
            value |= {"approach": 0.1, "distance": 0.1, "signal": 1, "level": True, "timeout": 1.0, "jaws": "open"}
            value |= {"count": 1, "text": "a", "speed": 0.5, "blend": 0.1, "dwell": 0.1}
            wrong = {"type": kind, **_least(kind), key: value.get(key, [1.0, 0.0, 0.0])}
            assert not waypoint_alone.is_valid(wrong), (kind, key)
        if "q" in _least(kind):
            assert not waypoint_alone.is_valid({"type": kind, **_least(kind), "frame": "tray"})


def _least(kind):
    return {
        "joint": {"q": [0.0] * 7},
        "line": {"q": [0.0] * 7},
        "arc": {"q": [0.0] * 7, "via": [0.0] * 3},
        "circle": {"center": [0.0] * 3, "axis": [0.0, 0.0, 1.0]},
        "nullspace": {"psi": 0.0},
        "free": {"q": [0.0] * 7},
        "retreat": {"distance": 0.1},
        "wait": {"dwell": 0.1},
        "input": {"signal": 1},
        "output": {"signal": "close gripper"},
        "tool": {"jaws": "open"},
        "repeat": {"count": 2},
        "group": {"text": "pick"},
        "end": {},
        "comment": {"text": "none"},
    }[kind]


def lines(*waypoints, head='"format": "rcilab program", "version": 1', model="xMatePro7", start=None) -> str:
    """A program with its head in line 2 and its waypoints from line 5 on."""
    angles = json.dumps(list(MODEL.home) if start is None else start)
    return (
        f'{{\n  {head},\n  "model": "{model}", "start": {angles},\n  "waypoints": [\n    '
        + ",\n    ".join(waypoints)
        + "\n  ]\n}\n"
    )


GOOD = '{"type": "nullspace", "psi": 0.1}'


@pytest.mark.parametrize(
    ("waypoint", "hint"),
    [
        ('{"type": "nullspace", "psi": NaN}', "line 6: NaN is not a value"),
        ('{"type": "nullspace", "psi": 1e400}', "line 6: 1e400 is beyond the largest number, 1.8e308"),
        ('{"type": "nullspace", "psi": -Infinity}', "line 6: -Infinity is not a value"),
        ('{"type": "nullspace", "psi": 0x10}', "line 6: 0x10 is not a value"),
        ('{"type": "nullspace", "psi": "0.1"}', "line 6, waypoint 2, psi must be a number.*, got '0.1'"),
        ('{"type": "nullspace", "psi": true}', "line 6, waypoint 2, psi must be a number.*, got True"),
        (
            '{"type": "nullspace", "psi": 4}',
            r"line 6, waypoint 2 \(nullspace\), psi must be from -3.1416 to 3.1416 \[rad\].*, got 4.0",
        ),
        ('{"type": "nullspace"}', r"waypoint 2 \(nullspace\), psi is missing: nullspace needs psi"),
        (
            '{"type": "nullspace",\n"psi": 0.1,\n"speed": 2}',
            r"line 8, waypoint 2 \(nullspace\), speed must be from 0.001 to 1 .*, got 2.0",
        ),
        ('{"type": "nullspace", "psi": 0.1, "blend": -1}', r"blend must be from 0 to 1 \[m\].*, got -1.0"),
        ('{"type": "nullspace", "psi": 0.1, "dwell": 1e9}', r"dwell must be from 0 to 3600 \[s\].*, got 1000000000.0"),
        ('{"type": "nullspace", "psi": 0.1, "speed": null}', "speed must be a number.*, got None"),
        ('{"type": "nullspace", "psi": 0.1, "sped": 1}', "line 6, waypoint 2, sped: 1.0 is unknown; known: type, q,"),
        (
            '{"type": "nullspace", "psi": 0.1, "psi": 0.1}',
            'line 6: "psi" is a duplicate of the key in line 6; keep one',
        ),
        ('{"type": "nullspace", "psi": 0.1, "q": [1]}', "q: .* has no meaning here; nullspace takes: psi, way, speed"),
        ('{"psi": 0.1}', "line 6, waypoint 2, type is missing; known: joint, line"),
        ('{"type": "spline"}', r"waypoint 2 \(spline\), type: 'spline' is unknown; known: joint, line"),
        ('{"type": 3}', "waypoint 2, type must be text.*, got 3.0"),
        ("[1, 2]", r"line 6 must be waypoint 2: an object.*, got \[1.0, 2.0\]"),
        ('{"type": "line", "position": [0.5, 0, 0.5]}', r"wxyz is missing: a pose has position"),
        (
            '{"type": "line", "position": [500, 0, 500], "wxyz": [1,0,0,0]}',
            "position: .* is beyond 10 m; if it is in millimetres",
        ),
        ('{"type": "line", "position": [0.5, 0], "wxyz": [1,0,0,0]}', r"position: .* has shape \(2,\), needs \(3,\)"),
        ('{"type": "line", "position": [0.5, 0, [1]], "wxyz": [1,0,0,0]}', "position, number 3 must be a number"),
        ('{"type": "line", "position": 0.5, "wxyz": [1,0,0,0]}', "position must be a list of numbers.*, got 0.5"),
        (
            '{"type": "line", "position": [0.5, 0, 0.5], "wxyz": [2,0,0,0]}',
            "wxyz: .* has length 2, must be 1 within 0.001",
        ),
        ('{"type": "line"}', "target is missing: line needs q, or position and wxyz"),
        ('{"type": "line", "q": [0,0,0,0,0,0,0], "psi": 0.1}', "psi: 0.1 is a second arm angle"),
        ('{"type": "line", "q": [0,0,0,0,0,0,0], "wxyz": [1,0,0,0]}', "q: .* is a second target"),
        (
            '{"type": "joint", "q": [0,0,0,0,0,0]}',
            r"line 6, waypoint 2 \(joint\), q must be 7 joint angles \[rad\]",
        ),
        (
            '{"type": "joint", "q": [0,90,0,0,0,0,0]}',
            "q: 90.0 rad of joint 2 is more than two turns, 12.57 rad; multiply degrees",
        ),
        ('{"type": "circle", "center": [0.5, 0, 0.5], "axis": [0,0,0]}', "axis: .* has no direction"),
        (
            '{"type": "circle", "center": [0.5, 0, 0.5], "axis": [0,0,1], "angle": 0}',
            "angle must be from more than 0 to 6.2832.*, got 0.0",
        ),
        (
            '{"type": "circle", "center": [0.5, 0, 0.5], "axis": [0,0,1], "orientation": "fixed"}',
            r"line 6, waypoint 2 \(circle\), orientation: 'fixed' is unknown; known: held, turning",
        ),
        (
            '{"type": "nullspace", "psi": 1, "way": 2}',
            "line 6, waypoint 2, way must be text in double quotes.*, got 2.0",
        ),
        (
            '{"type": "nullspace", "psi": 1, "orientation": "held"}',
            "orientation: 'held' has no meaning here; nullspace",
        ),
        ('{"type": "arc", "q": [0,0,0,0,0,0,0]}', "via is missing: arc needs via"),
        ('{"type": "line", "q": [0,0,0,0,0,0,0], "frame": "tray"}', "line 6, .*frame: 'tray' has no meaning with q"),
        ('{"type": "nullspace", "psi": 1,\n"frame": "tray"}', "line 7, .*frame: 'tray' has no meaning here"),
        ('{"type": "nullspace", "psi": 1, "frame": 3}', "line 6, waypoint 2, frame must be text in double quotes"),
        ('{"type": "line" "q": 1}', 'line 6: "q" is neither a comma|is neither a comma nor the end of the object'),
        ('{"type": "line", q: 1}', "line 6: q is not a key; a key is text in double quotes"),
        ('{"type" "line"}', "is not a colon; the key 'type' needs one"),
        ('{"type": "li\nne"}', "line 6: .* is not valid text: invalid control character"),
        ('{"type": "line", "q": [1 2]}', "line 6: 2 is neither a comma nor the end of the list"),
        ('{"type": "line", "q": [[[[[[[[1]]]]]]]]}', "line 6: .* opens more than 8 levels"),
    ],
)
def test_what_is_wrong_with_a_waypoint_is_told_with_its_line_key_value_and_bound(waypoint, hint):
    with pytest.raises(InvalidValueError, match=hint) as caught:
        Program.from_json(lines(GOOD, waypoint))
    assert str(caught.value).startswith("program, line ")


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        (" ", "program: the text is empty"),
        ("[]", r"line 1 must be a program: an object.*, got \[\]"),
        ('{"waypoints"', "line 1: the end of the text is not a colon"),
        (lines(GOOD) + "{}", "line 8: { follows the end|follows the end of the first value"),
        (lines(GOOD, head='"format": "x", "version": 1'), "line 2, format must be 'rcilab program'.*, got 'x'"),
        (lines(GOOD, head='"version": 1'), 'format is missing; a program has "format": "rcilab program"'),
        (lines(GOOD, model="kuka"), "line 3, model: 'kuka' is not a known model: .*known robots: .*xMatePro3"),
        (
            lines(GOOD, model="xMate3", start=[0.1] * 6),
            r"line 5, waypoint 1 \(nullspace\), psi: 0.1 has no meaning for xMate3",
        ),
        (lines(GOOD, start=[0.1] * 6), r"line 3, start must be 7 joint angles \[rad\]: xMatePro7 has 7 axes"),
        (
            lines(GOOD, head='"format": "rcilab program", "version": 1, "speed": 1'),
            "a program, speed: 1.0 is unknown; known: format",
        ),
        (lines(GOOD, head='"format": "rcilab program", "version": 1, "tool": [1]'), "line 2, tool: .* needs "),
        (
            lines(GOOD, head='"format": "rcilab program", "version": 1, "name": "a\\nb"'),
            "line 2, name must be text in one line",
        ),
        ('{"format": "rcilab program", "version": 1, "start": [], "waypoints": []}', "model is missing"),
        (lines(GOOD).replace(f"[\n    {GOOD}\n  ]", "[]"), "line 4, waypoints must be 1 to 10000.*, got 0"),
        (lines(GOOD).replace(f"[\n    {GOOD}\n  ]", "{}"), "line 4, waypoints must be a list.*, got {}"),
        ("[" * 100_000, "opens more than 8 levels"),
        (" " * 8_000_001, "8.0 MB is above 8 MB"),
        ("\ud800", "line 1: .* is not UTF-8 text"),
    ],
)
def test_what_is_wrong_with_a_file_is_told(text, hint):
    with pytest.raises(InvalidValueError, match=hint):
        Program.from_json(text)


@pytest.mark.parametrize(
    "text", ['{"a\\u001b[31m": 1, "a\\u001b[31m": 1}', '{"a\\u202e": 1}', '{"a": "\x1b[31m"}', "\x1b[2J"]
)
def test_control_characters_reach_neither_the_message_nor_its_facts(text):
    with pytest.raises(InvalidValueError) as caught:
        Program.from_json(text)
    assert str(caught.value).isprintable()
    assert all(str(fact).isprintable() for fact in caught.value.facts.values())
    assert caught.value.facts


def test_another_version_is_told_apart():
    with pytest.raises(VersionMismatchError, match=r"line 2, version: found version 2, need 1"):
        Program.from_json(lines(GOOD, head='"format": "rcilab program", "version": 2'))


@settings(max_examples=100)
@given(st.data())
def test_a_spoiled_file_is_a_program_or_one_kind_error(data):
    at, size = data.draw(st.integers(0, len(TEXT))), data.draw(st.integers(0, 30))
    spoiled = TEXT[:at] + data.draw(st.text('0123456789eE+-.,:{}[]"\\ntrufalsNI\n', max_size=5)) + TEXT[at + size :]
    message = None
    try:
        found = Program.from_json(spoiled)
    except (InvalidValueError, VersionMismatchError) as error:
        message = str(error)
    else:
        assert Program.from_json(found.to_json()) == found
    assert message is None or re.match(r"program(, line \d+|, \w+|:)", message)


def test_values_from_python_are_checked_as_well():
    with pytest.raises(ModelError, match="known robots"):
        Program(model="kuka", start=(0.0,) * 7, waypoints=(Waypoint.nullspace(0.1),))
    with pytest.raises(InvalidValueError, match=r"waypoint 1 \(joint\), q must be 7 joint angles"):
        Program(model="xMatePro7", start=MODEL.home, waypoints=(Waypoint.joint([0.0] * 6),))
    with pytest.raises(InvalidValueError, match=r"waypoint 1 must be a Waypoint, got 3"):
        Program(model="xMatePro7", start=MODEL.home, waypoints=(3,))
    with pytest.raises(InvalidValueError, match=r"via must be finite"):
        Waypoint.arc((math.nan, 0.0, 0.0), HOME)
    with pytest.raises(InvalidValueError, match=r"way: .* is unknown; known: shorter, longer"):
        Waypoint.nullspace(0.1, way=np.ones(2))
    assert Waypoint(type="nullspace", psi=0.1) == Waypoint.nullspace(0.1)
    assert Waypoint.line(HOME).pose.is_close(HOME, 1e-12)
    assert Waypoint.nullspace(0.1).pose is None


def test_a_position_alone_is_no_target_and_the_error_says_what_is() -> None:
    with pytest.raises(InvalidValueError, match=r"target: \[0\.5, 0, 0\.3\] is not a target: pass a Pose"):
        Waypoint.line([0.5, 0, 0.3])


@pytest.mark.parametrize("name", ["motion.npz", "script.py", "plain"])
def test_a_program_is_saved_as_json_and_never_over_another_kind_of_file(tmp_path, name):
    file, model = tmp_path / name, load_model("xMatePro7")
    program = Program(model=model.name, start=model.home, waypoints=(Waypoint.joint(model.home + 0.1),))
    file.write_bytes(b"mine")
    with pytest.raises(InvalidValueError, match=r"must end in \.json"):
        program.save(file)
    assert file.read_bytes() == b"mine"
    with pytest.raises(InvalidValueError, match="must be a file name"):
        program.save(None)


def test_a_text_of_more_values_than_any_program_has_is_not_read_to_its_end():
    with pytest.raises(InvalidValueError, match="is one value more than 300000, the most in a file"):
        Program.from_json(b'{"start": [' + 400_000 * b"0," + b"?", "program.json")


def test_far_too_many_waypoints_are_counted_and_not_read():
    listed = 60_000 * [{"type": "joint", "q": 7 * [0.1]}]
    text = json.dumps(
        {"format": "rcilab program", "version": 1, "model": "xMatePro7", "start": [], "waypoints": listed}
    )
    read = []
    node = located_json.Node
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(located_json, "Node", lambda value, line: read.append(line) or node(value, line))
        with pytest.raises(InvalidValueError, match="line 1, waypoints must be 1 to 10000, got 60000"):
            Program.from_json(text.encode(), "program.json")
    assert len(read) < 12 * 10_000


@pytest.mark.parametrize("end", ["", "]", ', {"q": 1'])
def test_too_many_waypoints_in_a_spoiled_file_are_one_kind_of_error(end: str):
    text = '{"waypoints": [' + ",".join(10_001 * ["1"]) + end
    with pytest.raises(InvalidValueError, match="waypoints must be 1 to 10000, got 10001"):
        Program.from_json(text.encode(), "program.json")


def test_load_and_box_come_back_from_file_and_script_and_older_files_have_none(tmp_path):
    program = replace(PROGRAM, payload=(2.0, 0.0, 0.0, 0.05), box=(1.0, 1.0, 2.0, 0.4, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0))
    program.save(tmp_path / "a.json")
    assert Program.load(tmp_path / "a.json") == program
    validator().validate(json.loads(program.to_json()))
    scope = {}
    exec(program.to_python().split("model = ")[0], scope)
    assert scope["program"] == program
    arm = program.applied_to(MODEL)
    assert (arm.load.mass, arm.load.center_of_mass.tolist()) == (2.0, [0.0, 0.0, 0.05])
    assert program.safety_box.size == (1.0, 1.0, 2.0)
    older = Program.from_json(PROGRAM.to_json())
    assert (older.payload, older.box, older.safety_box) == (None, None, None)
    assert older.applied_to(MODEL).load is MODEL.load


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('"payload": [99, 0, 0, 0]', "line 2, payload: .*rated for"),
        ('"payload": [1, 0, 0]', "line 2, payload: .* needs .13,."),
        ('"payload": [1, 0, 0, 50]', "line 2, payload: .*unit is metres"),
        ('"box": [1, 1, 0, 0, 0, 0, 1, 0, 0, 0]', "line 2, box: .*above 0"),
        ('"box": [1, 1, 1, 0, 0, 0, 2, 0, 0, 0]', "line 2, box wxyz: .*length 2"),
    ],
)
def test_a_bad_load_or_box_is_refused_with_its_line(line, expected):
    with pytest.raises(InvalidValueError, match=expected):
        Program.from_json(lines(GOOD, head=f'"format": "rcilab program", "version": 1, {line}'))
