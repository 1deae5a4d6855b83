"""What bench and doctor both ask this machine: its browsers, and whether our loops get real-time scheduling."""

from __future__ import annotations

import shutil
import subprocess
import sys

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "firefox", "microsoft-edge")
"""Names a browser may have on the path."""

_CHROMIUM = BROWSERS[:4]
_PRIORITY = 80  # The highest that any of our processes asks for: the controller.


def find_browser(names: tuple[str, ...] = BROWSERS) -> str | None:
    """Returns the path of the first browser that is installed, or None."""
    return next((path for name in names if (path := shutil.which(name))), None)


def find_chromium() -> str | None:
    """Returns the path of a browser that can run without a display and draw in software, or None."""
    return find_browser(_CHROMIUM)


def probe_realtime() -> tuple[bool, bool]:
    """Returns whether a control process gets SCHED_FIFO and locked memory, tried in a process that then ends."""
    code = (
        "from rcilab.realtime.scheduling import enter_realtime\n"
        f"s = enter_realtime({_PRIORITY}); print(s.policy, s.memory_locked)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    policy, locked = answer.stdout.split()
    return policy == "SCHED_FIFO", locked == "True"
