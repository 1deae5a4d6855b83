"""A second websocket beside viser's: status to the page's bar; Stop, seeking, signs of life and answers back from it.

It does not depend on which tab or panel is shown, so Stop stays reachable whatever the page looks like.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import math
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

LIVE_PATH = "/rcilab/live"

_LARGEST_MESSAGE = 4096  # [bytes] A page sends a few words; anything longer is not ours.


@dataclass(frozen=True, kw_only=True)
class Heard:
    """What is called when a page says something; each must return at once."""

    stop: Callable[[], None]
    """Somebody pressed Stop or Esc."""
    here: Callable[[int], None]
    """A page has answered a beat: somebody who could press Stop is there."""
    seek: Callable[[int, float], None]
    """A place on the time axis was clicked in a page's plot, 0 to 1."""
    size: Callable[[int, float], None]
    """Height of a page's window, [px], when it gets the controls and when it changes."""
    peek: Callable[[int, int], None] = lambda page, branch: None
    """The branch that is under a page's mouse, from 0; -1 when it is left."""
    entered: Callable[[int], None] = lambda page: None
    """What was typed in a page is complete."""
    tab: Callable[[int, int], None] = lambda page, index: None
    """Another tab was opened in a page, counted from 0."""
    take: Callable[[int], None]
    """A page wants the controls."""
    answer: Callable[[int, bool], None]
    """A page was asked for the controls."""
    software: Callable[[int], None] = lambda page: None
    """A page's browser draws without a graphics card."""
    home: Callable[[int], None] = lambda page: None
    """A page wants its camera back where it was at first."""


class LiveChannel:
    """Sends one JSON object to every page when it changes, and hears the few things the bar can say.

    A page says which of viser's clients it is by a key that only this client was given.

    Args:
        heard: What to do.
    """

    def __init__(self, heard: Heard) -> None:
        self._heard = heard
        self._pages: dict[Any, int | None] = {}  # Connection -> client id. Owned by the event loop.
        self._keys: dict[int, str] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._latest: dict[str, Any] = {"server": secrets.token_hex(8)}
        """What pages show; `server` tells them that another workbench answers at this address since."""

    def introduce(self, page: int) -> str:
        """Returns the key of a client that has just connected; the page brings it along on its live connection."""
        return self._keys.setdefault(page, secrets.token_urlsafe(16))

    def forget(self, page: int) -> None:
        """Drops the key of a client that has gone."""
        self._keys.pop(page, None)

    async def serve(self, page: Any) -> None:
        """Serves one page until it goes; runs on the server's event loop."""
        self._loop = asyncio.get_running_loop()
        self._pages[page] = None
        try:
            await page.send(json.dumps(self._latest))
            async for message in page:
                self._pages[page] = self.hear(message, self._pages[page])
        except Exception as error:
            from websockets.exceptions import ConnectionClosed

            if not isinstance(error, ConnectionClosed):
                raise
        finally:
            self._pages.pop(page, None)

    def hear(self, message: str | bytes, page: int | None = None) -> int | None:
        """Acts on one message; anything that is not one of ours is ignored.

        Args:
            message: As it came.
            page: Client id of the page it came from, as far as it is known.

        Returns:
            The client id from now on.
        """
        said = _decode(message)
        kind = said.get("kind")
        if kind == "hello":
            return self._greet(said)
        if kind == "stop":
            self._heard.stop()
        elif page not in self._keys:
            pass  # Nobody that we know.
        elif kind == "seek":
            _pass_on(said.get("place"), 0.0, 1.0, lambda place: self._heard.seek(page, place))
        elif kind == "size":
            _pass_on(said.get("height"), 200.0, 4000.0, lambda height: self._heard.size(page, height))
        elif kind == "here":
            self._heard.here(page)
        elif kind == "peek":
            _pass_on(said.get("branch"), -1.0, 99.0, lambda branch: self._heard.peek(page, int(branch)))
        elif kind == "entered":
            self._heard.entered(page)
        elif kind == "tab":
            _pass_on(said.get("index"), 0.0, 99.0, lambda index: self._heard.tab(page, int(index)))
        elif kind == "take":
            self._heard.take(page)
        elif kind == "software":
            self._heard.software(page)
        elif kind == "home":
            self._heard.home(page)
        elif kind == "answer" and isinstance(said.get("yes"), bool):
            self._heard.answer(page, said["yes"])
        return page

    def _greet(self, said: dict[str, Any]) -> int | None:
        page, key = said.get("page"), said.get("key")
        if not isinstance(page, int) or not isinstance(key, str) or page not in self._keys:
            return None
        if not hmac.compare_digest(key.encode(errors="replace"), self._keys[page].encode()):
            return None
        self._heard.here(page)
        return page

    def publish(self, **values: Any) -> None:
        """Shows new values; only those that changed travel. For one thread, the presenter's."""
        changed = {name: value for name, value in values.items() if self._latest.get(name) != value}
        if not changed:
            return
        self._latest = {**self._latest, **changed}
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._send, json.dumps(changed))

    def beat(self) -> None:
        """Asks every page whether it is still there. A page answers even while its timers are throttled in the back."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._send, '{"beat": 1}')

    def _send(self, message: str) -> None:
        from websockets.asyncio.server import broadcast

        broadcast(self._pages, message)


def _decode(message: str | bytes) -> dict[str, Any]:
    """Returns what a page says; nothing where that is not one of ours."""
    if len(message) > _LARGEST_MESSAGE:
        return {}
    try:
        said = json.loads(message)
    except (ValueError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}


def _pass_on(number: object, low: float, high: float, act: Callable[[float], None]) -> None:
    if isinstance(number, int | float) and not isinstance(number, bool) and abs(number) < math.inf:
        act(float(min(max(number, low), high)))
