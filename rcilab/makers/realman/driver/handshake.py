"""The first request to a controller, without the client library, which does not name what is wrong at an address."""

from __future__ import annotations

import socket
import time

import msgspec

from rcilab.core.errors import ConnectionLostError, DecodeError, ModelError
from rcilab.makers.address import ControllerAddress
from rcilab.makers.network import HostRoute, find_route, no_robot_error
from rcilab.makers.realman.robots import ROBOTS
from rcilab.makers.realman.wire.identity import arm_of_product
from rcilab.makers.realman.wire.line import LineReader, encode_answer

_ADVICE = (
    "check that the arm is switched on, that IP address and port are those of its teach pendant, and the cable; a "
    "virtual one is started with, for example: rcilab controller --model RM65"
)


def find_arm(address: ControllerAddress, timeout: float) -> tuple[str, HostRoute]:
    """Returns the name of the arm at an address, and the route to its controller.

    Args:
        address: Address of the controller.
        timeout: For the connection and for the answer, [s].

    Raises:
        ConnectionLostError: No controller answers.
        ModelError: It has an arm that rcilab does not know.
    """
    route = find_route(address)
    start = time.monotonic()
    try:
        link = socket.create_connection((route.host, address.port), timeout)
    except OSError as error:
        raise no_robot_error(address, error, time.monotonic() - start, timeout, _ADVICE) from error
    with link:
        try:
            version = _read_version(link)
        except (OSError, DecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise ConnectionLostError(
                f"what answers at {address} is not a controller of a RealMan arm, or it is not ready yet ({reason}); "
                "check the address, and connect again"
            ) from error
    name = arm_of_product(version)
    if name is None:
        raise ModelError(
            f"the controller at {address} has an arm that rcilab does not know ({version!r}); it drives "
            f"{', '.join(ROBOTS)}"
        )
    return name, route


def _read_version(link: socket.socket) -> str:
    link.sendall(encode_answer({"command": "get_arm_software_info"}))
    reader = LineReader()
    while True:
        received = link.recv(4096)
        if not received:
            raise ConnectionResetError("it closed the connection")
        for line in reader.feed(received):
            version = _version_of(line)
            if version is not None:
                return version


def _version_of(line: bytes) -> str | None:
    """Returns the arm's version, or None for the line of another answer."""
    try:
        content = msgspec.json.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DecodeError(f"no valid JSON: {error}") from error
    version = content.get("Product_version") if isinstance(content, dict) else None
    return version if isinstance(version, str) else None
