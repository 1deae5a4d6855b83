"""Every command of a session, as the protocol spells it, against a scripted controller on real sockets."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.errors import (
    CertificateError,
    CommandRejectedError,
    DeadlineError,
    InvalidValueError,
    ManualRecoveryError,
    UsageError,
)
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.driver.settings import RciSettings
from rcilab.motion import plan_joint
from tests.execution.peer import MODEL, Script, wave

REST = plan_joint(MODEL, MODEL.home, MODEL.home)


def test_every_command_reaches_the_controller_as_the_protocol_spells_it(make_robot):
    peer, robot = make_robot(Script(safety_stop=rci.SafetyStop.GSTOP))
    robot.power_on()
    assert robot.rci.motor_state() is True
    robot.rci.connect()
    box = SafetyBox(size=(1.0, 2.0, 3.0), T_base_box=Pose((0.0, 0.0, 1.0)), active=False)
    robot.rci.set_cartesian_limit(box)
    assert robot.safety_box is box
    robot.rci.set_joint_limit(MODEL.limits.joint.lower, MODEL.limits.joint.upper)
    robot.rci.set_collision_behavior(MODEL.limits.joint.collision_threshold)
    robot.rci.set_joint_impedance(MODEL.limits.joint.stiffness)
    robot.rci.set_cartesian_impedance([3000, 3000, 3000, 300, 300, 300])
    robot.rci.set_coor(Pose((0.0, 0.0, 0.1)))
    robot.set_load(1.0, [0.0, 0.0, 0.05], np.eye(3) * 0.01)
    robot.rci.set_cart_imp_desired_tau([1, 2, 3, 4, 5, 6])
    robot.rci.set_filters(100.0, 200.0, 300.0)
    robot.rci.set_torque_filter_cut_off_frequency(50.0)
    robot.rci.automatic_error_recovery()
    assert robot.rci.load_model().dh[2] == 404.0
    robot.rci.set_fc_coor(Pose(), rci.ForceFrame.WORLD)
    robot.rci.enable_virtual_guide(True)
    robot.rci.set_do(5, True)
    assert robot.rci.get_di(0) is True
    robot.rci.start_drag(rci.DragSpace.CARTESIAN, rci.DragType.TRANSLATION)
    robot.rci.stop_drag()
    assert robot.rci.safety_stop() is rci.SafetyStop.GSTOP
    robot.power_off()
    robot.rci.reboot()
    sent = [type(request) for request in peer.requests]
    assert set(sent) == set(rci.REQUESTS.values()) - {rci.StartMove, rci.StopMove}
    assert peer.requests[-2] == rci.SetMotorPower(0)
    with pytest.raises(UsageError, match="closed; connect again"):
        robot.power_on()


@pytest.mark.parametrize(
    ("call", "hint"),
    [
        (lambda r: r.rci.set_joint_impedance([1.0] * 6), r"needs \(7,\)"),
        (lambda r: r.rci.set_joint_impedance([np.nan] * 7), "finite"),
        (
            lambda r: r.rci.set_joint_impedance([1, 1, 1, 1, 1, 1, 301]),
            r"stiffness, joint 7: 301.0 is outside 0 to 300 \[N m/rad\]",
        ),
        (lambda r: r.rci.set_cartesian_limit([1, 0, 1]), "must be a SafetyBox"),
        (lambda r: r.rci.set_joint_limit([1] * 7, [0] * 7), "below upper"),
        (lambda r: r.rci.set_filters(1001, 1, 1), "0.1 to 1000"),
        (lambda r: r.rci.set_do(6, True), "0 to 5"),
        (lambda r: r.set_load(-1, [0, 0, 0], np.eye(3)), "0 or more"),
        (lambda r: RciSettings.set_load(r.rci, 0, [0, 0, 0], np.eye(3)), "a load without mass has none"),
        (
            lambda r: r.set_load(0, [0, 0, 0], np.eye(3)),
            r"inertia must be zero: a load without mass has none, got \[\[1\.0, 0\.0, 0\.0\]",
        ),
        (lambda r: r.set_load(1, [0, 0, 10], np.eye(3)), r"10\.0 m from the flange is farther than 2 m; give metres"),
        (lambda r: r.set_load(100, [0, 0, 0], np.eye(3)), "load mass: 100.* kg is above 7 kg for xMatePro7"),
        (lambda r: r.rci.set_coor(None), "Pose"),
        (lambda r: r.rci.set_coor(Pose((0.0, 0.0, 99.0))), r"99\.0 m from the flange is farther than 2 m; give metres"),
        (
            lambda r: r.rci.set_cartesian_impedance([1, 1, 1, 1, 301, 1]),
            "about y: 301.0 is outside 0 to 300",
        ),
        (
            lambda r: r.rci.set_cart_imp_desired_tau([0, 0, -61, 0, 0, 0]),
            r"wrench, z: -61.0 is outside -60 to 60 \[N, N m\]",
        ),
        (lambda r: r.rci.set_collision_behavior([1, 1, 1, 1, 1, 1, 21]), r"joint 7: 21.0 is outside 0 to 20 \[N m\]"),
        (
            lambda r: r.rci.set_joint_limit([-3.0] * 7, [1] * 7),
            r"lower, joint 1: -3.0 is outside -2.9\d+ to 2.9\d+ \[rad\]",
        ),
        (lambda r: r.rci.set_torque_filter_cut_off_frequency(math.nan), r"frequency must be finite \[Hz\].*, got nan"),
        (lambda r: r.rci.set_fc_coor(Pose(), "flange"), "type: 'flange' is unknown; known: 'world', 'tool', 'path'"),
        (lambda r: r.rci.set_fc_coor(None), "must be a Pose"),
        (lambda r: r.rci.start_drag("elbow"), "space: 'elbow' is unknown; known: 'joint', 'cartesian'"),
        (lambda r: r.rci.enable_virtual_guide("off"), "True or False"),
        (lambda r: r.receive_state(max_age=-1), "max_age must not be below 0.*, got -1"),
        (lambda r: r.control(None, cut_off=0.0), "cut_off must be above 0.*, got 0.0"),
        (lambda r: r.control(None, rate_limit="mine"), "'mine' is unknown; known: manual, sdk"),
        (lambda r: r.control(None, mode="velocity"), "mode: 'velocity' is unknown; known: joint_position"),
        (lambda r: r.rci.set_motor_power("no"), "True or False"),
        (lambda r: r.receive_state(0), "timeout must be above 0.*, got 0"),
        (lambda r: r.execute(None), "motion must be a motion.*, got None"),
        (lambda r: r.execute(REST, check(REST, MODEL)), r"pass report\.certificate, not the report"),
    ],
)
def test_a_bad_argument_is_named_and_not_sent(make_robot, call, hint):
    peer, robot = make_robot()
    with pytest.raises(InvalidValueError, match=hint):
        call(robot)
    assert peer.requests == [rci.LoadRobotModel()]  # Asked by connect.


def test_a_refusal_says_what_to_do(make_robot):
    _, robot = make_robot(Script(statuses={rci.StartMove: rci.StartStatus.NOT_POSSIBLE}))
    with pytest.raises(CommandRejectedError, match="no such pair of modes, or still moves") as caught:
        robot.control(wave(10))
    assert caught.value.status is rci.StartStatus.NOT_POSSIBLE


def test_a_missing_answer_is_a_deadline_error_and_the_session_goes_on(make_robot):
    _, robot = make_robot(Script(silent_requests=(rci.SetDO,)))
    with pytest.raises(DeadlineError, match=r"did not answer SetDO within 1 s"):
        robot.rci.set_do(0, True)
    assert robot.rci.motor_state() is True


def test_split_and_stale_answers_are_put_together_and_told_apart(make_robot):
    _, robot = make_robot(Script(split_responses=True, stale_responses=True))
    assert robot.rci.motor_state() is True
    assert robot.rci.load_model().dh[2] == 404.0
    assert robot.rci.motor_state() is True


@pytest.mark.parametrize(
    "change", [lambda r: r.rci.set_coor(Pose((0.0, 0.0, 0.1))), lambda r: r.set_load(2, [0, 0, 0], np.eye(3))]
)
def test_another_tool_or_load_makes_a_certificate_stale(make_robot, change):
    peer, robot = make_robot()
    rest = plan_joint(robot.model, peer.script.q, peer.script.q)
    certificate = check(rest, robot.model).certificate
    change(robot)
    with pytest.raises(CertificateError, match=r"checked with another (tool|load) than the arm has"):
        robot.execute(rest, certificate)
    assert robot.execute(rest, check(rest, robot.model).certificate).stopped is None


def test_a_refused_tool_leaves_the_model_as_it_is(make_robot):
    _, robot = make_robot(Script(statuses={rci.SetCoor: rci.SettingStatus.INVALID_ARGUMENT}))
    before = robot.model.fingerprint
    with pytest.raises(CommandRejectedError):
        robot.rci.set_coor(Pose((0.0, 0.0, 0.1)))
    assert robot.model.fingerprint == before


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (rci.RecoveryStatus.NOT_POSSIBLE, "not possible; the arm still moves: try again at standstill"),
        (
            rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED,
            "manual recovery needed; the arm is too far outside its soft limits or its safety box",
        ),
        (rci.RecoveryStatus.REFLEX, "reflex; the cause is still there"),
        (rci.RecoveryStatus.USER_STOP, "user stop; an emergency stop is pressed: release it first"),
        (rci.RecoveryStatus.ABORTED, "aborted; something ended it half-way"),
    ],
)
def test_every_refusal_of_a_recovery_has_its_words(make_robot, status, words):
    _, robot = make_robot(Script(statuses={rci.AutomaticErrorRecovery: status}))
    with pytest.raises(CommandRejectedError, match=f"AutomaticErrorRecovery was refused: {words}") as caught:
        robot.recover()
    assert caught.value.status is status
    assert isinstance(caught.value, ManualRecoveryError) is (status is rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED)


@pytest.mark.parametrize(
    ("stop", "words"),
    [
        (rci.SafetyStop.ESTOP, "an emergency stop is pressed: release it first"),
        (rci.SafetyStop.GSTOP, "the safety gate is open: close it first"),
    ],
)
def test_a_refusal_as_not_possible_asks_the_controller_for_its_reason(make_robot, stop, words):
    statuses = {rci.SetFilters: rci.SettingStatus.NOT_POSSIBLE}
    _, robot = make_robot(Script(statuses=statuses, safety_stop=stop))
    with pytest.raises(CommandRejectedError, match=f"SetFilters was refused: not possible; {words}") as caught:
        robot.rci.set_filters(100, 100, 100)
    assert caught.value.facts["status"] == stop.name.lower()


def test_a_reason_that_cannot_be_asked_for_does_not_replace_the_refusal(make_robot):
    statuses = {rci.SetFilters: rci.SettingStatus.NOT_POSSIBLE}
    _, robot = make_robot(Script(statuses=statuses, silent_requests=(rci.GetSafetyStopState,)))
    with pytest.raises(CommandRejectedError, match="SetFilters was refused: not possible"):
        robot.rci.set_filters(100, 100, 100)


@pytest.mark.parametrize("name", ["joint", "cartesian"])
def test_names_will_do_for_enumerations(make_robot, name):
    peer, robot = make_robot()
    robot.rci.start_drag(name, "rotation")
    robot.rci.set_fc_coor(Pose(), "path")
    assert peer.requests[-2] == rci.StartDrag(rci.DragSpace[name.upper()], rci.DragType.ROTATION)
    assert peer.requests[-1].type == rci.ForceFrame.PATH


def test_completion_finds_the_commands_of_the_protocol(make_robot):
    _, robot = make_robot(Script())
    assert "rci" in dir(robot)
    assert robot.rci.n == robot.n
