"""The address of a UFACTORY controller. Its ports are fixed in the maker's client library, so it is a host."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.core.errors import InvalidValueError
from rcilab.makers.address import is_loopback, split_address
from rcilab.makers.ufactory.bounds import CLIENT_PORT

_EXAMPLE = "xarm://192.168.1.185"


@dataclass(frozen=True, slots=True, kw_only=True)
class XArmAddress:
    """A parsed `xarm://HOST[?world_port=W]`."""

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
        return f"xarm://{self.host}:{self.port}{option}"


def parse_address(text: str) -> XArmAddress:
    """Returns the parts of a robot's address.

    Args:
        text: `xarm://HOST`; the port may be given, but clients only connect to 502.

    Raises:
        InvalidValueError: It is not such an address; the message names the wrong part.
    """
    host, port, options = split_address(text, "xarm", _EXAMPLE, ("world_port",))
    if port not in (None, CLIENT_PORT):
        raise InvalidValueError(
            "address", text, f"has port {port}: clients of this interface connect to {CLIENT_PORT} only; leave it out"
        )
    return XArmAddress(host=host, world_port=options.get("world_port"))
