"""Our page out of viser's: the bar with status and Stop, the Esc key, the time cursor in the plots."""

from __future__ import annotations

import json
import math
import mimetypes
import os
import time
from collections.abc import Callable
from importlib.resources import files
from typing import IO, TYPE_CHECKING, Any
from uuid import uuid4

from rcilab.views.viser_ext.client_messages import run_javascript

if TYPE_CHECKING:
    import viser

_BRAND = (11, 111, 194)
_PART = 1024 * 1024  # [bytes] As viser.
_WAITING = 8  # Messages of a page that may wait for their way while a file is sent.
_PAUSE = 0.005  # [s]


def decorate(index: bytes, quality: str = "full") -> bytes:
    """Returns viser's `index.html` with our style sheet and script in its head.

    The bar must be there in every tab and with every panel folded away, and the Esc key must work while a text field
    has the focus; viser's own controls and hotkeys can do neither.

    Args:
        index: As viser has it.
        quality: How the scene is to be drawn: "light" does without smoothed edges, which a browser cannot change later.
    """
    assets = files("rcilab.workbench") / "assets"
    style = (assets / "page.css").read_bytes()
    scripts = ("heartbeat", "page", "marks", "names", "rows", "pick", "branches", "folds", "retell", "labels")
    script = b"\n".join((assets / f"{name}.js").read_bytes() for name in scripts)
    head = b"<style>" + style + b"</style><script>" + script + b"</script></head>"
    page = index.replace(b"<title>Viser</title>", b"<title>rcilab workbench</title>", 1)
    page = page.replace(b"<html ", f'<html data-rl-quality="{quality}" '.encode(), 1)
    return page.replace(b"</head>", head, 1)


def introduce(client: viser.ClientHandle, key: str) -> None:
    """Tells a page which of the server's clients it is, and the key that proves it on its live connection."""
    call = f"window.rcilabPage?.({client.client_id}, {json.dumps(key)});"
    run_javascript(client, call)


def dress(server: viser.ViserServer, theme: str) -> None:
    """Colours the page light or dark."""
    server.gui.configure_theme(
        brand_color=_BRAND, show_logo=False, show_share_button=False, control_width="medium", dark_mode=theme == "dark"
    )


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
    for place in range(math.ceil(size / _PART)):
        while len(buffer.message_from_id) > _WAITING and not buffer.done:
            if is_unwanted():
                return False
            time.sleep(_PAUSE)
        if buffer.done or is_unwanted():
            return False
        part = _messages.FileTransferPart(None, transfer_uuid=transfer, part_index=place, content=stream.read(_PART))
        connection.queue_message(part)
        client.flush()
    return True
