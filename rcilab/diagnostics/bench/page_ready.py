"""Time until an opened page can be used."""

from __future__ import annotations

import statistics

from rcilab.diagnostics.bench.browser import open_page, wait_on_page, why_no_page
from rcilab.diagnostics.bench.empty_page import bare_page
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.diagnostics.host import find_chromium
from rcilab.workbench.app import Workbench, WorkbenchConfig

_LOADS = 3
_DRAWN = "window.__viserTestpoints?.rendererInfo?.render?.frame > 1"
_USABLE = f"""{_DRAWN} && window.__viserMutable?.nodeRefFromName?.['/live']
  && document.querySelectorAll('[role=slider]').length > 5 && document.querySelectorAll('.rl-chip').length > 5"""
_WATCH = """(() => {
  const isUsable = () => USABLE;
  const look = () => {
    if (isUsable()) window.__usable = performance.now() - performance.getEntriesByType('navigation')[0].loadEventEnd;
    else setTimeout(look, 20);
  };
  look();
})()"""


def bench_page_ready() -> Measurement | Absent:
    """From the browser's load event until the page can be used: arm, controls and status are shown."""
    if (reason := why_no_page()) is not None:
        return Absent(name="page_ready", note=reason)
    ours: list[float] = []
    empty: list[float] = []
    with Workbench(WorkbenchConfig(port=0, quality="light")) as bench, bare_page() as (_, url):
        for _ in range(_LOADS):
            ours.append(_load(bench.url, _USABLE))
            empty.append(_load(url, _DRAWN))
    note = f"{_LOADS} loads in fresh browsers, light graphics, in {find_chromium()}, drawn in software; "
    note += f"viser's page without arm and controls, alternating with it: {statistics.median(empty):.2f} s"
    return summarise("page_ready", ours, "s", 2.0, note)


def _load(url: str, usable: str) -> float:
    """Returns the time from a fresh browser's load event until an expression is true, [s]."""
    with open_page(url) as page:
        page.evaluate(_WATCH.replace("USABLE", usable))
        return 1e-3 * float(wait_on_page(page, "the page to be usable", "window.__usable"))
