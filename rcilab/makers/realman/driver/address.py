"""The address of a RealMan controller."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.makers.address import is_loopback, split_address
from rcilab.makers.realman.bounds import CLIENT_PORT

_EXAMPLE = "realman://192.168.1.18"
_KNOWN_OPTIONS = ("world_port", "udp_port")


@dataclass(frozen=True, slots=True, kw_only=True)
class RealManAddress:
    """A parsed `realman://HOST[:PORT][?world_port=W]`; a `udp_port` is ignored: states go to a port of ours."""

    host: str
    port: int = CLIENT_PORT
    world_port: int | None = None
    """Simulation port of a virtual controller; None: unknown, or a real robot."""

    @property
    def is_here(self) -> bool:
        """Whether it is a loopback address: a virtual controller on this machine."""
        return is_loopback(self.host)

    def __str__(self) -> str:
        option = "" if self.world_port is None else f"?world_port={self.world_port}"
        return f"realman://{self.host}:{self.port}{option}"


def parse_address(text: str) -> RealManAddress:
    """Returns the parts of a robot's address.

    Args:
        text: `realman://HOST[:PORT]`; without a port, that of the maker's clients.

    Raises:
        InvalidValueError: It is not such an address; the message names the wrong part.
    """
    host, port, options = split_address(text, "realman", _EXAMPLE, _KNOWN_OPTIONS)
    return RealManAddress(host=host, port=port or CLIENT_PORT, world_port=options.get("world_port"))
