"""A window of a headless Chromium, driven over its own debugging protocol: enough to time what a person waits for."""

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

from rcilab.core.errors import DeadlineError, RcilabError
from rcilab.diagnostics.bench.browser import CHROMIUM_FLAGS
from rcilab.diagnostics.bench.child_guard import keeper, launch
from rcilab.diagnostics.bench.measure import Absent

PATIENCE = 60.0  # [s] Software rendering on a busy machine.


class Tab:
    """One window. Owned by the thread that opened it.

    Args:
        link: Its debugging connection.
    """

    def __init__(self, link: Connection) -> None:
        self._link = link
        self._numbers = itertools.count(1)
        self._held = False

    def send(self, method: str, **params: Any) -> dict[str, Any]:
        """Asks the browser for something and returns its answer.

        Raises:
            DeadlineError: The browser does not answer.
        """
        number, deadline = next(self._numbers), time.monotonic() + PATIENCE
        self._link.send(json.dumps({"id": number, "method": method, "params": params}))
        while (left := deadline - time.monotonic()) > 0.0:
            try:
                answer = json.loads(self._link.recv(timeout=left))
            except TimeoutError:
                break
            if answer.get("id") == number:
                return answer.get("result", {})
        raise DeadlineError(
            f"bench: the browser did not answer {method} within {PATIENCE:g} s; close others, try again"
        )

    def open(self, url: str) -> None:
        """Goes to an address and waits until the browser has loaded what is there."""
        self.send("Page.navigate", url=url)
        loaded = "location.href !== 'about:blank' && performance.getEntriesByType('navigation')[0].loadEventEnd > 0"
        self.wait("the page to load", loaded)

    def open_window(self, url: str) -> None:
        """Opens another window of the same browser; all of them draw."""
        self.send("Target.createTarget", url=url, newWindow=True)

    def evaluate(self, script: str) -> Any:
        """Returns the value of an expression.

        Raises:
            RcilabError: The page's script failed.
        """
        answer = self.send("Runtime.evaluate", expression=script, returnByValue=True)
        if "exceptionDetails" in answer:
            said = answer["exceptionDetails"].get("exception", {}).get("description", "no reason given")
            raise RcilabError(f"bench: the page's script failed: {said.splitlines()[0]}")
        return answer.get("result", {}).get("value")

    def wait(self, what: str, script: str) -> Any:
        """Waits until an expression is true and returns it.

        Raises:
            DeadlineError: It does not become true.
        """
        deadline = time.monotonic() + PATIENCE
        while not (found := self.evaluate(script)):
            if time.monotonic() > deadline:
                raise DeadlineError(f"bench: waited {PATIENCE:g} s for {what}; look at `rcilab doctor`, then try again")
            time.sleep(0.05)
        return found

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Moves or presses the mouse: mouseMoved, mousePressed, mouseReleased."""
        button = {} if kind == "mouseMoved" else {"button": "left", "clickCount": 1}
        self._held = kind == "mousePressed" or (self._held and kind == "mouseMoved")
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, buttons=int(self._held), **button)


def no_browser(name: str) -> Absent:
    """Returns the row of a bench that needs a browser where there is none."""
    return Absent(name=name, note="NO BROWSER FOUND, so nothing was measured: install Chromium (apt install chromium)")


@contextmanager
def open_tab(browser: str) -> Iterator[Tab]:
    """Opens an empty window in a headless Chromium of our own; all of it is gone afterwards, and when we die."""
    profile = tempfile.mkdtemp(prefix="rcilab-bench-")
    with keeper([browser, *CHROMIUM_FLAGS, f"--user-data-dir={profile}", "about:blank"], directory=profile) as process:
        launch(process)
        with connect(_first_window(Path(profile)), max_size=None, compression=None) as link:
            yield Tab(link)


def _first_window(profile: Path) -> str:
    """Returns the address of the debugging connection of the browser's window, once there is one."""
    deadline = time.monotonic() + PATIENCE
    file = profile / "DevToolsActivePort"
    while time.monotonic() < deadline:
        if file.is_file() and (lines := file.read_text().split()):
            with urllib.request.urlopen(f"http://127.0.0.1:{lines[0]}/json/list", timeout=PATIENCE) as answer:
                windows = [window for window in json.load(answer) if window["type"] == "page"]
            if windows:
                return windows[0]["webSocketDebuggerUrl"]
        time.sleep(0.05)
    raise DeadlineError("bench: the browser did not start; look at `rcilab doctor`, then try again")
