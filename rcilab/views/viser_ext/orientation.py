"""Sets the orientation of a node in a tenth of the time of `handle.wxyz = wxyz`.

viser 1.1 compares by `np.allclose` before it sends, and checks the type of each number when it writes a message. An arm
is updated joint by joint at the display's rate, only for joints that have moved, so the comparison is not needed.

Unnecessary once viser sets a pose without comparing, and writes its messages without checking every number.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from rcilab.views.viser_ext.version_guard import require_known_viser


def set_orientation(handle: Any, wxyz: Sequence[float]) -> None:
    """Sets the orientation of a node.

    Args:
        handle: viser's handle of the node.
        wxyz: Unit quaternion.
    """
    node, orientation = handle._impl, tuple(wxyz)
    node.wxyz[:] = orientation
    node.api._queue_scene_message(_message_type()(node.name, orientation))


@cache
def _message_type() -> Any:
    """Returns a `SetOrientationMessage` with faster serialisation."""
    require_known_viser()
    from viser import _messages

    class FastMessage(_messages.SetOrientationMessage):
        def as_serializable_dict(self, binary_buffers: list[memoryview] | None = None) -> dict[str, Any]:
            return {"name": self.name, "wxyz": self.wxyz, "owner": self.owner, "type": "SetOrientationMessage"}

    FastMessage.__name__ = "SetOrientationMessage"  # A new message replaces an older one of the same name and node.
    return FastMessage
