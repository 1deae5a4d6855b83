import pytest

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.limit_violation import faults_of
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.conditions import RCI_TOOL_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.limit_tables import cartesian_limits
from rcilab.model.robot_model import load_model

LIMITS = load_model("xMatePro7").limits


def test_the_manuals_table_is_the_arms_own():
    assert cartesian_limits(LIMITS) is LIMITS
    assert cartesian_limits(LIMITS, "manual") is LIMITS


def test_the_sdks_table_changes_the_three_numbers_of_its_rate_limiter_and_their_sources():
    sdk = cartesian_limits(LIMITS, "sdk")
    names = ("translation_velocity", "rotation_acceleration", "rotation_jerk")
    assert [getattr(sdk.cartesian, name) for name in names] == [1.5, 25.0, 12500.0]
    same = set(LIMITS.cartesian.__slots__) - set(names)
    assert all(getattr(sdk.cartesian, name) == getattr(LIMITS.cartesian, name) for name in same)
    assert {sdk.source(f"cartesian.{name}") for name in names} == {"vendor SDK, rate limiter"}
    assert sdk.source("joint.velocity") == LIMITS.source("joint.velocity")
    assert (sdk.joint, sdk.arm_angle) == (LIMITS.joint, LIMITS.arm_angle)


def test_a_tool_between_the_two_tables_is_too_fast_for_the_manual_only():
    for table, expected in (("manual", True), ("sdk", False)):
        monitor = CartesianMonitor(cartesian_limits(LIMITS, table), rows=RCI_TOOL_CONDITIONS)
        x = [0.00125 * (cycle + 1) for cycle in range(5)]  # 1.25 m/s, coming along.
        played = [
            faults_of(monitor.step(Pose.from_parts((1, 0, 0, 0, 1, 0, 0, 0, 1), (value, 0.0, 0.0)))) for value in x
        ]
        assert (Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION in played[-1]) is expected


def test_an_unknown_table_lists_those_that_exist():
    with pytest.raises(InvalidValueError, match="limit table: 'fci' is unknown; known: manual, sdk"):
        cartesian_limits(LIMITS, "fci")
