"""The checks of a new connection: the right arm at the other end, and states that arrive."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import CommandRejectedError, ConnectionLostError
from rcilab.core.spatial import IDENTITY, as_pose
from rcilab.makers.known_setup import with_reported_tool
from rcilab.makers.rokae.driver.address import RciAddress
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.makers.rokae.driver.connection import RciConnection
from rcilab.makers.rokae.driver.identify import Lengths, require_same_arm

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel


def require_arm_there(commands: RciCommands, name: str, lengths: Lengths, address: str) -> None:
    """Checks that the controller has this arm; one that serves no model is accepted.

    Raises:
        ModelError: It is another arm; the message names both.
    """
    try:
        dh = commands.load_model().dh
    except CommandRejectedError:
        return
    require_same_arm(dh, name, lengths, address)


def await_first_state(link: RciConnection, address: RciAddress, local: tuple[str, int], timeout: float) -> None:
    """Returns once a state has arrived.

    Raises:
        ConnectionLostError: None has arrived after `timeout`, [s].
    """
    if not link.poll(timeout):
        raise ConnectionLostError(
            f"{address} accepted the connection but sent no state to {local[0]}:{local[1]} within {timeout:g} s; check "
            "that the teach pendant's RCI page names this computer's address and that no firewall drops UDP; if the "
            "robot sends to another port of this computer, add ?client_port=N to its address"
        ).coded("no_state", address=str(address), seconds=f"{timeout:g}")


def with_tool_of(link: RciConnection, model: RobotModel) -> RobotModel:
    """Returns the model with the tool in the controller's state; warns if that is another one."""
    state = link.latest
    assert state is not None  # `await_first_state` has seen one.
    flange = model.with_tool(IDENTITY).forward(state.q_c)
    return with_reported_tool(model, flange.inverse() @ as_pose(state.T_base_tool_c), link.name)
