"""Properties of this machine used by bench and doctor: browsers, and permission for real-time scheduling."""

from __future__ import annotations

import shutil
import subprocess
import sys

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "firefox", "microsoft-edge")
"""Names of browser executables."""

_CHROMIUM = BROWSERS[:4]
_PRIORITY = 80  # The highest priority of any rcilab process: that of the controller.


def find_browser(names: tuple[str, ...] = BROWSERS) -> str | None:
    """Returns the path of the first installed browser, or None."""
    return next((path for name in names if (path := shutil.which(name))), None)


def find_chromium() -> str | None:
    """Returns the path of a browser that can run headless with software rendering, or None."""
    return find_browser(_CHROMIUM)


def probe_realtime() -> tuple[bool, bool]:
    """Returns whether a control process gets SCHED_FIFO and locked memory; tested in a separate process."""
    code = (
        "from rcilab.realtime.scheduling import enter_realtime\n"
        f"s = enter_realtime({_PRIORITY}); print(s.policy, s.memory_locked)"
    )
    answer = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    policy, locked = answer.stdout.split()
    return policy == "SCHED_FIFO", locked == "True"
