import pytest

from rcilab.conformance import CONDITIONS, CYCLE_CONDITIONS, find_condition
from rcilab.errors import InvalidValueError
from rcilab.faults import Fault
from rcilab.model import load_model

LIMITS = load_model("xMatePro3").limits.joint


def test_the_necessary_conditions_are_the_manuals_with_their_faults():
    table = {row.id: (row.formula, row.fault, row.unit) for row in CONDITIONS if row.necessity == "necessary"}
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


def test_the_recommended_conditions_ask_for_rest_at_both_ends_and_raise_nothing():
    recommended = [row for row in CONDITIONS if row.necessity == "recommended"]
    assert [row.id for row in recommended] == [
        "start.position",
        "start.velocity",
        "start.acceleration",
        "end.velocity",
        "end.acceleration",
    ]
    assert all(row.fault is None for row in recommended)


def test_the_bounds_come_from_the_limits_of_the_arm():
    lower, upper = find_condition("joint.position").bounds(LIMITS)
    assert (lower is LIMITS.lower, upper is LIMITS.upper) == (True, True)
    for name in ("velocity", "acceleration", "jerk"):
        lower, upper = find_condition(f"joint.{name}").bounds(LIMITS)
        assert upper.tolist() == getattr(LIMITS, name).tolist()
        assert lower.tolist() == (-upper).tolist()


def test_every_condition_names_its_source_and_the_manuals_section():
    assert all("4.1" in row.source for row in CONDITIONS)
    assert all("4.4" in row.source for row in CYCLE_CONDITIONS)


def test_an_unknown_condition_lists_those_that_exist():
    with pytest.raises(InvalidValueError, match=r"joint\.speed.*joint\.velocity"):
        find_condition("joint.speed")
