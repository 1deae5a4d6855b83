"""The rows of `rcilab bench`, by name, and the process that measures one of them.

Every row has its own process, so that one row does not affect the next one.
`python -m rcilab.diagnostics.bench.rows NAME SECONDS FILE` is that process; it writes its result to the file.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from rcilab.core.errors import RcilabError

if TYPE_CHECKING:
    from rcilab.diagnostics.bench.measure import Absent, Measurement

ROWS = MappingProxyType(
    {
        "forward": "compute",
        "inverse": "compute",
        "inverse_batch": "compute",
        "feasible_arcs": "compute",
        "plan_joint": "compute",
        "program": "compute",
        "program_close": "compute",
        "check": "compute",
        "check_full": "compute",
        "check_joint_rows": "compute",
        "check_cell": "cell",
        "cell_drag": "cell",
        "plan_free": "cell",
        "controller_ideal": "controller",
        "controller_mujoco": "controller",
        "controller_cartesian": "controller",
        "controller_impedance": "controller",
        "franka_controller": "franka",
        "franka_cartesian": "franka",
        "record": "record",
        "lockstep": "controller",
        "client_answer": "client",
        "jog": "compute",
        "planner": "planner",
        "plan_line": "paths",
        "plan_arc": "paths",
        "replan": "paths",
        "drag": "page",
        "mirror": "mirror",
        "scrub": "seek_latency",
        "page_ready": "page_ready",
        "page_drag": "page_drag",
        "page_scrub": "seek_latency",
        "lab_slider": "notebook",
        "lab_shown": "notebook",
        "import": "start",
        "start": "start",
        "state_period": "controller",
        "franka_period": "franka",
        "franka_connect": "franka",
        "xarm_answer": "ufactory",
        "xarm_reports": "ufactory",
        "xarm_connect": "ufactory",
        "four_makers": "four_makers",
        "watching": "record",
        "control_loop": "page",
        "spectators": "viewer_load",
    }
)
"""Name of each row and the module of its function, in the order of execution; the slow ones are last."""

_STREAMING = frozenset({"control_loop", "spectators"})
"""Rows with the duration of streaming as argument."""


def measure(name: str, seconds: float) -> Measurement | Absent:
    """Measures a row in this process.

    Args:
        name: One of `ROWS`.
        seconds: Duration of streaming, for a row that streams, [s].
    """
    bench: Callable[..., Measurement | Absent] = getattr(
        import_module(f"rcilab.diagnostics.bench.{ROWS[name]}"), f"bench_{name}"
    )
    return bench(seconds) if name in _STREAMING else bench()


def main(arguments: Sequence[str]) -> int:
    """Measures a row and writes the result to a file; after a failure, the last line on stderr is the reason."""
    name, seconds, file = arguments
    try:
        found = measure(name, float(seconds))
    except RcilabError as error:
        print(error, file=sys.stderr)
        return 1
    Path(file).write_text(json.dumps(found.as_json()), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
