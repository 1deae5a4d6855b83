"""The address of a RealMan controller."""

from __future__ import annotations

from rcilab.makers.address import ControllerAddress, parse_controller_address
from rcilab.makers.realman.bounds import CLIENT_PORT


def parse_address(text: str) -> ControllerAddress:
    """Returns the parts of a robot's address; a `udp_port` is ignored: states go to a port of ours.

    Args:
        text: `realman://HOST[:PORT]`; without a port, that of the maker's clients.

    Raises:
        InvalidValueError: It is not such an address; the message names the wrong part.
    """
    return parse_controller_address(
        text, scheme="realman", port=CLIENT_PORT, example="realman://192.168.1.18", ignored=("udp_port",)
    )
