"""The route to a controller's host; common to all drivers."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rcilab.core.errors import ConnectionLostError

if TYPE_CHECKING:
    from rcilab.makers.driver import RobotAddress

RECEIVE_BUFFER = 1 << 20  # [bytes] For about 0.4 s of states; the kernel may grant less.


@dataclass(frozen=True, slots=True)
class HostRoute:
    """The two ends of the route to a controller, as IPv4 addresses."""

    host: str
    local: str
    """Our address on this route, as chosen by the kernel."""


def find_route(address: RobotAddress) -> HostRoute:
    """Returns the addresses of a connection to a controller; nothing is sent except for a name lookup.

    Raises:
        ConnectionLostError: The host name has no address, or no network of ours leads there.
    """
    try:
        found = socket.getaddrinfo(address.host, address.port, socket.AF_INET, socket.SOCK_STREAM)[0][4][0]
    except OSError as error:
        raise ConnectionLostError(
            f"{address}: the host {address.host!r} is not known ({_reason(error)}); "
            "check its spelling, or write the IP address that the controller shows"
        ).coded("unknown_host", host=address.host) from error
    host = str(found)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((host, address.port))  # Sends nothing: the kernel chooses the source address.
            return HostRoute(host, str(probe.getsockname()[0]))
        except OSError as error:
            raise ConnectionLostError(
                f"{address}: no network of this computer leads to {host} ({_reason(error)}); check the cable and "
                "that this computer has an address in the robot's network"
            ).coded("no_network", host=host) from error


def no_robot_error(
    address: RobotAddress, error: OSError, spent: float, timeout: float, advice: str
) -> ConnectionLostError:
    """Returns the error of an address at which no controller accepts a connection.

    Args:
        address: The address.
        error: Why there is no connection.
        spent: Time until then, [s].
        timeout: Timeout of the connection, [s].
        advice: What to check, and how a virtual controller is started.
    """
    is_late = isinstance(error, TimeoutError)
    reason = (
        f"did not answer within {timeout:g} s" if is_late else f"{_reason(error)} after {spent:.1f} s of {timeout:g} s"
    )
    return ConnectionLostError(f"no robot at {address} ({reason}); {advice}").coded("no_robot", address=str(address))


def _reason(error: OSError) -> str:
    return error.strerror or str(error)
