"""The address of a UFACTORY controller. Its ports are fixed in the maker's client library, so it is a host."""

from __future__ import annotations

from rcilab.makers.address import ControllerAddress, parse_controller_address
from rcilab.makers.ufactory.bounds import CLIENT_PORT


def parse_address(text: str) -> ControllerAddress:
    """Returns the parts of a robot's address.

    Args:
        text: `xarm://HOST`; the port may be given, but clients only connect to 502.

    Raises:
        InvalidValueError: It is not such an address; the message names the wrong part.
    """
    return parse_controller_address(
        text, scheme="xarm", port=CLIENT_PORT, example="xarm://192.168.1.185", is_port_fixed=True
    )
