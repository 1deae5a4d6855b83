import pickle

import numpy as np
import pytest

from rcilab.conformance.certificate import require_certificate
from rcilab.conformance.check import check
from rcilab.conformance.start import StartState
from rcilab.core.clearance import STANDARD_DISTANCE, ClearanceLimit
from rcilab.core.errors import CertificateError, InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODEL = load_model("xMatePro7")
START = MODEL.home
MOTION = plan_joint(MODEL, START, -START)
CERTIFICATE = check(MOTION, MODEL).certificate
assert CERTIFICATE is not None


def changed(motion=MOTION, model=MODEL, start=START) -> set[str]:
    with pytest.raises(CertificateError) as caught:
        CERTIFICATE.verify(motion, model, start)
    assert all(name in str(caught.value) for name in caught.value.changed if name != "start state")
    return set(caught.value.changed)


def test_a_fresh_certificate_holds_for_what_was_judged():
    CERTIFICATE.verify(MOTION, MODEL, START)
    CERTIFICATE.verify(plan_joint(MODEL, START, -START), load_model("XMATEPRO7"), START.tolist())
    parts = {
        "motion",
        "model",
        "limits",
        "tool",
        "load",
        "safety box",
        "safety distance",
        "cell",
        "mode",
        "start state",
    }
    assert set(CERTIFICATE.parts) == {*parts, "start state"}


def test_it_names_what_changed():
    assert changed(motion=plan_joint(MODEL, START, -START, speed=0.51)) == {"motion"}
    assert changed(model=MODEL.with_tool(Pose((0.0, 0.0, 0.1)))) == {"tool"}
    assert changed(model=MODEL.with_load(Payload(mass=1.0, center_of_mass=(0.0, 0.0, 0.05)))) == {"load"}
    assert changed(model=load_model("xMatePro3")) == {"model"}
    assert changed(start=START + 1e-6) == {"start state"}
    assert changed(model=MODEL.with_tool(Pose((0.0, 0.0, 0.1))), start=START + 1.0) == {"tool", "start state"}


def test_a_nano_radian_off_is_the_same_start_and_a_micro_radian_is_not():
    CERTIFICATE.verify(MOTION, MODEL, START + 0.9e-9)
    with pytest.raises(CertificateError, match=r"joint 1 is commanded to .*plan it again from the arm's commanded"):
        CERTIFICATE.verify(MOTION, MODEL, START + np.array([1e-6, 0, 0, 0, 0, 0, 0]))


def test_an_arm_that_moves_is_another_start():
    assert changed(start=StartState(START, np.full(7, 0.1), np.zeros(7))) == {"start state"}
    CERTIFICATE.verify(MOTION, MODEL, StartState(START, np.full(7, -0.0), np.zeros(7)))


def test_a_motion_for_another_number_of_joints_is_another_motion():
    six = load_model("xMate7")
    assert "motion" in changed(plan_joint(six, six.home, -six.home), six, six.home)


def test_a_certificate_covers_the_safety_box_it_was_judged_with():
    box = SafetyBox(size=(4.0, 4.0, 4.0), T_base_box=Pose())
    covered = check(MOTION, MODEL, box=box).certificate
    covered.verify(MOTION, MODEL, START, SafetyBox(size=(4.0, 4.0, 4.0), T_base_box=Pose()))
    with pytest.raises(CertificateError, match=r"does not cover the safety box that is set.*box=") as caught:
        covered.verify(MOTION, MODEL, START, SafetyBox(size=(4.0, 4.0, 3.0), T_base_box=Pose()))
    assert caught.value.changed == ("safety box",)
    with pytest.raises(CertificateError, match="safety box"):
        CERTIFICATE.verify(MOTION, MODEL, START, box)


def test_a_box_that_bounds_nothing_needs_no_cover():
    covered = check(MOTION, MODEL, box=SafetyBox(size=(4.0, 4.0, 4.0), T_base_box=Pose())).certificate
    idle = SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=Pose(), active=False)
    for certificate in (covered, CERTIFICATE):
        certificate.verify(MOTION, MODEL, START)
        certificate.verify(MOTION, MODEL, START, idle)
    assert check(MOTION, MODEL, box=idle).certificate == CERTIFICATE


def test_a_certificate_covers_the_distances_it_was_judged_with():
    low_table = ClearanceLimit(floor_height=-0.4)
    covered = check(MOTION, MODEL, distance=low_table).certificate
    assert covered.digest != CERTIFICATE.digest
    for certificate in (covered, CERTIFICATE):  # Nobody asks for one of his own: any will do.
        certificate.verify(MOTION, MODEL, START)
    covered.verify(MOTION, MODEL, START, distance=ClearanceLimit(floor_height=-0.4))
    with pytest.raises(CertificateError, match="does not cover the required safety distance") as caught:
        covered.verify(MOTION, MODEL, START, distance=STANDARD_DISTANCE)
    assert caught.value.changed == ("safety distance",)


@pytest.mark.parametrize("distance", [None, STANDARD_DISTANCE])
def test_where_nobody_looked_for_collisions_no_hand_off_takes_the_certificate(distance):
    quick = check(MOTION, MODEL, distance=None).certificate
    with pytest.raises(CertificateError, match="collisions were not checked: check the motion again") as caught:
        quick.verify(MOTION, MODEL, START, distance=distance)
    assert caught.value.changed == ("safety distance",)


def test_a_report_that_is_not_ok_has_no_certificate():
    report = check(Motion.from_cycles(MOTION.q[:500]), MODEL)
    assert not report.ok
    assert report.certificate is None


def test_it_travels_between_processes():
    again = pickle.loads(pickle.dumps(CERTIFICATE))
    again.verify(pickle.loads(pickle.dumps(MOTION)), MODEL, START)
    assert again == CERTIFICATE
    assert again.digest == CERTIFICATE.digest


def test_what_is_no_certificate_is_refused_in_words():
    with pytest.raises(InvalidValueError, match=r"certificate: pass report\.certificate, not the report"):
        require_certificate(check(MOTION, MODEL))
    with pytest.raises(InvalidValueError, match="certificate must be a Certificate, got 'yes'; pass report"):
        require_certificate("yes")
    require_certificate(CERTIFICATE)
    require_certificate(None)
    with pytest.raises(InvalidValueError, match=r"use load_model\('xMatePro7'\)"):
        CERTIFICATE.verify(MOTION, "xMatePro7", START)
    with pytest.raises(InvalidValueError, match=r"motion must be a motion.*, got None"):
        CERTIFICATE.verify(None, MODEL, START)


def test_a_certificate_shows_itself_in_one_short_line():
    assert repr(CERTIFICATE) == f"<Certificate {CERTIFICATE.digest[:8]} for motion {MOTION.fingerprint[:8]}>"
