"""The configuration of the controller: requested, acknowledged, and sent again at each new connection."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import RcilabError, UsageError
from rcilab.core.spatial import IDENTITY
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.maker import capabilities_of

if TYPE_CHECKING:
    from rcilab.control_process.requests import PendingRequest
    from rcilab.model.robot_model import RobotModel


class ConfigurationSync:
    """Tracks which configuration the controller has. Guarded by its owner's lock.

    Args:
        setup: Configuration to send at the first connection.
    """

    def __init__(self, setup: RobotConfiguration) -> None:
        self.requested = setup
        """The whole configuration that was requested last."""
        self.acknowledged = RobotConfiguration()
        """The parts that the controller has accepted since it was connected."""
        self.reported = RobotConfiguration()
        """What the controller has reported after the last request."""
        self.connections = 0
        """Number of connections at which it has accepted a configuration."""
        self._pending: list[tuple[PendingRequest, RobotConfiguration, bool]] = []
        self._refusal: RcilabError | None = None

    def track(self, request: PendingRequest, setup: RobotConfiguration, *, is_new_connection: bool = False) -> None:
        """Registers a request with a configuration.

        Args:
            request: The request.
            setup: Its configuration.
            is_new_connection: Whether it opens a connection: what the controller had before is then not known.
        """
        self.requested = self.requested.updated(setup)
        self._pending.append((request, setup, is_new_connection))
        self._refusal = None

    def collect(self) -> None:
        """Processes the requests that are done; does not wait."""
        while self._pending and self._pending[0][0].done:
            request, setup, is_new_connection = self._pending.pop(0)
            if is_new_connection:
                self.acknowledged = self.reported = RobotConfiguration()
            if request.reported is not None:
                self.reported = request.reported
            if request.error is not None:
                self._refusal = request.error
                # It may have accepted some of these parts: which ones it has now is unknown.
                self.acknowledged = self.acknowledged.without(setup.parts)
                continue
            self._refusal = None
            self.acknowledged = self.acknowledged.updated(setup)
            self.connections += is_new_connection and bool(setup.parts)

    def require_accepted(self) -> None:
        """Requires that no configuration is being sent and none was refused.

        Raises:
            UsageError: The configuration of the controller differs from that of the checks, or may do so.
        """
        self.collect()
        if self._pending:
            raise UsageError("the configuration is still being sent; wait for the request of configure()").coded(
                "telling_setup"
            )
        if self._refusal is not None and self.requested.parts:
            raise UsageError(
                f"the controller refused its configuration ({self._refusal}); call configure() again"
            ).coded("setup_refused", reason=self._refusal)


def standard_setup(model: RobotModel, *, is_virtual: bool) -> RobotConfiguration:
    """Returns the default configuration of a controller.

    Args:
        model: The arm.
        is_virtual: Whether the controller is virtual: then tool and load are sent. A real one has its own settings.
    """
    if not is_virtual:
        return RobotConfiguration()
    has_tool = not model.T_flange_tool.is_close(IDENTITY, 0.0)
    tool, load = model.T_flange_tool if has_tool else None, model.load if model.load.mass else None
    return RobotConfiguration(tool=tool, load=load).only(capabilities_of(model).setup)
