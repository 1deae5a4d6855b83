"""What an arm lacks, as page and notebook say it beside a control that is off."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import Message
from rcilab.makers.maker import Feature, capabilities_of, find_lack

if TYPE_CHECKING:
    from rcilab.app.run.plan_readiness import ArmStatus
    from rcilab.core.arrays import JointVector
    from rcilab.makers.configuration import SetupPart
    from rcilab.model.robot_model import RobotModel


def tell_lack(model: RobotModel, feature: Feature) -> Message | None:
    """Returns what an arm lacks for a feature and why; None: it has it."""
    lack = find_lack(model, feature)
    if lack is None:
        return None
    said = describe_error(lack)
    assert isinstance(said, Message)  # Every lack has a code.
    return said


def tell_lack_of_part(model: RobotModel, part: SetupPart) -> Message | None:
    """Returns why a part of the configuration cannot be changed; None: it can.

    An arm that is only planned for can be given all of them: its plans and checks go by them.
    """
    return None if is_only_planned(model) else tell_lack(model, part)


def tell_lack_to_run(model: RobotModel, *, is_virtual: bool) -> Message | None:
    """Returns why no motion of an arm can be run at the virtual controller, or at an address; None: it can."""
    return tell_lack(model, "simulation" if is_virtual else "driving")


def is_only_planned(model: RobotModel) -> bool:
    """Returns whether an arm can be planned for, checked and drawn, but neither simulated nor driven."""
    capabilities = capabilities_of(model)
    return not (capabilities.simulates or capabilities.drives)


def start_of_plans(model: RobotModel, status: ArmStatus) -> JointVector | None:
    """Returns where a plan begins, [rad], shape (n,): where the arm is commanded to be; None: that is not known.

    The plans of an arm that is only planned for begin at its home.
    """
    return model.home if is_only_planned(model) else status.q_c
