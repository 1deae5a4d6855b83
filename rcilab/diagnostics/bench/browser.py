"""A page in a real headless browser, driven by playwright, as load next to a control loop."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from rcilab.core.errors import DeadlineError, RcilabError
from rcilab.diagnostics.host import find_chromium

if TYPE_CHECKING:
    from playwright.sync_api import Page

PAGE_TIMEOUT = 60.0  # [s] For every step on a page: software rendering on a busy machine takes several seconds.

_FLAGS = (
    "--no-sandbox",
    "--no-first-run",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-rasterization",  # Needs a graphics processor; Debian's launcher enables it.
)
_VIEW = {"width": 1280, "height": 800}


def why_no_page() -> str | None:
    """Returns why no page can be opened on this machine and what to install, or None."""
    if find_spec("playwright") is None:
        return "PLAYWRIGHT IS NOT INSTALLED: pip install 'rcilab[bench]'"
    if find_chromium() is None:
        return "NO BROWSER FOUND: install Chromium (apt install chromium)"
    return None


@contextmanager
def open_page(url: str) -> Iterator[Page]:
    """Opens an address in a new browser and waits until it is loaded; closes the browser afterwards.

    Raises:
        DeadlineError: The browser did not respond.
        RcilabError: The browser could not be started, or the page's script failed.
    """
    from playwright.sync_api import Error, TimeoutError, sync_playwright

    try:
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=find_chromium(), args=_FLAGS)
            yield open_window(browser, url)
            browser.close()
    except TimeoutError as error:
        raise DeadlineError(f"bench: {_first_line(error)}; check `rcilab doctor`, then try again") from error
    except Error as error:
        raise RcilabError(f"bench: the browser failed: {_first_line(error)}") from error


def open_window(browser: Any, url: str) -> Page:
    """Opens an address in another window of the same browser; all windows are rendered."""
    page = browser.new_page(viewport=_VIEW)
    page.set_default_timeout(1e3 * PAGE_TIMEOUT)
    page.goto(url)
    return page


def wait_on_page(page: Page, what: str, script: str) -> Any:
    """Waits until an expression is true on a page and returns its value.

    Raises:
        DeadlineError: It did not become true.
    """
    from playwright.sync_api import TimeoutError

    try:
        return page.wait_for_function(script, polling=50).json_value()
    except TimeoutError as error:
        raise DeadlineError(
            f"bench: waited {PAGE_TIMEOUT:g} s for {what}; check `rcilab doctor`, then try again"
        ) from error


def _first_line(error: Exception) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)
