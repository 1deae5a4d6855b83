"""The checks of a new connection: the right arm at the other end, and states that arrive."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.errors import CommandRejectedError, ConnectionLostError
from rcilab.core.spatial import IDENTITY, as_pose, rotation_between
from rcilab.makers.rokae.driver.address import RciAddress
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.makers.rokae.driver.connection import RciConnection
from rcilab.makers.rokae.driver.identify import Lengths, require_same_arm

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_SAME_TOOL = 1e-3  # [m], [rad] The accuracy of the arm's own geometry.


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
    """Returns the model with the tool in the controller's state; warns if that is another one.

    Poses of a session with another tool than its controller's would be off by the difference.
    """
    state = link.latest
    assert state is not None  # `await_first_state` has seen one.
    flange = model.with_tool(IDENTITY).forward(state.q_c)
    tool = flange.inverse() @ as_pose(state.T_base_tool_c)
    mine = model.T_flange_tool
    off = float(np.linalg.norm(tool.position - mine.position))
    turned = math.hypot(*rotation_between(tool.parts[0], mine.parts[0]))
    if off < _SAME_TOOL and turned < _SAME_TOOL:
        return model
    if not mine.is_close(IDENTITY, 0.0):
        warnings.warn(
            f"the tool of {link.name} is {1e3 * off:.1f} mm and {math.degrees(turned):.1f} deg from the model's; the "
            "session goes on with the controller's. robot.set_tool(model.T_flange_tool), or connect(..., apply=True), "
            "sends the model's",
            stacklevel=5,
        )
    return model.with_tool(tool)
