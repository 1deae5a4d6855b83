"""Motion that a controller plans by itself: queued targets, on-line commands, and a servo."""

from __future__ import annotations

from rcilab.sim.planner.planner import Planner, PlannerState
from rcilab.sim.planner.planner_event import EventKind, PlannerEvent, PlannerStep, Refusal, RefusalReason
from rcilab.sim.planner.planner_feed import FedStep, PlannerFeed
from rcilab.sim.planner.target import (
    ArcTarget,
    Blend,
    JointSpeed,
    JointTarget,
    LineTarget,
    PauseTarget,
    SplineTarget,
    Target,
    ToolSpeed,
)

__all__ = [
    "ArcTarget",
    "Blend",
    "EventKind",
    "FedStep",
    "JointSpeed",
    "JointTarget",
    "LineTarget",
    "PauseTarget",
    "Planner",
    "PlannerEvent",
    "PlannerFeed",
    "PlannerState",
    "PlannerStep",
    "Refusal",
    "RefusalReason",
    "SplineTarget",
    "Target",
    "ToolSpeed",
]
