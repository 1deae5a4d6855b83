"""What a person can provoke by ordinary use of the page is answered in the page's language, in its units."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rcilab.client.address import RobotAddress
from rcilab.client.start_check import describe_start_mismatch
from rcilab.client.transport import SocketTransport
from rcilab.conformance import check
from rcilab.cycle_file import cycle_dtype
from rcilab.errors import CertificateError, CommandRejectedError, RcilabError, UsageError
from rcilab.model import load_model
from rcilab.motion import Program, Waypoint, plan_joint, plan_line, plan_program
from rcilab.motion.pose_book import PoseBook
from rcilab.motion.program_file import read_program
from rcilab.protocols.rci import RecoveryStatus, StartStatus
from rcilab.recording.extra import MissingExtraError
from rcilab.recording.run_file import RunFile
from rcilab.spatial import Pose
from rcilab.supervisor import SupervisorStatus
from rcilab.supervisor.admission import require_ready
from rcilab.words.number import parse_number, parse_quaternion
from rcilab.words.units import Units
from rcilab.workbench.telling import tell_error
from rcilab.workbench.text import Text, message

MODEL = load_model("xMatePro7")
HOME = np.array(MODEL.home)
NAMES = r"xMatePro7|RCI|IP|UDP|URDF|JSON|UTF|StartMove|AutomaticErrorRecovery|rcilab|speed|rad|mm|deg|rci|[xyzw]\b|MB"
"""What is called the same in every language: names of arms, protocols and keys, units."""


def moved(x: float, y: float = 0.0, z: float = 0.0) -> Pose:
    T = MODEL.forward(HOME)
    return Pose(T.position + [x, y, z], T.wxyz)


def program(*waypoints: Waypoint) -> Program:
    return Program(model=MODEL.name, start=tuple(HOME.tolist()), waypoints=waypoints)


def bad_file(change: Callable[[str], str]) -> Callable[[], object]:
    text = program(Waypoint.line(moved(0.05))).to_json()
    return lambda: read_program(change(text).encode(), "bad.json")


def closed_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def refuse(error: RcilabError) -> Callable[[], object]:
    def act() -> None:
        raise error

    return act


def start_elsewhere() -> None:
    mismatch = describe_start_mismatch(HOME + 0.1, HOME)
    assert mismatch is not None
    raise UsageError(mismatch).coded("elsewhere")


def stale() -> None:
    motion = plan_joint(MODEL, HOME, HOME + 0.1)
    certificate = check(motion, MODEL, distance=None).certificate
    assert certificate is not None
    certificate.verify(motion, MODEL, HOME + 0.2)


def robot_at_closed_port() -> None:
    address = RobotAddress(host="127.0.0.1", port=closed_port())
    SocketTransport(address, 1024, 1.0)


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
    "a file of nothing": lambda: read_program(b"", "bad.json"),
    "a file of bytes": lambda: read_program(b"\xff\xfe", "bad.json"),
    "a file cut off": bad_file(lambda text: text[: len(text) // 2]),
    "a file with a number out of range": bad_file(lambda text: re.sub('"speed": [0-9.]+', '"speed": 8', text)),
    "a file with an unknown key": bad_file(lambda text: text.replace('"speed"', '"spede"')),
    "a file of another version": bad_file(lambda text: text.replace('"version": 1', '"version": 7')),
    "a file without an arm": bad_file(lambda text: text.replace('"model"', '"name"')),
    "a folder that is none": lambda: RunFile(Path("/dev/null/a.rcirun"), cycle_dtype(7), plan=None, model=MODEL),
    "a missing pose": lambda: PoseBook(MODEL, Path("/dev/null/none")).recall("bad"),
}


@pytest.mark.parametrize("what", PROVOKED)
def test_what_goes_wrong_is_said_in_chinese(what):
    with pytest.raises(RcilabError) as caught:
        PROVOKED[what]()
    said = Text("zh", Units(angle="rad", length="m")).say(tell_error(caught.value))
    left = re.sub(NAMES, "", re.sub(r"[\w:/.]*127\.0\.0\.1[\w:/.]*|bad\.json|“[^”]*”", "", said))
    assert not re.search(r"[A-Za-z]{2,}", left), said
    assert not re.search(r"\d ?(?:°|mm)", said), said
    assert "{" not in said


@pytest.mark.parametrize("typed", ["", "abc", "1,000", "9e99", "nan", "999"])
def test_bad_typed_numbers_are_answered_in_chinese(typed):
    problem = parse_number(typed, -170.0, 170.0, "deg").problem
    assert problem is not None
    assert not re.search(r"[A-Za-z]{4,}|°", Text("zh", Units(angle="rad")).say(problem))
    problem = parse_quaternion("1 2").problem
    assert problem is not None
    assert re.search(r"[\u4e00-\u9fff]", Text("zh").say(problem))


def test_exports_say_what_is_missing_in_chinese():
    error = MissingExtraError("mcap", "MCAP")
    said = Text("zh").say(message("export.missing", library=error.library))
    assert re.search(r"[\u4e00-\u9fff]", said)


def test_what_has_no_words_keeps_its_english_in_the_units_of_the_page():
    said = tell_error(CertificateError("x")), tell_error(RcilabError("joint 1 is at 0.35 rad"))
    assert Text("zh").say(said[0]).startswith("未执行")
    assert Text("zh").say(said[1]) == "joint 1 is at 20.1°。"
