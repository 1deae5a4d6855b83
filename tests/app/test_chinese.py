"""What a person can provoke by ordinary use of the page is answered in the page's language, in its units."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from rcilab.app.status_text import explain_error
from rcilab.app.text import Text
from rcilab.cell.cell import Cell
from rcilab.conformance.check import check
from rcilab.conformance.explain import explain_limit
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.control_process import SupervisorStatus
from rcilab.control_process.motion_upload import require_ready
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import CertificateError, CommandRejectedError, RcilabError, UsageError
from rcilab.core.optional_deps import MissingExtraError
from rcilab.core.spatial import Pose
from rcilab.execution.command_validation import find_start_mismatch
from rcilab.i18n.error_messages import describe_note
from rcilab.i18n.number_parsing import parse_number, parse_quaternion
from rcilab.i18n.translator import Remark, message
from rcilab.i18n.units import Units
from rcilab.makers.rokae.conditions import RCI_CONDITIONS
from rcilab.makers.rokae.driver.address import RciAddress
from rcilab.makers.rokae.driver.connection import SocketTransport
from rcilab.makers.rokae.driver.identify import dh_lengths, require_same_arm
from rcilab.makers.rokae.wire import RecoveryStatus, StartStatus
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, Program, Waypoint, plan_joint, plan_line, plan_program
from rcilab.motion.named_poses import NamedPoseStore
from rcilab.recording.chunks import MAGIC
from rcilab.recording.run import decode_run, load_run
from rcilab.recording.run_file import RunFile
from rcilab.robots import ROBOT_NAMES
from rcilab.sim.api import Refused, WorldStatus
from rcilab.sim.api.lines import decode_world_answer, encode_world_answer
from rcilab.sim.generators.generator import lost_motion
from rcilab.sim.ideal_plant import IdealPlant

MODEL = load_model("xMatePro7")
HOME = np.array(MODEL.home)
KEYS = (
    "position wxyz frame psi via type model start speed blend dwell rounds q1 q2 joint line arc circle nullspace "
    "spline free retreat wait input output tool repeat group end comment approach "
    "signal jaws true false gripper close"
)
ARMS = "xMatePro7 xMatePro3 xMate3 MuJoCo"
WORDS = "rcilab RCI IP UDP URDF JSON CSV UTF StartMove AutomaticErrorRecovery MoveJ MoveL MoveC rci rad mm deg kg MB"
NAMES = rf"{f'{ARMS} {KEYS} {WORDS}'.replace(' ', '|')}|[xyzw]\b"
"""What is called the same in every language: names of arms, protocols and keys, units."""


def moved(x: float, y: float = 0.0, z: float = 0.0) -> Pose:
    T = MODEL.forward(HOME)
    return Pose(T.position + [x, y, z], T.wxyz)


def program(*waypoints: Waypoint) -> Program:
    return Program(model=MODEL.name, start=tuple(HOME.tolist()), waypoints=waypoints)


def planned(*waypoints: Waypoint) -> object:
    return plan_program(MODEL, program(*waypoints))


def bad_file(change: Callable[[str], str]) -> Callable[[], object]:
    text = program(Waypoint.line(moved(0.05))).to_json()
    return lambda: Program.from_json(change(text).encode(), "bad.json")


def closed_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def refuse(error: RcilabError) -> Callable[[], object]:
    def act() -> None:
        raise error

    return act


def start_elsewhere() -> None:
    mismatch = find_start_mismatch(HOME + 0.1, HOME)
    assert mismatch is not None
    raise UsageError(mismatch).coded("elsewhere")


def stale() -> None:
    motion = plan_joint(MODEL, HOME, HOME + 0.1)
    certificate = check(motion, MODEL, distance=None).certificate
    assert certificate is not None
    certificate.verify(motion, MODEL, HOME + 0.2)


def robot_at_closed_port() -> None:
    address = RciAddress(host="127.0.0.1", port=closed_port())
    SocketTransport(address, 1024, 1.0)


def bad_text(old: str, new: str) -> Callable[[], object]:
    return bad_file(lambda text: text.replace(old, new))


def bad_samples(text: str) -> Callable[[], object]:
    return lambda: read_samples_text(text)


def read_samples_text(text: str) -> None:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "bad.csv"
        file.write_text(text)
        Motion.load_samples(file)


def refused_by_the_world() -> None:
    """As a refusal comes back over the wire."""
    try:
        IdealPlant(MODEL).set_floor(True)
    except RcilabError as error:
        line = encode_world_answer(Refused(str(error), error.code, error.facts), 1)
        _, answer = decode_world_answer(line)
        assert isinstance(answer, Refused)
        raise UsageError(answer.reason).coded(answer.code, **answer.facts) from error


def other_arm() -> None:
    lengths = dh_lengths(load_model("xMate3").description.dh)
    served = [number for a, d in lengths for number in (1000.0 * a, 0.0, 1000.0 * d, 0.0)]
    require_same_arm(served, "xMatePro7", dh_lengths(MODEL.description.dh), "127.0.0.1:1337")


PROVOKED: dict[str, Callable[[], object]] = {
    "out of reach": lambda: plan_line(MODEL, HOME, moved(3.0)),
    "a singular way": lambda: plan_line(MODEL, np.array([0.0, 0.3, 0.0, 0.4, 0.0, 0.5, 0.0]), moved(0.0, 0.0, 2.0)),
    "a joint limit": lambda: plan_joint(MODEL, HOME, np.array([9.0, *HOME[1:]])),
    "an arc on a line": lambda: plan_program(MODEL, program(Waypoint.arc(moved(0.05).position, moved(0.1)))),
    "a waypoint out of reach": lambda: plan_program(MODEL, program(Waypoint.line(moved(3.0)))),
    "the stretched arm": lambda: MODEL.arm_angle(np.zeros(7)),
    "start elsewhere": start_elsewhere,
    "stale certificate": stale,
    "a refused start": refuse(CommandRejectedError("StartMove", StartStatus.NOT_POSSIBLE, "is the motor power on?")),
    "a refused recovery": refuse(CommandRejectedError("AutomaticErrorRecovery", RecoveryStatus.REFLEX, "see")),
    "moving": lambda: require_ready(SupervisorStatus(phase="moving"), is_operator_overdue=False),
    "lost": lambda: require_ready(SupervisorStatus(phase="lost"), is_operator_overdue=False),
    "nobody there": lambda: require_ready(SupervisorStatus(phase="idle", q_c=MODEL.home), is_operator_overdue=True),
    "no robot there": robot_at_closed_port,
    "a file of nothing": lambda: Program.from_json(b"", "bad.json"),
    "a file of bytes": lambda: Program.from_json(b"\xff\xfe", "bad.json"),
    "a file cut off": bad_file(lambda text: text[: len(text) // 2]),
    "a file with a number out of range": bad_file(lambda text: re.sub('"speed": [0-9.]+', '"speed": 8', text)),
    "a file with an unknown key": bad_file(lambda text: text.replace('"speed"', '"spede"')),
    "a file of another version": bad_file(lambda text: text.replace('"version": 1', '"version": 7')),
    "a file without an arm": bad_file(lambda text: text.replace('"model"', '"name"')),
    "a folder that is none": lambda: RunFile(Path("/dev/null/a.rcirun"), cycle_dtype(7), plan=None, model=MODEL),
    "a file with a key twice": bad_text('"start"', '"model": "xMatePro7", "start"'),
    "a file with a target of two": bad_text('"position"', '"q": [0, 0, 0, 0, 0, 0, 0], "position"'),
    "a file with half a pose": bad_file(lambda text: re.sub(r'"wxyz": \[[^]]*\], ', "", text, count=1)),
    "a file with a vector too long": bad_text('"position": [', '"position": [0.0, '),
    "a file with a strange type": bad_text('"type": "line"', '"type": "spline"'),
    "a file with a via for a line": bad_text('"position"', '"via": [0.1, 0.2, 0.3], "position"'),
    "an arm angle for 6 axes": lambda: load_model("xMate3").inverse(load_model("xMate3").forward(np.zeros(6)), psi=0.1),
    "a frame that is missing": lambda: program(Waypoint.line(moved(0.05), frame="托盘")).resolved({}),
    "a program in frames": lambda: plan_program(MODEL, program(Waypoint.line(moved(0.05), frame="托盘"))),
    "a signal without a cell": lambda: planned(Waypoint.set_output("灯")),
    "a signal that the cell lacks": lambda: Cell.example("pick_place").resolve(program(Waypoint.set_output("灯"))),
    "jaws without a cell": lambda: planned(Waypoint.use_tool("open")),
    "jaws that the cell lacks": lambda: Cell(model=MODEL.name).resolve(program(Waypoint.use_tool("open"))),
    "an end without a block": lambda: planned(Waypoint.end()),
    "a block without an end": lambda: planned(Waypoint.repeat(2)),
    "a program without a motion": lambda: planned(Waypoint.comment("")),
    "no whole number of repetitions": lambda: Waypoint.repeat(0),
    "a level that is none": lambda: Waypoint.set_output(0, 2),
    "repetitions that end apart": lambda: planned(Waypoint.repeat(2, until=0), Waypoint.retreat(0.01), Waypoint.end()),
    "a free motion without a cell": lambda: planned(Waypoint.free(HOME + 0.1)),
    "a frame of angles": lambda: Waypoint.joint(HOME, frame="托盘"),
    "a program for another arm": lambda: plan_program(load_model("xMatePro3"), program(Waypoint.line(moved(0.05)))),
    "a speed of nothing": lambda: plan_joint(MODEL, HOME, HOME + 0.1, speed=0.0),
    "rounds without number": lambda: plan_program(MODEL, program(Waypoint.line(moved(0.05))), rounds=0),
    "a run of nothing": lambda: decode_run(b"", "bad.json"),
    "a run cut off": lambda: decode_run(MAGIC, "bad.json"),
    "a run that is not there": lambda: load_run("bad.json"),
    "a table of words": bad_samples("t,q1\n0,a\n"),
    "a table that goes back": bad_samples("t,q1,q2,q3,q4,q5,q6\n0,0,0,0,0,0,0\n0,0,0,0,0,0,0\n"),
    "a table without joints": bad_samples("t,x\n0,0\n"),
    "a table of nothing": bad_samples(""),
    "a refusal of the simulation port": refused_by_the_world,
    "another arm": other_arm,
    "too heavy a load": lambda: MODEL.with_load(Payload(mass=50.0)),
    "a missing pose": lambda: NamedPoseStore(MODEL, Path("/dev/null/none")).recall("bad"),
}


def require_chinese(said: str) -> None:
    """Fails where words of another language stand in a sentence, or numbers in other units than were chosen."""
    left = re.sub(NAMES, "", re.sub(r"[\w:/.]*127\.0\.0\.1[\w:/.]*|\S*bad\.(?:json|csv)|“[^”]*”", "", said))
    assert not re.search(r"[A-Za-z]{2,}", left), said
    assert not re.search(r"\d ?(?:°|mm)", said), said
    assert "{" not in said


@pytest.mark.parametrize("what", PROVOKED)
def test_what_goes_wrong_is_said_in_chinese(what):
    with pytest.raises(RcilabError) as caught:
        PROVOKED[what]()
    told = explain_error(caught.value)
    require_chinese(Text("zh", Units(angle="rad", length="m")).render(told))
    for language, stop in (("zh", "。"), ("en", ".")):
        for code in ("notice.refused", "ready.setup_refused", "ready.control_refused", "learn.failed", "notice.error"):
            values = {"what": "x", "text" if code == "notice.error" else "error": told}
            said = Text(language, Units(angle="rad", length="m")).render(message(code, **values))
            assert said.endswith(stop), said
            assert not said.endswith(2 * stop), said


REASONS: dict[str, Remark] = {
    "a joint too fast": LimitViolation(RCI_CONDITIONS.find("joint.velocity"), 4, 2.3, 2.175).remark,
    "a tool too fast": LimitViolation(RCI_CONDITIONS.find("cartesian.velocity.translation"), 0, 2.3, 2.0).remark,
    "a tool outside": LimitViolation(RCI_CONDITIONS.find("cartesian.position"), 0, 0.02, 1e-3).remark,
    "no pose": LimitViolation(RCI_CONDITIONS.find("cartesian.frame"), 0, 2.0, 1.0).remark,
    "two at once": Remark.all([LimitViolation(RCI_CONDITIONS.find("joint.jerk"), 1, 9e3, 8e3).remark] * 2),
    "lost commands": lost_motion(Remark("x", "thrown", joint=2, value=9.0, bound=8.0, unit="rad/s^2"))
    .violations[0]
    .remark,
}


@pytest.mark.parametrize("what", REASONS)
def test_why_the_controller_stopped_is_said_in_chinese(what):
    status = WorldStatus(model="xMatePro7", plant="ideal", cycle=9, phase="reflex", reason=REASONS[what])
    _, back = decode_world_answer(encode_world_answer(status, 1))
    assert isinstance(back, WorldStatus)
    assert back.reason == REASONS[what], "the English sentence stays as it was"
    require_chinese(Text("zh", Units(angle="rad", length="m")).render(describe_note(back.reason)))


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_the_sources_of_limits_are_said_in_chinese(name):
    for source in load_model(name).limits.sources.values():
        assert re.search(r"[\u4e00-\u9fff]", explain_limit(source, "zh")), source
        assert explain_limit(source) == source


@pytest.mark.parametrize("typed", ["", "abc", "1,000", "9e99", "nan", "999"])
def test_bad_typed_numbers_are_answered_in_chinese(typed):
    problem = parse_number(typed, -170.0, 170.0, "deg").problem
    assert problem is not None
    assert not re.search(r"[A-Za-z]{4,}|°", Text("zh", Units(angle="rad")).render(problem))
    problem = parse_quaternion("1 2").problem
    assert problem is not None
    assert re.search(r"[\u4e00-\u9fff]", Text("zh").render(problem))


def test_exports_say_what_is_missing_in_chinese():
    error = MissingExtraError("mcap", "MCAP")
    said = Text("zh").render(message("export.missing", library=error.library))
    assert re.search(r"[\u4e00-\u9fff]", said)


def test_what_has_no_text_in_the_catalogues_keeps_its_english_sentence():
    said = explain_error(CertificateError("x")), explain_error(RcilabError("joint 1 is at 0.35 rad"))
    assert Text("zh").render(said[0]).startswith("未执行")
    assert Text("zh").render(said[1]) == "joint 1 is at 0.35 rad。"
