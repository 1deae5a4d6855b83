"""Messages to one page for which viser has no public call.

Unnecessary once `viser.ClientHandle` runs JavaScript, once a node of the shared scene can be hidden for one client, and
once `ClientHandle.send_file_download` takes a stream.
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
_WAITING = 8  # Messages to a page that may be queued while a file is sent.
_PAUSE = 0.005  # [s]


def run_javascript(client: viser.ClientHandle, source: str) -> None:
    """Has one page run a script."""
    from viser import _messages

    client.gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=source))


def show_node(client: viser.ClientHandle, name: str, *, visible: bool) -> None:
    """Shows or hides a node of the shared scene on one page only."""
    from viser import _messages

    client.gui._websock_interface.queue_message(_messages.SetSceneNodeVisibilityMessage(name, visible))


def send_file(client: viser.ClientHandle, name: str, stream: IO[bytes], is_unwanted: Callable[[], bool]) -> bool:
    """Hands a file to a page's browser, part by part, so that it need not fit into memory; returns whether all went.

    `client.send_file_download` takes all of it at once.

    Args:
        client: The page.
        name: What the browser saves it as.
        stream: Read from its beginning.
        is_unwanted: Asked between the parts; True gives up.
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
        while len(buffer.message_from_id) > _WAITING and not buffer.done:
            if is_unwanted():
                return False
            time.sleep(_PAUSE)
        if buffer.done or is_unwanted():
            return False
        part = _messages.FileTransferPart(None, transfer_uuid=transfer, part_index=index, content=stream.read(_PART))
        connection.queue_message(part)
        client.flush()
    return True
