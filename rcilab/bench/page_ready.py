"""How long a person looks at a page that cannot be used yet."""

from __future__ import annotations

from rcilab.bench.browser import find_chromium
from rcilab.bench.measure import Absent, Measurement, summarise
from rcilab.bench.tab import no_browser, open_tab
from rcilab.workbench.app import Workbench, WorkbenchConfig

_LOADS = 3
_WATCH = """(() => {
  const isUsable = () => window.__viserMutable?.nodeRefFromName?.['/live']
    && window.__viserTestpoints?.rendererInfo?.render?.frame > 1
    && document.querySelectorAll('[role=slider]').length > 5 && document.querySelectorAll('.rl-chip').length > 5;
  const look = () => {
    if (isUsable()) window.__usable = performance.now() - performance.getEntriesByType('navigation')[0].loadEventEnd;
    else setTimeout(look, 20);
  };
  look();
})()"""


def bench_page_ready() -> Measurement | Absent:
    """From the browser's load event until the page can be used: arm drawn, controls and status there."""
    browser = find_chromium()
    if browser is None:
        return no_browser("page_ready")
    times: list[float] = []
    with Workbench(WorkbenchConfig(port=0, quality="light")) as bench:
        for _ in range(_LOADS):
            with open_tab(browser) as tab:
                tab.open(bench.url)
                tab.evaluate(_WATCH)
                times.append(1e-3 * float(tab.wait("the page to be usable", "window.__usable")))
    note = f"{_LOADS} loads in fresh browsers, light graphics, in {browser}, drawn in software"
    return summarise("page_ready", times, "s", 2.0, note)
