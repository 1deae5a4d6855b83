"""One Chromium for all browser tests, one workbench with a virtual controller, a fresh page for each test.

All of it ends with this folder (scope "package", not "session"): Playwright leaves an event loop running in the test's
thread, and the workbench two 1 kHz loops under SCHED_FIFO; neither is fair to the tests that come after.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from browser.page import BenchPage, close_toasts

FLAGS = (
    "--no-sandbox --no-first-run --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader "
    # A graphics processor would have to be imitated: it is kept to what cannot do without, the scene.
    "--disable-gpu-rasterization --disable-gpu-compositing "
    "--disable-background-networking --disable-component-update --disable-sync --disable-default-apps "
    "--disable-background-timer-throttling --disable-renderer-backgrounding "
    "--disable-backgrounding-occluded-windows --force-color-profile=srgb"
).split()
VIEW = {"width": 960, "height": 620}


def find_chromium() -> str | None:
    for name in ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"):
        path = shutil.which(name)
        if path is not None:
            return path
    return None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    here = Path(__file__).parent
    for item in items:
        if item.path.is_relative_to(here):
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="package")
def chromium() -> Iterator[object]:
    path = find_chromium()
    if path is None:
        reason = "no Chromium found: install it (Debian: apt install chromium) to run the browser tests"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="package")
def bench() -> Iterator[object]:
    from rcilab.workbench.app import Workbench, WorkbenchConfig

    with Workbench(WorkbenchConfig(port=0, quality="light")) as workbench:
        yield workbench
        assert workbench.dispatcher.errors == []
        assert workbench.renderer.errors == []


@pytest.fixture(scope="package")
def opened(chromium, bench) -> Iterator[BenchPage]:
    """One page for all: opening it costs several seconds of software rendering."""
    context = chromium.new_context(viewport=VIEW)
    context.set_default_timeout(20_000)
    outside: list[str] = []

    def guard(route) -> None:
        if "://127.0.0.1" in route.request.url or route.request.url.startswith(("data:", "blob:")):
            route.continue_()
        else:
            outside.append(route.request.url)
            route.abort()

    context.route("**/*", guard)
    tab = context.new_page()
    page = BenchPage(tab, bench)
    tab.on("pageerror", lambda error: page.problems.append(str(error)))
    tab.goto(f"{bench.url}?fixedDpr=0.2")
    page.wait_until_drawn()
    close_toasts(tab)
    yield page
    context.close()
    assert outside == [], f"the page asked for something beyond this machine: {outside}"


@pytest.fixture
def page(opened) -> Iterator[BenchPage]:
    opened.start_afresh()
    yield opened
    assert opened.problems == [], f"the page's own script failed: {opened.problems}"
    assert opened.bench.dispatcher.errors == []
    assert opened.bench.renderer.errors == []


@pytest.fixture
def heard(page):
    """The page, taken for present: a busy machine may keep it silent for 2 s, which ends a motion."""
    ending = threading.Event()

    def beat() -> None:
        while not ending.wait(0.3):
            page.bench.session.heartbeat()

    thread = threading.Thread(target=beat)
    thread.start()
    yield page
    ending.set()
    thread.join()
