"""The address of a Franka controller. Its ports are fixed in the maker's client library, so it is a host."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.core.errors import InvalidValueError
from rcilab.makers.address import is_loopback, split_address
from rcilab.makers.franka.bounds import CLIENT_PORT

_KNOWN_OPTIONS = ("world_port", "hand_port", "udp_port")
"""The last two are in the address that a virtual controller prints; clients find these ports by themselves."""
_EXAMPLE = "fci://172.16.0.2"


@dataclass(frozen=True, slots=True, kw_only=True)
class FciAddress:
    """A parsed `fci://HOST[?world_port=W]`."""

    host: str
    world_port: int | None = None
    """Simulation port of a virtual controller; None: unknown, or a real robot."""

    @property
    def port(self) -> int:
        """TCP port of the controller."""
        return CLIENT_PORT

    @property
    def is_here(self) -> bool:
        """Whether it is a loopback address: a virtual controller on this machine."""
        return is_loopback(self.host)

    def __str__(self) -> str:
        option = "" if self.world_port is None else f"?world_port={self.world_port}"
        return f"fci://{self.host}:{self.port}{option}"


def parse_address(text: str) -> FciAddress:
    """Returns the parts of a robot's address.

    Args:
        text: `fci://HOST`; the port may be given, but clients only connect to 1337.

    Raises:
        InvalidValueError: It is not such an address; the message names the wrong part.
    """
    host, port, options = split_address(text, "fci", _EXAMPLE, _KNOWN_OPTIONS)
    if port not in (None, CLIENT_PORT):
        raise InvalidValueError(
            "address", text, f"has port {port}: clients of this interface connect to {CLIENT_PORT} only; leave it out"
        )
    return FciAddress(host=host, world_port=options.get("world_port"))
