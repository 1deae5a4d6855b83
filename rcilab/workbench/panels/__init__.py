"""One class per panel: `build(gui)` once, `show(state, status)` at the display's rate. No panel uses another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class Panel(Protocol):
    """The interface of a panel for the renderer."""

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the panel's controls to the container that is open in `gui`."""
        ...

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Updates the controls."""
        ...
