"""The lab inside a notebook: parts that combine freely, and `Lab`, all parts in one cell.

from rcilab.notebook import JogPanel, Lab, MotionPlot, Scene
jog = JogPanel(model)          # A part is displayed as the last line of a cell.
Scene(jog)                     # Given another part, it shows the same arm.
Lab(model)                     # All parts.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.notebook.fault_panel import FaultPanel as FaultPanel
    from rcilab.notebook.jog_panel import JogPanel as JogPanel
    from rcilab.notebook.lab_widget import Lab as Lab
    from rcilab.notebook.motion_plot import MotionPlot as MotionPlot
    from rcilab.notebook.plan_panel import PlanPanel as PlanPanel
    from rcilab.notebook.report_view import ReportView as ReportView
    from rcilab.notebook.run_panel import RunPanel as RunPanel
    from rcilab.notebook.scene import Scene as Scene
    from rcilab.notebook.target_panel import TargetPanel as TargetPanel
    from rcilab.notebook.timeline import Timeline as Timeline

_MODULES = {
    "FaultPanel": "fault_panel",
    "JogPanel": "jog_panel",
    "Lab": "lab_widget",
    "MotionPlot": "motion_plot",
    "PlanPanel": "plan_panel",
    "ReportView": "report_view",
    "RunPanel": "run_panel",
    "Scene": "scene",
    "TargetPanel": "target_panel",
    "Timeline": "timeline",
}

__all__ = sorted(_MODULES)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> object:
    """Loads a part at its first use."""
    if name not in _MODULES:
        raise AttributeError(f"module 'rcilab.notebook' has no name {name!r}; it has: {', '.join(__all__)}")
    value = getattr(import_module(f"rcilab.notebook.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
