"""What is asked of a new connection: a usable timeout, the right arm at the other end, and states that arrive."""

from __future__ import annotations

import math

from rcilab.client.address import RobotAddress
from rcilab.client.commands import RciCommands
from rcilab.client.identify import Lengths, require_same_arm
from rcilab.client.link import Link
from rcilab.errors import CommandRejectedError, ConnectionLostError, InvalidValueError


def require_timeout(timeout: object) -> None:
    """Makes sure that a timeout is a finite number above 0, [s].

    Raises:
        InvalidValueError: It is not.
    """
    is_number = isinstance(timeout, int | float) and not isinstance(timeout, bool) and math.isfinite(timeout)
    if not is_number:
        raise InvalidValueError("timeout", timeout, "must be a finite number above 0 [s]")
    if timeout <= 0:  # type: ignore[operator]  # A number, see above.
        raise InvalidValueError("timeout", timeout, "must be above 0 [s]")


def require_arm_there(commands: RciCommands, name: str, lengths: Lengths, address: str) -> None:
    """Makes sure that the controller moves this arm; one that serves no model is believed.

    Raises:
        ModelError: It is another arm; the message names both.
    """
    try:
        dh = commands.load_model().dh
    except CommandRejectedError:
        return
    require_same_arm(dh, name, lengths, address)


def await_first_state(link: Link, place: RobotAddress, local: tuple[str, int], timeout: float) -> None:
    """Returns once a state has arrived.

    Raises:
        ConnectionLostError: None has after `timeout`, [s].
    """
    if not link.poll(timeout):
        raise ConnectionLostError(
            f"{place} accepted the connection but sent no state to {local[0]}:{local[1]} within {timeout:g} s; check "
            "that the teach pendant's RCI page names this computer's address and that no firewall drops UDP; if the "
            "robot sends to another port of ours, add ?client_port=N to its address"
        ).coded("no_state", address=str(place), seconds=f"{timeout:g}")
