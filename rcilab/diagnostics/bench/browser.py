"""A real browser with the page open, because that is what a control loop shares its machine with."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from rcilab.diagnostics.bench.child_guard import keeper, launch

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "firefox", "microsoft-edge")
"""Names a browser may have on the path."""

_CHROMIUM = BROWSERS[:4]
CHROMIUM_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--no-first-run",
    "--window-size=1280,800",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-rasterization",  # Off wherever there is no such processor; Debian's launcher switches it on.
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-default-apps",
    "--disable-background-timer-throttling",
    "--disable-renderer-backgrounding",
    "--remote-debugging-port=0",  # Keeps a headless Chromium open after the page has loaded.
)


def find_browser(names: tuple[str, ...] = BROWSERS) -> str | None:
    """Returns the path of the first browser that is installed, or None."""
    return next((path for name in names if (path := shutil.which(name))), None)


def find_chromium() -> str | None:
    """Returns the path of a browser that can run without a display and draw in software, or None."""
    return find_browser(_CHROMIUM)


@contextmanager
def open_page(url: str, browser: str) -> Iterator[None]:
    """Keeps a page open in a headless Chromium of our own; it and its profile are gone afterwards, and when we die."""
    profile = tempfile.mkdtemp(prefix="rcilab-bench-")
    with keeper([browser, *CHROMIUM_FLAGS, f"--user-data-dir={profile}", url], directory=profile) as process:
        launch(process)
        yield
