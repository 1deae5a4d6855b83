"""How the arm is driven: mode, its parameters, and the speed override."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from rcilab.app.run.mode_parameters import control_obstacle, find_group, is_control_pending
from rcilab.core.state import Mode
from rcilab.i18n.translator import Message
from rcilab.makers.configuration import ControllerParameters
from rcilab.makers.maker import parameters_of
from rcilab.makers.parameters import ParameterGroup

if TYPE_CHECKING:
    from rcilab.app.app_state import AppState
    from rcilab.app.state_store import StateStore
    from rcilab.control_process import SupervisorStatus
    from rcilab.model.robot_model import RobotModel

Destination = Literal["preview", "ideal", "mujoco", "address"]

DESTINATIONS: tuple[Destination, ...] = ("preview", "ideal", "mujoco", "address")


@dataclass(frozen=True, eq=False, kw_only=True)
class DriveState:
    """Settings of the execution of motions."""

    mode: Mode = "joint_position"
    control: ControllerParameters | None = None
    """All parameters as set by the operator; None: unchanged."""
    refusal: Message | None = None
    """Why the controller refused them."""
    speed_override: float = 1.0
    """Speed override, as a part of the planned speed."""
    override_refusal: Message | None = None
    """Why the motion in progress refused another speed override."""


def choose_mode(store: StateStore[AppState], mode: Mode) -> None:
    """Chooses the command mode; the plan is checked by the conditions of that mode."""
    state = store.state
    plan = None if state.plan is None else state.plan.completed(mode, state.cell_for(state.plan.model))
    store.update(drive=replace(state.drive, mode=mode), plan=plan)


def control_field(model: RobotModel, name: str) -> tuple[ParameterGroup, int] | None:
    """Returns group and index of a typed field, such as control.joint_stiffness.0; None: there is no such field."""
    _, part, index = (*name.split("."), "", "")[:3]
    group = find_group(parameters_of(model), part)
    if group is None or index not in map(str, range(len(group.parameters))):
        return None
    return group, int(index)


def is_pending(state: AppState, status: SupervisorStatus) -> bool:
    """Returns whether the controller has not accepted the parameters yet."""
    return is_control_pending(state.drive.control, status.setup.control)


def parameter_obstacle(state: AppState, status: SupervisorStatus) -> Message | None:
    """Returns why no motion may run with these parameters, or None if the controller has them."""
    address = None if state.target == "virtual" else state.target
    return control_obstacle(state.drive.control, status.setup.control, state.drive.refusal, address)


def destination(state: AppState, status: SupervisorStatus) -> Destination:
    """Returns where motions go now."""
    if status.phase == "closed":
        return "preview"
    return state.plant if state.target == "virtual" else "address"


def is_ours(status: SupervisorStatus) -> bool:
    """Returns whether the controller is our own, with a simulation port."""
    return status.world_address is not None
