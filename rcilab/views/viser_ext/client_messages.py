"""Messages to one page for which viser has no public function.

Unnecessary once `viser.ClientHandle` can run JavaScript, can hide a node of the shared scene for one client, and
accepts a stream in `send_file_download`.
"""

from __future__ import annotations

import math
import mimetypes
import os
import time
from collections.abc import Callable
from typing import IO, TYPE_CHECKING, Any
from uuid import uuid4

if TYPE_CHECKING:
    import viser

_PART = 1024 * 1024  # [bytes] As viser.
_MAX_QUEUED = 8  # Messages to a page that may be queued while a file is sent.
_PAUSE = 0.005  # [s]


def run_javascript(client: viser.ClientHandle, source: str) -> None:
    """Runs a script on one page."""
    from viser import _messages

    client.gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=source))


def show_node(client: viser.ClientHandle, name: str, *, visible: bool) -> None:
    """Shows or hides a node of the shared scene on one page only."""
    from viser import _messages

    client.gui._websock_interface.queue_message(_messages.SetSceneNodeVisibilityMessage(name, visible))


def send_file(client: viser.ClientHandle, name: str, stream: IO[bytes], is_cancelled: Callable[[], bool]) -> bool:
    """Sends a file to a page's browser in parts, so that it need not fit into memory; returns whether it is complete.

    `client.send_file_download` needs the whole file in memory.

    Args:
        client: The page.
        name: File name in the browser.
        stream: Content, read from its beginning.
        is_cancelled: Called between the parts; True cancels the transfer.
    """
    from viser import _messages

    connection: Any = client.gui._websock_interface
    buffer = connection.get_message_buffer()
    size = stream.seek(0, os.SEEK_END)
    stream.seek(0)
    transfer = str(uuid4())
    kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
    connection.queue_message(
        _messages.FileTransferStartDownload(
            save_immediately=True, transfer_uuid=transfer, filename=name, mime_type=kind,
            part_count=math.ceil(size / _PART), size_bytes=size,
        )
    )  # fmt: skip
    for index in range(math.ceil(size / _PART)):
        while len(buffer.message_from_id) > _MAX_QUEUED and not buffer.done:
            if is_cancelled():
                return False
            time.sleep(_PAUSE)
        if buffer.done or is_cancelled():
            return False
        part = _messages.FileTransferPart(None, transfer_uuid=transfer, part_index=index, content=stream.read(_PART))
        connection.queue_message(part)
        client.flush()
    return True
