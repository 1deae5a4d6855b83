"""What the last cycles show of a fault: facts for user interfaces, in either language, across processes too."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from rcilab.app.goal.goal import goal_at
from rcilab.app.run.robot_requests import Outcome
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.store import UiState
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.control_process.messages import as_sendable
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import ControlError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode
from rcilab.i18n import translator
from rcilab.i18n.error_messages import describe_note
from rcilab.makers.rokae.driver.fault_report import describe_faults
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.notebook.status_texts import outcome_html as notebook_outcome
from rcilab.recording.run import build_run
from rcilab.workbench.panels.outcome import outcome_html

MODEL = load_model("xMatePro7")


def cycles(count: int = 12) -> np.ndarray:
    rows = np.zeros(count, cycle_dtype(7))
    rows["t"] = np.arange(count) * 1e-3
    rows["sent_ns"] = rows["message_id"] = np.arange(1, count + 1)
    rows["q"] = rows["q_c"] = rows["command"] = MODEL.home
    for field in ("command_pose", "command_psi", "command_tau"):
        rows[field] = np.nan
    rows["T_base_tool"] = np.eye(4)
    return rows


def leap(rows: np.ndarray) -> None:
    rows["command"][6:, 1] += 0.01


def press(rows: np.ndarray) -> None:
    rows["tau_ext_in_base"] = [0.0, 90.0, 0.0, 0.0, 0.0, 0.0]


def lose(rows: np.ndarray) -> None:
    rows["success_rate"] = 0.75


def reach_the_end(rows: np.ndarray) -> None:
    rows["q_c"][:, 0] = MODEL.limits.joint.upper[0]


def leave_the_box(rows: np.ndarray) -> None:
    rows["T_base_tool"][-1, 0, 3] = 0.6


def follow_poses(rows: np.ndarray) -> None:
    """The state does not show yet where joint 3 leaps to; joint 5 is as fast as it may be."""
    rows["command"][6:, 2] += 0.01
    for row in rows:
        row["command_pose"], row["command_psi"] = MODEL.forward(row["command"]).matrix, MODEL.arm_angle(row["command"])
    rows["command"] = np.nan
    rows["q_c"][:, 4] += np.linspace(0.0, 0.02, len(rows))


def follow_filtered_poses(rows: np.ndarray) -> None:
    """The sent poses violate nothing: the controller's own angles do."""
    rows["command"] = np.nan
    rows["command_pose"] = MODEL.forward(MODEL.home).matrix
    rows["q_c"][:, 2] += np.linspace(0.0, 0.02, len(rows))


EXAMPLES = [
    (leap, Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION, "Joint velocity, joint 2: 573°/s passes 124.6°/s"),
    (press, Fault.COLLISION, "external torque"),
    (lose, Fault.INSTABILITY_DETECTION, "25 % of the last second's commands"),
    (reach_the_end, Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION, "Joint position, joint 1: 170.00°, allowed"),
    (leave_the_box, Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION, "100.0 mm past the +x face"),
    (follow_poses, Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION, "Joint velocity, joint 3: 573°/s passes 124.6°/s"),
    (
        follow_filtered_poses,
        Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,
        "joint 3 came nearest to a bound, Joint velocity",
    ),
]


def error_of(change, fault: Fault) -> ControlError:
    rows, box = cycles(), SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=Pose.from_matrix(np.eye(4)))
    change(rows)
    report = describe_faults((fault,), rows, 0.011, MODEL, MODEL.limits, ControllerMode.JOINT_POSITION, box=box)
    error = ControlError(report.sentence, (fault,), rows)
    error.finding = report.finding
    assert all(part in report.sentence for part in report.finding.parts)
    return error


@pytest.mark.parametrize(("change", "fault", "said"), EXAMPLES)
def test_page_and_notebook_say_joint_value_and_bound_of_a_fault(change, fault, said):
    error = pickle.loads(pickle.dumps(as_sendable(error_of(change, fault))))
    assert said in Text("en").render(describe_note(error.finding))
    assert "remark." not in Text("zh").render(describe_note(error.finding))
    rows = cycles()
    rows["faults"][-1] = 1 << fault
    run = build_run(rows, plan=None, stopped=str(error), model=MODEL)
    state = UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home), recording=whole_recording(run, finding=error.finding))
    page = outcome_html(state, SupervisorStatus(phase="fault", code="fault", faults=(fault,)), Text("en"))
    text = translator.Text("en", "rcilab.notebook")
    notebook = notebook_outcome(Outcome(what="execute", error=error), None, text)
    finding = text.render(describe_note(error.finding))
    assert said.replace("'", "&#x27;") in page
    assert finding.replace("'", "&#x27;") in notebook
