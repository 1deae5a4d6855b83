"""Validation of the messages that pages send to a viser server: type, range and size.

viser 1.1 writes all data that a client sends into its handles: NaN, numbers outside a slider's range, unknown options,
strings and uploads of any size, and even its list of Python callbacks (`updates={"update_cb": []}`). The page sends
none of that, but a script could. Invalid messages are dropped without a reply.

viser has one value per control for all pages. The messages of a spectator, except those of its camera, are therefore
dropped too, and the control on its page is reset to the common value.

Unnecessary once viser validates the messages of clients, by control and by client, and acknowledges an upload to its
client only.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any, get_type_hints

if TYPE_CHECKING:
    import viser

MAX_MESSAGE = 16 * 1024 * 1024  # [bytes] Larger than a picture of the scene that a page renders for Python.
MAX_UPLOAD = 8 * 1024 * 1024  # [bytes] Larger than the programs and runs that are uploaded.
MAX_TEXT = 10_000  # Characters; the longest text in normal use has some dozens.

_MAX_UPLOADS = 2  # At a time, per page.
_MAX_PARTS = 256
_MAX_DEPTH = 8


_spectator_controls: set[str] = set()  # Identifiers of controls.


def allow_spectators(handle: Any) -> None:
    """Allows spectators to use a control."""
    _spectator_controls.add(handle._impl.uuid)


class MessageGuard:
    """Validates every message of every page before viser handles it.

    Args:
        server: A viser server without connections.
        may_act: Whether a page, by its client id, may use the controls; by default any page may.
        refuse: Called with the client id of a page that used a control without permission, every time.

    Attributes:
        malformed: Number of malformed messages. The first is reported on stderr.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        may_act: Callable[[int], bool] = lambda page: True,
        refuse: Callable[[int], None] = lambda page: None,
    ) -> None:
        from viser import _messages

        _raise_viser_warnings()
        self._kinds = _messages
        self._gui: Any = server.gui
        self._may_act, self._refuse = may_act, refuse
        self._uploads: dict[str, list[int]] = {}  # Transfer -> client, declared and received bytes.
        self.malformed = 0
        sockets: Any = server._websock_server  # viser 1.1 has no public names for the server and its methods.
        self._sockets = sockets
        handle = sockets._handle_incoming_message

        async def guarded(client_id: int, message: Any) -> None:
            if type(message) in sockets._incoming_handlers and self.admits(client_id, message):
                await handle(client_id, message)

        sockets._handle_incoming_message = guarded
        self._answer_only_uploader()
        sockets.on_client_connect(self._guard_camera)
        sockets.on_client_disconnect(self._forget)

    def filter_connection(self, connection: Any) -> None:
        """Drops undecodable messages of a connection, which viser would close with a traceback."""
        receive, read = connection.recv, self._kinds.Message.deserialize

        async def recv() -> bytes:
            while True:
                raw = await receive()
                try:
                    read(raw)
                except Exception:  # Any error of viser's decoder.
                    self.count_malformed()
                else:
                    return raw

        connection.recv = recv

    def admits(self, client: int, message: Any) -> bool:
        """Returns whether viser may handle a message; numbers out of range are clipped."""
        kinds = self._kinds
        if not is_well_formed(message):
            self.count_malformed()
            return False
        if not self._may_act(client) and not self._is_for_spectators(message):
            self._restore(client, message)
            return False
        if isinstance(message, kinds.FileTransferPart):
            return self._admits_part(message)
        if not is_bounded(vars(message)):
            return False
        if isinstance(message, kinds.GuiUpdateMessage):
            return self._admits_update(message)
        return not isinstance(message, kinds.FileTransferStartUpload) or self._admits_upload(client, message)

    def _answer_only_uploader(self) -> None:
        """Acknowledges an upload to its page only; viser does so to every page, later ones included."""
        sockets, broadcast = self._sockets, self._sockets.queue_message

        def queue_message(message: Any) -> None:
            if isinstance(message, self._kinds.FileTransferPartAck):
                owner = self._gui._current_file_upload_states[message.transfer_uuid]["client_id"]
                page = sockets._client_state_from_id.get(owner)
                if page is not None:
                    page.message_buffer.push(message)
            else:
                broadcast(message)

        sockets.queue_message = queue_message

    def count_malformed(self) -> None:
        """Counts a malformed message and reports the first one."""
        self.malformed += 1
        if self.malformed == 1:
            print("a page has sent a malformed message; such messages are dropped", file=sys.stderr)

    def _guard_camera(self, connection: Any) -> None:
        """Restricts the client's own messages to those of its camera and to pictures."""
        own = (self._kinds.ViewerCameraMessage, self._kinds.GetRenderResponseMessage)
        handle = connection._handle_incoming_message

        async def guarded(client_id: int, message: Any) -> None:
            if not isinstance(message, own):
                return
            if not is_well_formed(message):
                self.count_malformed()
            elif is_bounded(vars(message)):
                await handle(client_id, message)

        connection._handle_incoming_message = guarded

    def _is_for_spectators(self, message: Any) -> bool:
        return isinstance(message, self._kinds.GuiUpdateMessage) and message.uuid in _spectator_controls

    def _restore(self, client: int, message: Any) -> None:
        """Resets the control on a spectator's page to the common value and informs the spectator."""
        state = self._sockets._client_state_from_id.get(client)
        if isinstance(message, self._kinds.GuiUpdateMessage) and state is not None:
            handle = self._gui._gui_input_handle_from_uuid.get(message.uuid)
            if handle is not None and not handle._impl.is_button:
                state.message_buffer.push(self._kinds.GuiUpdateMessage(message.uuid, {"value": handle.value}))
        self._refuse(client)

    def _admits_update(self, message: Any) -> bool:
        """Returns whether an update changes only the value of a control, to a valid value."""
        handle = self._gui._gui_input_handle_from_uuid.get(message.uuid)
        if handle is None or set(message.updates) != {"value"}:
            return False
        value = _valid_value(message.updates["value"], handle._impl)
        if value is None:
            return False
        message.updates = {"value": value}
        return True

    def _admits_upload(self, client: int, message: Any) -> bool:
        active = sum(owner == client for owner, _, _ in self._uploads.values())
        is_valid = (
            0 <= message.size_bytes <= MAX_UPLOAD
            and 0 <= message.part_count <= _MAX_PARTS
            and message.transfer_uuid not in self._uploads
            and active < _MAX_UPLOADS
        )
        if is_valid and message.part_count:
            self._uploads[message.transfer_uuid] = [client, message.size_bytes, 0]
        return is_valid

    def _admits_part(self, message: Any) -> bool:
        upload = self._uploads.get(message.transfer_uuid)
        if upload is None or not isinstance(message.content, bytes):
            return False
        upload[2] += len(message.content)
        if upload[2] > upload[1]:  # More than announced; viser drops the received parts when the page is closed.
            return False
        if upload[2] == upload[1]:
            del self._uploads[message.transfer_uuid]
        return True

    def _forget(self, connection: Any) -> None:
        gone = connection.client_id
        self._uploads = {name: upload for name, upload in self._uploads.items() if upload[0] != gone}
        self._gui._drop_uploads_from_client(gone)  # viser does not do so for a client that never sent its camera.


def _raise_viser_warnings() -> None:
    """Turns viser's warnings about the type of a field into errors: they quote the whole field every time."""
    warnings.filterwarnings("error", message=r"\[viser\] ", module=r"viser\.infra\._messages")


def is_well_formed(message: Any) -> bool:
    """Returns whether each field of a viser message has its declared type."""
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


def is_bounded(value: object, depth: int = 0) -> bool:
    """Returns whether all numbers in a nested value are finite, and text, lists and depth within their limits."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, str):
        return len(value) <= MAX_TEXT
    if isinstance(value, int):
        return abs(value) < 2**63
    if depth > _MAX_DEPTH:
        return False
    if isinstance(value, dict):
        return all(is_bounded(item, depth + 1) for pair in value.items() for item in pair)
    if isinstance(value, list | tuple):
        return len(value) <= MAX_TEXT and all(is_bounded(item, depth + 1) for item in value)
    return True


def _valid_value(value: object, control: Any) -> object | None:
    """Returns a value that is valid for a control, clipped to its range, or None."""
    current, props = control.value, control.props
    if isinstance(current, bool):
        return value if isinstance(value, bool) else None
    if isinstance(current, int | float):
        if isinstance(value, bool) or not isinstance(value, int | float):
            return None
        low, high = getattr(props, "min", None), getattr(props, "max", None)
        value = value if low is None else max(value, low)
        return value if high is None else min(value, high)
    if isinstance(current, str):
        options = getattr(props, "options", None)
        is_known = isinstance(value, str) and (options is None or value in options)
        return value if is_known else None
    if isinstance(current, tuple):
        if not isinstance(value, list | tuple) or len(value) != len(current):
            return None
        return value if all(_is_alike(a, b) for a, b in zip(value, current, strict=True)) else None
    return None


def _is_alike(a: object, b: object) -> bool:
    numbers = int | float
    return isinstance(a, numbers) if isinstance(b, numbers) else isinstance(a, str) and isinstance(b, str)
