"""A tab of a headless Chromium, driven over its own debugging protocol: enough to time what a person waits for."""

from __future__ import annotations

import itertools
import json
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import connect
from websockets.sync.connection import Connection

from rcilab.bench.browser import CHROMIUM_FLAGS
from rcilab.bench.keeper import keeper, launch
from rcilab.errors import DeadlineError

_PATIENCE = 90.0  # [s] Software rendering on a busy machine.


class Tab:
    """One tab. Owned by the thread that opened it.

    Args:
        link: Its debugging connection.
    """

    def __init__(self, link: Connection) -> None:
        self._link = link
        self._numbers = itertools.count(1)

    def send(self, method: str, **params: Any) -> dict[str, Any]:
        """Asks the browser for something and returns its answer."""
        number = next(self._numbers)
        self._link.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            answer = json.loads(self._link.recv(timeout=_PATIENCE))
            if answer.get("id") == number:
                return answer.get("result", {})

    def evaluate(self, script: str) -> Any:
        """Returns the value of an expression; of a promise, what becomes of it."""
        answer = self.send("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        return answer.get("result", {}).get("value")

    def wait(self, what: str, script: str) -> None:
        """Waits until an expression is true."""
        deadline = time.monotonic() + _PATIENCE
        while not self.evaluate(script):
            if time.monotonic() > deadline:
                raise DeadlineError(
                    f"bench: waited {_PATIENCE:g} s for {what}; look at `rcilab doctor`, then try again"
                )
            time.sleep(0.05)

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Moves or presses the mouse: mouseMoved, mousePressed, mouseReleased."""
        button = {} if kind == "mouseMoved" else {"button": "left", "clickCount": 1}
        held = 0 if kind == "mouseReleased" else 1
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, buttons=held, **button)


@contextmanager
def open_tab(browser: str) -> Iterator[Tab]:
    """Opens an empty tab in a headless Chromium of our own; all of it is gone afterwards, and when we die."""
    profile = tempfile.mkdtemp(prefix="rcilab-bench-")
    with keeper([browser, *CHROMIUM_FLAGS, f"--user-data-dir={profile}", "about:blank"], directory=profile) as process:
        launch(process)
        port = _debugging_port(Path(profile))
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=_PATIENCE) as answer:
            pages = [page for page in json.load(answer) if page["type"] == "page"]
        with connect(pages[0]["webSocketDebuggerUrl"], max_size=None, compression=None) as link:
            yield Tab(link)


def _debugging_port(profile: Path) -> int:
    deadline = time.monotonic() + _PATIENCE
    file = profile / "DevToolsActivePort"
    while True:
        if file.is_file() and (lines := file.read_text().split()):
            return int(lines[0])
        if time.monotonic() > deadline:
            raise DeadlineError("bench: the browser did not start; look at `rcilab doctor`, then try again")
        time.sleep(0.05)
