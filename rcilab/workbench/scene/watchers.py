"""Handles in the scene that only the page with the controls can use, and so only that page shows."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rcilab.views.viser_ext.client_messages import show_node

if TYPE_CHECKING:
    import viser

    from rcilab.app.control_lock import ControlLock

_SETTLING = 10.0
"""[s] Time for which a change is sent repeatedly: viser replays the scene to a new page, and informs all pages of
restored nodes, in any order. A tuning value."""
_AGAIN = 0.5
"""[s] Between two messages. A tuning value."""


class Watchers:
    """Hides handles from spectators. Owned by the stage.

    Args:
        server: The pages.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._handles: tuple[str, ...] = ()
        self._watching: dict[int, float] = {}  # Since when the handles are hidden from each spectator, [s].
        self._sent = 0.0

    def show(self, lock: ControlLock, handles: tuple[str, ...]) -> None:
        """Sends each page its changes.

        Args:
            lock: The open pages, and the holder of the controls.
            handles: The nodes that are handles, and that are visible.
        """
        now = time.monotonic()
        if handles != self._handles:
            self._handles, self._watching = handles, dict.fromkeys(self._watching, now)
        watching = {page: self._watching.get(page, now) for page in lock.pages if page != lock.holder}
        is_time = now - self._sent >= _AGAIN
        hidden = [page for page, since in watching.items() if since == now or (is_time and now - since < _SETTLING)]
        shown = [page for page in self._watching if page == lock.holder]
        self._watching = watching
        if hidden or shown:
            self._sent = now
            clients = self._server.get_clients()
            for page in (*hidden, *shown):
                client = clients.get(page)
                if client is not None:  # It may have disconnected just now.
                    for name in handles:
                        show_node(client, name, visible=page in shown)
