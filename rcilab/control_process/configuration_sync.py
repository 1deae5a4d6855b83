"""The configuration sent to the controller, whether it accepted it, and what it is sent at each new connection."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import RcilabError, UsageError
from rcilab.core.spatial import IDENTITY
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.maker import capabilities_of

if TYPE_CHECKING:
    from rcilab.control_process.pending_request import PendingRequest
    from rcilab.model.robot_model import RobotModel


class ConfigurationSync:
    """Guarded by the lock of its owner.

    Args:
        setup: What the controller is sent at its first connection.
    """

    def __init__(self, setup: RobotConfiguration) -> None:
        self.wanted = setup
        """The whole configuration that it was sent last."""
        self.acknowledged = RobotConfiguration()
        """What it has answered yes to since it was connected."""
        self.times = 0
        """At how many connections it has accepted a configuration."""
        self._waiting: list[tuple[PendingRequest, RobotConfiguration, bool]] = []
        self._refusal: RcilabError | None = None

    def follow(self, request: PendingRequest, setup: RobotConfiguration, *, is_new_connection: bool = False) -> None:
        """Takes note of a request that carries a configuration.

        Args:
            request: The request.
            setup: What it carries.
            is_new_connection: Whether it begins a connection: what the controller had before is then not known.
        """
        self.wanted = self.wanted.updated(setup)
        self._waiting.append((request, setup, is_new_connection))
        self._refusal = None

    def look(self) -> None:
        """Takes note of the answers, as far as there are any."""
        while self._waiting and self._waiting[0][0].done:
            request, setup, is_new_connection = self._waiting.pop(0)
            if is_new_connection:
                self.acknowledged = RobotConfiguration()
            if request.error is not None:
                self._refusal = request.error
                # It may have taken some of it: which of these parts it has now is unknown.
                self.acknowledged = self.acknowledged.without(setup.parts)
                continue
            self._refusal = None
            self.acknowledged = self.acknowledged.updated(setup)
            self.times += is_new_connection and bool(setup.parts)

    def require_given(self) -> None:
        """Makes sure that no configuration is in transit and that none was refused.

        Raises:
            UsageError: The controller has another configuration than motions are checked with.
        """
        self.look()
        if self._waiting:
            raise UsageError("the configuration is still being sent; wait for the request of set_up()").coded(
                "telling_setup"
            )
        if self._refusal is not None and self.wanted.parts:
            raise UsageError(f"the controller refused its configuration ({self._refusal}); call set_up() again").coded(
                "setup_refused", reason=self._refusal
            )


def standard_setup(model: RobotModel, *, is_virtual: bool) -> RobotConfiguration:
    """Returns the configuration that a controller is sent by default.

    Args:
        model: The arm.
        is_virtual: Whether it is a virtual controller: then it is sent tool and load. A real one has its own settings.
    """
    if not is_virtual:
        return RobotConfiguration()
    has_tool = not model.T_flange_tool.is_close(IDENTITY, 0.0)
    tool, load = model.T_flange_tool if has_tool else None, model.load if model.load.mass else None
    return RobotConfiguration(tool=tool, load=load).only(capabilities_of(model).setup)
