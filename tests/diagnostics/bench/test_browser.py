"""What rows that need a page say where none can be opened."""

from __future__ import annotations

import pytest

from rcilab.diagnostics.bench import browser, rows
from rcilab.diagnostics.bench.measure import Absent

PAGE_ROWS = ("page_ready", "page_drag", "page_scrub", "spectators")


@pytest.mark.parametrize("row", PAGE_ROWS)
def test_without_playwright_a_page_row_says_what_to_install(row, monkeypatch):
    monkeypatch.setattr(browser, "find_spec", lambda name: None)
    found = rows.measure(row, 1.0)
    assert found == Absent(name=row, note="PLAYWRIGHT IS NOT INSTALLED: pip install 'rcilab[bench]'")


@pytest.mark.parametrize("row", PAGE_ROWS)
def test_without_a_browser_a_page_row_says_what_to_install(row, monkeypatch):
    monkeypatch.setattr(browser, "find_spec", lambda name: object())
    monkeypatch.setattr(browser, "find_chromium", lambda: None)
    found = rows.measure(row, 1.0)
    assert found == Absent(name=row, note="NO BROWSER FOUND: install Chromium (apt install chromium)")
