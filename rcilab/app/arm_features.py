"""What an arm lacks, as page and notebook explain it next to a disabled control."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import Message
from rcilab.makers.maker import Feature, capabilities_of, find_missing_feature

if TYPE_CHECKING:
    from rcilab.app.run.plan_readiness import ArmStatus
    from rcilab.core.arrays import JointVector
    from rcilab.makers.configuration import SetupPart
    from rcilab.model.robot_model import RobotModel


def explain_missing_feature(model: RobotModel, feature: Feature) -> Message | None:
    """Returns what an arm lacks for a feature and why; None if it has the feature."""
    missing = find_missing_feature(model, feature)
    if missing is None:
        return None
    sentence = describe_error(missing)
    assert isinstance(sentence, Message)  # Every missing feature has an error code.
    return sentence


def explain_missing_part(model: RobotModel, part: SetupPart) -> Message | None:
    """Returns why a part of the configuration cannot be changed; None if it can.

    An arm for which motions are only planned has all parts: its plans and checks use them.
    """
    return None if is_only_planned(model) else explain_missing_feature(model, part)


def explain_missing_robot(model: RobotModel, *, is_virtual: bool) -> Message | None:
    """Returns why no motion of an arm can run at the virtual controller, or at an address; None if one can."""
    return explain_missing_feature(model, "simulation" if is_virtual else "driving")


def is_only_planned(model: RobotModel) -> bool:
    """Returns whether an arm can be planned for, checked and drawn, but neither simulated nor driven."""
    capabilities = capabilities_of(model)
    return not (capabilities.simulates or capabilities.drives)


def start_of_plans(model: RobotModel, status: ArmStatus) -> JointVector | None:
    """Returns where a plan begins, the commanded joint angles, [rad], shape (n,); None if they are unknown.

    The plans of an arm for which motions are only planned begin at its home pose.
    """
    return model.home if is_only_planned(model) else status.q_c


def has_zero_pose(model: RobotModel) -> bool:
    """Returns whether all joints can be at 0."""
    joint = model.limits.joint
    return bool(((joint.lower < 0.0) & (joint.upper > 0.0)).all())
