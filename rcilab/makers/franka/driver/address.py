"""The address of a Franka controller. Its ports are fixed in the maker's client library, so it is a host."""

from __future__ import annotations

from rcilab.makers.address import ControllerAddress, parse_controller_address
from rcilab.makers.franka.bounds import CLIENT_PORT


def parse_address(text: str) -> ControllerAddress:
    """Returns the parts of a robot's address.

    Args:
        text: `fci://HOST`; the port may be given, but clients only connect to 1337.

    Raises:
        InvalidValueError: It is not such an address; the message names the wrong part.
    """
    return parse_controller_address(
        text,
        scheme="fci",
        port=CLIENT_PORT,
        example="fci://172.16.0.2",
        ignored=("hand_port", "udp_port"),
        is_port_fixed=True,
    )
