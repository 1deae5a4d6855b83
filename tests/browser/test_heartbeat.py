"""A page that is slow, and one that is gone."""

from __future__ import annotations

import time

import pytest

from tests.browser.page import wait_for

pytestmark = pytest.mark.browser


def test_a_page_that_is_held_up_by_drawing_keeps_the_controls(page) -> None:
    store = page.bench.store
    wait_for(lambda: store.state.lease.holder is not None, "a holder", 20.0, page.tab)
    holder = store.state.lease.holder
    page.tab.evaluate("setTimeout(() => { const end = Date.now() + 5000; while (Date.now() < end); }, 0)")
    end, holders = time.monotonic() + 4.5, set()
    while time.monotonic() < end:  # Without a word to the page: it could not answer.
        holders.add(store.state.lease.holder)
        time.sleep(0.05)
    assert holders == {holder}


def test_a_page_that_is_closed_is_gone_at_once(chromium, page) -> None:
    store = page.bench.store
    before = store.state.lease.pages
    context = chromium.new_context(viewport={"width": 400, "height": 300})
    tab = context.new_page()
    tab.goto(f"{page.bench.url}?fixedDpr=0.2")
    wait_for(lambda: len(store.state.lease.pages) == len(before) + 1, "another page", 30.0, tab)
    tab.close()
    wait_for(lambda: store.state.lease.pages == before, "the page to be gone", 2.0 + 3.0)
    context.close()
