"""The websocket of our page next to viser's: status to the bar; Stop, seeking, chosen rows and heartbeats from it.

It does not depend on the open tab or panel, so Stop is always reachable.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import secrets
from collections.abc import Callable
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
from websockets.asyncio.server import broadcast
from websockets.exceptions import ConnectionClosed

from rcilab.app.link.page_link import LONGEST_LINK

LIVE_PATH = "/rcilab/live"
HEARTBEAT_PATH = "/rcilab/heartbeat"
"""Path for the heartbeat thread of a page: its connection gets heartbeats only."""

_LARGEST_MESSAGE = 12_000  # [bytes] A link has up to 8000; the other messages of a page have some hundreds.

_Index: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=99)]
_Key: TypeAlias = Annotated[int, msgspec.Meta(ge=0, lt=10**9)]


class PageMessage(msgspec.Struct, tag_field="kind", tag=str.lower):
    """A message of a page: a JSON object whose `kind` is the name of a class below."""


class Hello(PageMessage):
    """The page's client id of viser, with the key that only this client got."""

    page: int
    key: str


class Stop(PageMessage):
    """Stop or Esc was pressed."""


class Here(PageMessage):
    """The page answers a heartbeat: Stop can be pressed there."""


class Home(PageMessage):
    """The page's camera is to be moved to a view."""

    view: Literal["home", "top", "front", "side"] = "home"


class Extra(PageMessage):
    """Something that the scene shows besides is turned on or off."""

    name: Literal["elbow", "frames", "ellipsoid", "cloud", "swept"]
    on: bool


class Cut(PageMessage):
    """The plane across the drawn workspace was moved."""

    axis: Literal["none", "x", "y", "z"]
    at: float
    """[m]."""


class Commands(PageMessage):
    """The page asks for the list of its controls."""


class Seek(PageMessage):
    """A plot was clicked at this share of its time axis, 0 to 1."""

    share: float


class Play(PageMessage):
    """The preview is to be played from its start, or paused."""

    playing: bool


class Size(PageMessage):
    """Height of the page's window, [px], sent when the page gets the controls and after changes."""

    height: float


class Tab(PageMessage):
    """Another tab was opened, counted from 0."""

    index: _Index


class Entered(PageMessage):
    """The typed text is complete."""


class Take(PageMessage):
    """The page asks for the controls."""


class Answer(PageMessage):
    """Answer of the page with the controls: whether it hands them over."""

    yes: bool


class Link(PageMessage):
    """The page was opened with a link to a view."""

    text: Annotated[str, msgspec.Meta(max_length=LONGEST_LINK)]


class AnswerLink(PageMessage):
    """Whether a link that replaces something is opened."""

    yes: bool


class Software(PageMessage):
    """The browser has no graphics card."""


class Peek(PageMessage):
    """The branch, from 0, under the mouse or with the focus; None when it is left."""

    branch: _Index | None


class Elbow(PageMessage):
    """The elbow's handle or its group of controls is pointed at, or is left."""

    on: bool


class Branch(PageMessage):
    """A branch of the list, from 0, was chosen."""

    index: _Index


class Condition(PageMessage):
    """A row of the report was chosen."""

    id: Annotated[str, msgspec.Meta(pattern=r"\A[a-z_.]{1,60}\Z")]


class Entry(PageMessage):
    """An entry of the cell's list, from 0, was chosen."""

    index: _Key


class Recorded(PageMessage):
    """A recorded run of the list was chosen."""

    name: Annotated[str, msgspec.Meta(max_length=255)]
    """Name of its file."""


class Rows(PageMessage):
    """The list of waypoints was scrolled to rows that it does not have."""

    index: _Key
    """Index of the row in the middle, from 0."""


class Draw(PageMessage):
    """Enter or Esc was pressed while a path is drawn."""

    what: Literal["end", "cancel"]


class Turn(PageMessage):
    """The last edit on the page is undone, or repeated."""

    what: Literal["undo", "redo"]


class Edit(PageMessage):
    """An action in the list of waypoints."""

    what: Literal[
        "select", "move", "up", "down", "delete", "duplicate", "undo", "redo", "toggle", "extend", "all", "copy", "cut",
        "paste",
    ]  # fmt: skip
    key: _Key
    """Key of the waypoint."""
    index: _Key
    """Its new index, from 0."""


_DECODER = msgspec.json.Decoder(
    Hello
    | Stop
    | Here
    | Home
    | Commands
    | Extra
    | Cut
    | Seek
    | Play
    | Size
    | Tab
    | Entered
    | Take
    | Answer
    | Link
    | AnswerLink
    | Software
    | Peek
    | Elbow
    | Branch
    | Condition
    | Entry
    | Recorded
    | Rows
    | Draw
    | Edit
    | Turn
)


class LiveChannel:
    """Sends one JSON object to every page when it changes, and receives the messages of pages.

    Args:
        on_stop: Called for every Stop, from any page that may open the websocket.
        on_message: Called with a page's client id and its message; must return at once. Messages of pages that have not
            proved their client id are dropped.
        on_malformed: Called for an invalid message; it is dropped.
    """

    def __init__(
        self,
        on_stop: Callable[[], None],
        on_message: Callable[[int, PageMessage], None],
        on_malformed: Callable[[], None],
    ) -> None:
        self._on_stop, self._on_message, self._on_malformed = on_stop, on_message, on_malformed
        self._pages: dict[Any, int | None] = {}  # Connection -> client id. Owned by the event loop.
        self._heartbeats: dict[Any, int | None] = {}  # The same for connections of heartbeat threads.
        self._keys: dict[int, str] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._latest: dict[str, Any] = {"server": secrets.token_hex(8)}
        """The object that pages show; by `server` they notice that another workbench answers at this address."""

    def introduce(self, page: int) -> str:
        """Returns the key of a client that has just connected; the page sends it on its live connection."""
        return self._keys.setdefault(page, secrets.token_urlsafe(16))

    def forget(self, page: int) -> None:
        """Drops the key of a client that has disconnected."""
        self._keys.pop(page, None)

    async def serve(self, connection: Any) -> None:
        """Serves one page until it disconnects; runs on the server's event loop."""
        await self._serve(connection, self._pages, json.dumps(self._latest))

    async def serve_heartbeats(self, connection: Any) -> None:
        """Serves the heartbeat thread of a page until it disconnects; runs on the server's event loop."""
        await self._serve(connection, self._heartbeats)

    async def _serve(self, connection: Any, clients: dict[Any, int | None], *first: str) -> None:
        self._loop = asyncio.get_running_loop()
        clients[connection] = None  # Before anything is sent: a change that is published meanwhile follows.
        try:
            for text in first:
                await connection.send(text)
            async for raw in connection:
                clients[connection] = self.receive(raw, clients[connection])
        except ConnectionClosed:
            pass
        finally:
            clients.pop(connection, None)

    def receive(self, raw: str | bytes, page: int | None = None) -> int | None:
        """Handles one message.

        Args:
            raw: The message.
            page: Client id of the page, if it is known.

        Returns:
            The client id from now on.
        """
        message = _decode(raw)
        if message is None:
            self._on_malformed()
        elif isinstance(message, Hello):
            return self._greet(message)
        elif isinstance(message, Stop):
            self._on_stop()
        elif page in self._keys:
            self._on_message(page, message)
        return page

    def _greet(self, hello: Hello) -> int | None:
        key = self._keys.get(hello.page)
        if key is None or not hmac.compare_digest(hello.key.encode(errors="replace"), key.encode()):
            return None
        self._on_message(hello.page, Here())
        return hello.page

    def publish(self, **values: Any) -> None:
        """Publishes new values; only changed ones are sent. Called by one thread, the renderer's."""
        changed = {name: value for name, value in values.items() if self._latest.get(name) != value}
        if changed:
            self._latest = {**self._latest, **changed}
            self._send(json.dumps(changed), self._pages)

    def beat(self) -> None:
        """Sends a heartbeat to every page. A page answers even while its timers are throttled in the background."""
        self._send('{"beat": 1}', self._pages, self._heartbeats)

    def _send(self, text: str, *clients: dict[Any, int | None]) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(lambda: broadcast([c for group in clients for c in group], text))


def _decode(raw: str | bytes) -> PageMessage | None:
    """Returns a message of a page, or None for anything else."""
    if len(raw) > _LARGEST_MESSAGE:
        return None
    try:
        return _DECODER.decode(raw)
    except (ValueError, RecursionError):  # msgspec's errors, and text that is not Unicode.
        return None
