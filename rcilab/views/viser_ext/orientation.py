"""Turns a node of the scene in a tenth of the time that `handle.wxyz = wxyz` takes.

viser 1.1 compares by `np.allclose` before it sends, and asks for the type of each number when it writes a message.
Arms are turned joint by joint at the display's rate, and only joints that have moved.

Unnecessary once viser sets a pose without comparing, and writes its messages without looking at every number.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from rcilab.views.viser_ext.version_guard import require_known_viser


def turn(handle: Any, wxyz: Sequence[float]) -> None:
    """Sets the orientation of a node.

    Args:
        handle: viser's handle of the node.
        wxyz: Unit quaternion.
    """
    node, turned = handle._impl, tuple(wxyz)
    node.wxyz[:] = turned
    node.api._queue_scene_message(_message_type()(node.name, turned))


@cache
def _message_type() -> Any:
    """Returns viser's `SetOrientationMessage` with a faster way to write it."""
    require_known_viser()
    from viser import _messages

    class TurnedMessage(_messages.SetOrientationMessage):
        def as_serializable_dict(self, binary_buffers: list[memoryview] | None = None) -> dict[str, Any]:
            return {"name": self.name, "wxyz": self.wxyz, "owner": self.owner, "type": "SetOrientationMessage"}

    TurnedMessage.__name__ = "SetOrientationMessage"  # Newer ones replace older ones of the same name and node.
    return TurnedMessage
