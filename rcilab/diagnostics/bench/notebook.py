"""Latencies of a notebook: display of the lab, and motion of the arm by a slider."""

from __future__ import annotations

import ast
import queue
import statistics
import subprocess
from typing import Any

from rcilab.core.errors import DeadlineError, RcilabError
from rcilab.diagnostics.bench.measure import Measurement, summarise

_KERNELS = 3
_SLIDES = 200
_TIMEOUT = 60.0  # [s]
_MAKE = """
import time, rcilab
model = rcilab.load_model("xMatePro7")
"""
_SHOW = """
begin = time.perf_counter()
from rcilab.notebook import Lab
from IPython.display import display
lab = Lab(model)
display(lab)
lab.scene.flush()
time.perf_counter() - begin
"""
_OPEN = """
begin = time.perf_counter()
for tab in range(len(lab.tabs.children)):
    lab.tabs.selected_index = tab
time.perf_counter() - begin
"""
_SLIDE = f"""
def slide(angle):
    begin = time.perf_counter()
    lab.jog.sliders[3].set_state({{"value": angle}})
    lab.scene.flush()
    return time.perf_counter() - begin
[slide(0.25 * step) for step in range({_SLIDES})]
"""


def bench_lab_shown() -> Measurement:
    """`Lab(model)` in a fresh kernel, from its import until everything visible has been sent to the browser."""
    shown, opened = zip(*(_run_cells(_SHOW, _OPEN) for _ in range(_KERNELS)), strict=True)
    note = (
        f"{_KERNELS} fresh kernels, the model loaded; imports included; the other tabs are built when they are "
        f"opened, {statistics.median(opened):.2f} s for all of them"
    )
    return summarise("lab_shown", shown, "s", 2.0, note)


def bench_lab_slider() -> Measurement:
    """From a slider's message in the kernel until the new pose is sent to the scene, with all tabs of `Lab` open."""
    *_, times = _run_cells(_SHOW, _OPEN, _SLIDE)
    note = f"{_SLIDES} messages of a joint slider; each updates scene, target, arm-angle circle and tables"
    return summarise("lab_slider", times, "ms", 50.0, note)


def _run_cells(*cells: str) -> list[Any]:
    """Runs cells in a new kernel and returns their values."""
    from jupyter_client.manager import start_new_kernel

    manager, client = start_new_kernel(startup_timeout=_TIMEOUT, stderr=subprocess.DEVNULL)
    try:
        _run(client, _MAKE)
        return [_run(client, cell) for cell in cells]
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)


def _run(client: Any, code: str) -> Any:
    request, value = client.execute(code), None
    while True:
        try:
            reply = client.get_iopub_msg(timeout=_TIMEOUT)
        except queue.Empty as error:
            raise DeadlineError(f"bench: the kernel sent nothing for {_TIMEOUT:g} s") from error
        if reply["parent_header"].get("msg_id") != request:
            continue
        content = reply["content"]
        if reply["msg_type"] == "error":
            raise RcilabError(f"bench: the notebook failed with {content['ename']}: {content['evalue']}")
        if reply["msg_type"] == "execute_result":
            value = ast.literal_eval(content["data"]["text/plain"])
        if reply["msg_type"] == "status" and content["execution_state"] == "idle":
            return value
