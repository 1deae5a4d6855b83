import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.makers.rokae.conditions import RCI_CONDITIONS, RCI_JOINT_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model

ARM = load_model("xMatePro3").limits
LIMITS = ARM.joint
OWN_ROWS = [row for row in RCI_CONDITIONS.conditions if row.is_clearance]


def test_the_necessary_conditions_on_joints_are_the_manuals_with_their_faults():
    table = {row.id: (row.formula, row.fault, row.unit) for row in RCI_JOINT_CONDITIONS}
    assert table == {
        "joint.position": ("q_min < q_c < q_max", Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION, "rad"),
        "joint.velocity": ("-dq_max < dq_c < dq_max", Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION, "rad/s"),
        "joint.acceleration": (
            "-ddq_max < ddq_c < ddq_max",
            Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION,
            "rad/s^2",
        ),
        "joint.jerk": ("-dddq_max < dddq_c < dddq_max", Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY, "rad/s^3"),
    }


def test_all_twenty_faults_are_explained_by_the_rows_that_the_manual_names_them_after():
    rows = {int(fault): {row.id for row in RCI_CONDITIONS.raising(fault)} for fault in Fault}
    kinds = ("translation", "rotation")
    assert rows == {
        0: {"measured.joint.position"},
        1: {"measured.cartesian.position"},
        2: {"measured.arm_angle.velocity"},
        3: {"measured.joint.velocity"},
        4: {f"measured.cartesian.velocity.{kind}" for kind in kinds},
        5: {"measured.joint.acceleration"},
        6: {f"measured.cartesian.acceleration.{kind}" for kind in kinds},
        7: {"joint.position"},
        8: {"cartesian.position"},
        9: {f"arm_angle.{name}" for name in ("position", "velocity", "acceleration", "jerk")},
        10: {"joint.velocity"},
        11: {f"cartesian.velocity.{kind}" for kind in kinds},
        12: {"joint.acceleration"},
        13: {f"cartesian.{name}.{kind}" for name in ("acceleration", "jerk") for kind in kinds},
        14: {"joint.jerk"},
        15: {"external.torque"},
        16: {"cartesian.frame"},
        17: {"torque.rate"},
        18: {"torque.range"},
        19: {"lost.commands"},
    }


def test_a_condition_of_the_manual_is_necessary_exactly_when_it_raises_a_fault():
    assert all(
        (row.fault is not None) == (row.necessity == "necessary")
        for row in RCI_CONDITIONS.conditions
        if row not in OWN_ROWS
    )
    assert len({row.id for row in RCI_CONDITIONS.conditions}) == len(RCI_CONDITIONS.conditions)


def test_the_recommended_conditions_ask_for_bearable_torques_and_rest_at_both_ends():
    assert [row.id for row in RCI_CONDITIONS.motion if row.necessity == "recommended"] == [
        "joint.torque",
        "joint.torque_rate",
        "start.position",
        "start.velocity",
        "start.acceleration",
        "end.velocity",
        "end.acceleration",
    ]


@pytest.mark.parametrize("name", ["xMatePro3", "xMate7"])
def test_every_row_has_one_pair_of_bounds_a_joint_or_one_for_the_tool(name):
    limits = load_model(name).limits
    for row in RCI_CONDITIONS.conditions:
        lower, upper = row.bounds(limits)
        n = len(limits.joint.velocity) if row.is_per_joint else 1
        assert lower.shape == upper.shape == (n,), row.id
        assert (lower < upper).all(), row.id


def test_the_tools_bounds_are_the_manuals_numbers():
    bounds = {
        row.id: float(row.bounds(ARM)[1][0])
        for row in RCI_CONDITIONS.conditions
        if row.signal in ("translation", "rotation") and row.stage == "throughout" and not row.is_measured
    }
    assert bounds == {
        "cartesian.velocity.translation": 1.0,
        "cartesian.velocity.rotation": 2.5,
        "cartesian.acceleration.translation": 10.0,
        "cartesian.acceleration.rotation": 10.0,
        "cartesian.jerk.translation": 5000.0,
        "cartesian.jerk.rotation": 5000.0,
    }


def test_measured_bounds_leave_a_servo_room_over_the_commanded_ones_and_say_so():
    for row in (row for row in RCI_CONDITIONS.conditions if row.is_measured):
        assert "allowance" in row.source, row.id
        commanded = row.id.removeprefix("measured.")
        if row.order > 0:
            factor = row.bounds(ARM)[1] / RCI_CONDITIONS.find(commanded).bounds(ARM)[1]
            assert factor.tolist() == pytest.approx([(1.1, 3.5)[row.order - 1]] * len(factor)), row.id


def test_conditions_on_the_tool_need_all_limits():
    with pytest.raises(InvalidValueError, match=r"must not be those of the joints only, .*; pass model\.limits"):
        RCI_CONDITIONS.find("cartesian.velocity.rotation").bounds(LIMITS)


def test_the_bounds_come_from_the_limits_of_the_arm():
    lower, upper = RCI_CONDITIONS.find("joint.position").bounds(LIMITS)
    assert (lower is LIMITS.lower, upper is LIMITS.upper) == (True, True)
    for name in ("velocity", "acceleration", "jerk"):
        lower, upper = RCI_CONDITIONS.find(f"joint.{name}").bounds(LIMITS)
        assert upper.tolist() == getattr(LIMITS, name).tolist()
        assert lower.tolist() == (-upper).tolist()


def test_what_no_controller_looks_at_raises_no_fault_and_says_that_it_is_ours():
    assert [(row.id, row.necessity, row.fault) for row in OWN_ROWS] == [
        ("clearance.links", "necessary", None),
        ("clearance.floor", "necessary", None),
        ("clearance.links.advised", "recommended", None),
        ("clearance.floor.advised", "recommended", None),
    ]
    assert all("rcilab's own, not the controller's" in row.source for row in OWN_ROWS)
    assert [row.bounds(ARM)[0].tolist() for row in OWN_ROWS] == [[0.0], [0.0], [0.02], [0.02]]


def test_every_condition_names_its_source_and_the_manuals_section():
    sections = {"throughout": "4.4", "start": "4.1", "end": "4.1"}
    assert all("manual V1.3.1, " in row.source for row in RCI_CONDITIONS.conditions if row not in OWN_ROWS)
    assert all(sections[row.stage] in row.source for row in RCI_CONDITIONS.motion)


def test_an_unknown_condition_lists_those_that_exist():
    with pytest.raises(InvalidValueError, match=r"joint\.speed.*joint\.velocity"):
        RCI_CONDITIONS.find("joint.speed")
