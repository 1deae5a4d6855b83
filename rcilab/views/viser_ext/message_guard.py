"""What a page may say to a viser server: finite numbers, in range, of the right kind, of bounded size; nothing else.

viser 1.1 writes whatever a client sends into its handles: NaN, numbers outside a slider's range, choices that are on no
list, strings and uploads of any size, and even its list of Python callbacks (`updates={"update_cb": []}`). A page of
ours sends none of that, but a script in its place could. What is not in order is dropped without an answer.

viser keeps one value per control for all pages, so a page that only watches must not reach them at all: what it sends
beyond its camera is dropped, too, and its own control goes back to what everybody sees.

Unnecessary once viser validates what clients send, by control and by client.
"""

from __future__ import annotations

import math
import sys
import time
import warnings
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any, get_type_hints

if TYPE_CHECKING:
    import viser

LARGEST_MESSAGE = 16 * 1024 * 1024  # [bytes] Pictures of the scene that a page renders for Python are less.
LARGEST_UPLOAD = 8 * 1024 * 1024  # [bytes] No program or run that we read is as large.
LONGEST_TEXT = 10_000  # Characters; the longest text we ask for has some dozens.

_UPLOADS = 2  # At a time and page.
_MOST_PARTS = 256
_DEEPEST = 8


_REFUSED_AGAIN = 1.0  # [s] A tuning value: a page that keeps pressing is informed this often that it is a spectator.

_for_anyone: set[str] = set()  # Identifiers of controls.


def for_anyone(handle: Any) -> None:
    """Lets pages that only watch use this control, too."""
    _for_anyone.add(handle._impl.uuid)


class MessageGuard:
    """Looks at every message of every page before viser does.

    Args:
        server: A viser server without connections yet.
        may_act: Whether a page, by its client id, may use the controls; any may by default.
        refuse: Called with the client id of a page that has used one and may not, once a second at most.

    Attributes:
        malformed: How many messages were none that a page sends. The first is reported on stderr.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        may_act: Callable[[int], bool] = lambda page: True,
        refuse: Callable[[int], None] = lambda page: None,
    ) -> None:
        from viser import _messages

        _refuse_what_viser_warns_of()
        self._kinds = _messages
        self._gui: Any = server.gui
        self._may_act, self._refuse = may_act, refuse
        self._refused: dict[int, float] = {}  # Client -> when it was informed last, [s].
        self._uploads: dict[str, list[int]] = {}  # Transfer -> client, declared and received bytes.
        self.malformed = 0
        sockets: Any = server._websock_server  # Neither this nor what is replaced has a public spelling in viser 1.1.
        self._sockets = sockets
        handle = sockets._handle_incoming_message

        async def guarded(client_id: int, message: Any) -> None:
            if type(message) in sockets._incoming_handlers and self.admits(client_id, message):
                await handle(client_id, message)

        sockets._handle_incoming_message = guarded
        sockets.on_client_connect(self._guard_camera)
        sockets.on_client_disconnect(self._forget)

    def listen(self, connection: Any) -> None:
        """Has only what can be read as a message leave a connection: viser would end it with a traceback."""
        receive, read = connection.recv, self._kinds.Message.deserialize

        async def recv() -> bytes:
            while True:
                raw = await receive()
                try:
                    read(raw)
                except Exception:  # Whatever viser trips over.
                    self.count_malformed()
                else:
                    return raw

        connection.recv = recv

    def admits(self, client: int, message: Any) -> bool:
        """Returns whether viser may see a message; a number out of range is moved into it."""
        kinds = self._kinds
        if not is_well_formed(message):
            self.count_malformed()
            return False
        if not self._may_act(client) and not self._is_for_anyone(message):
            self._put_back(client, message)
            return False
        if isinstance(message, kinds.FileTransferPart):
            return self._admits_part(message)
        if not is_orderly(vars(message)):
            return False
        if isinstance(message, kinds.GuiUpdateMessage):
            return self._admits_update(message)
        return not isinstance(message, kinds.FileTransferStartUpload) or self._admits_upload(client, message)

    def count_malformed(self) -> None:
        """Counts a malformed message, and reports the first."""
        self.malformed += 1
        if self.malformed == 1:
            print("a page has sent a malformed message; such messages are dropped", file=sys.stderr)

    def _guard_camera(self, connection: Any) -> None:
        """Lets a client tell where its camera is and send its pictures, and nothing else about itself alone."""
        own = (self._kinds.ViewerCameraMessage, self._kinds.GetRenderResponseMessage)
        handle = connection._handle_incoming_message

        async def guarded(client_id: int, message: Any) -> None:
            if not isinstance(message, own):
                return
            if not is_well_formed(message):
                self.count_malformed()
            elif is_orderly(vars(message)):
                await handle(client_id, message)

        connection._handle_incoming_message = guarded

    def _is_for_anyone(self, message: Any) -> bool:
        return isinstance(message, self._kinds.GuiUpdateMessage) and message.uuid in _for_anyone

    def _put_back(self, client: int, message: Any) -> None:
        """Shows a spectator what all pages see, and has it informed that it is one."""
        state = self._sockets._client_state_from_id.get(client)
        if isinstance(message, self._kinds.GuiUpdateMessage) and state is not None:
            handle = self._gui._gui_input_handle_from_uuid.get(message.uuid)
            if handle is not None and not handle._impl.is_button:
                state.message_buffer.push(self._kinds.GuiUpdateMessage(message.uuid, {"value": handle.value}))
        self.refuse(client)

    def refuse(self, client: int) -> None:
        """Reports that a page has used a control and may not, at most once a second for each page."""
        now = time.monotonic()
        if now - self._refused.get(client, float("-inf")) >= _REFUSED_AGAIN:
            self._refused[client] = now
            self._refuse(client)

    def _admits_update(self, message: Any) -> bool:
        """Lets a client change the value of a control, and nothing else about it."""
        handle = self._gui._gui_input_handle_from_uuid.get(message.uuid)
        if handle is None or set(message.updates) != {"value"}:
            return False
        value = _fitting(message.updates["value"], handle._impl)
        if value is None:
            return False
        message.updates = {"value": value}
        return True

    def _admits_upload(self, client: int, message: Any) -> bool:
        under_way = sum(owner == client for owner, _, _ in self._uploads.values())
        is_sound = (
            0 <= message.size_bytes <= LARGEST_UPLOAD
            and 0 <= message.part_count <= _MOST_PARTS
            and message.transfer_uuid not in self._uploads
            and under_way < _UPLOADS
        )
        if is_sound and message.part_count:
            self._uploads[message.transfer_uuid] = [client, message.size_bytes, 0]
        return is_sound

    def _admits_part(self, message: Any) -> bool:
        upload = self._uploads.get(message.transfer_uuid)
        if upload is None or not isinstance(message.content, bytes):
            return False
        upload[2] += len(message.content)
        if upload[2] > upload[1]:  # More than was announced: viser keeps what has come until the page goes.
            return False
        if upload[2] == upload[1]:
            del self._uploads[message.transfer_uuid]
        return True

    def _forget(self, connection: Any) -> None:
        gone = connection.client_id
        self._refused.pop(gone, None)
        self._uploads = {name: upload for name, upload in self._uploads.items() if upload[0] != gone}
        self._gui._drop_uploads_from_client(gone)  # viser forgets a client that never said where its camera was.


def _refuse_what_viser_warns_of() -> None:
    """Has viser raise where it warns of a field of another type: the warning quotes the whole field, each one anew."""
    warnings.filterwarnings("error", message=r"\[viser\] ", module=r"viser\.infra\._messages")


def is_well_formed(message: Any) -> bool:
    """Returns whether each field of a message of viser is of the type that it is declared to be."""
    import msgspec

    try:
        for name, hint in _fields(type(message)):
            msgspec.convert(getattr(message, name), hint)
    except (msgspec.ValidationError, AttributeError):
        return False
    return True


@cache
def _fields(kind: type) -> tuple[tuple[str, Any], ...]:
    from viser.infra._messages import wire_field_names

    hints = get_type_hints(kind)
    return tuple((name, hints[name]) for name in wire_field_names(kind))


def is_orderly(value: object, depth: int = 0) -> bool:
    """Returns whether every number in a value, however nested, is finite, and no text endless."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, str):
        return len(value) <= LONGEST_TEXT
    if isinstance(value, int):
        return abs(value) < 2**63
    if depth > _DEEPEST:
        return False
    if isinstance(value, dict):
        return all(is_orderly(item, depth + 1) for pair in value.items() for item in pair)
    if isinstance(value, list | tuple):
        return len(value) <= LONGEST_TEXT and all(is_orderly(item, depth + 1) for item in value)
    return True


def _fitting(value: object, control: Any) -> object | None:
    """Returns a value as a control of viser may hold it, or None."""
    held, props = control.value, control.props
    if isinstance(held, bool):
        return value if isinstance(value, bool) else None
    if isinstance(held, int | float):
        if isinstance(value, bool) or not isinstance(value, int | float):
            return None
        low, high = getattr(props, "min", None), getattr(props, "max", None)
        value = value if low is None else max(value, low)
        return value if high is None else min(value, high)
    if isinstance(held, str):
        options = getattr(props, "options", None)
        is_known = isinstance(value, str) and (options is None or value in options)
        return value if is_known else None
    if isinstance(held, tuple):
        if not isinstance(value, list | tuple) or len(value) != len(held):
            return None
        return value if all(_is_alike(a, b) for a, b in zip(value, held, strict=True)) else None
    return None


def _is_alike(a: object, b: object) -> bool:
    numbers = int | float
    return isinstance(a, numbers) if isinstance(b, numbers) else isinstance(a, str) and isinstance(b, str)
