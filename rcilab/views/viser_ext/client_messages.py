"""Messages to one page for which viser has no public call.

Unnecessary once `viser.ClientHandle` runs JavaScript, and once a node of the shared scene can be hidden for one client.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser


def run_javascript(client: viser.ClientHandle, source: str) -> None:
    """Has one page run a script."""
    from viser import _messages

    client.gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=source))


def show_node(client: viser.ClientHandle, name: str, *, visible: bool) -> None:
    """Shows or hides a node of the shared scene on one page only."""
    from viser import _messages

    client.gui._websock_interface.queue_message(_messages.SetSceneNodeVisibilityMessage(name, visible))
