"""A provoked fault as scene, timeline and curves draw it: what was commanded, where the arm was, what it did."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rcilab.app.planning import Plan, build_plan_view
from rcilab.core.clock import CYCLE_TIME

if TYPE_CHECKING:
    from rcilab.app.fault_lab.fault_demo import FaultDemo
    from rcilab.motion import Motion
    from rcilab.recording.run import Run


@dataclass(frozen=True, eq=False, kw_only=True)
class DemoMotion:
    """What is seen in place of the plan while a fault is on show. It is never one to execute."""

    exhibit: FaultDemo
    plan: Plan
    """What was commanded, the wrong command too, and the controller's way to rest."""
    scene: Plan
    """Where the arm is to be seen."""
    run: Run
    """What the arm did."""

    @property
    def moment(self) -> float:
        """When the fault was reported, on the clock of `plan`, [s]."""
        return self.exhibit.sample * CYCLE_TIME


def exhibition_of(exhibit: FaultDemo) -> DemoMotion:
    """Returns a fault as scene, timeline and curves draw it."""
    from rcilab.conformance.check import check
    from rcilab.motion import Motion
    from rcilab.recording.run import Run

    def draw(motion: Motion) -> Plan:
        judged = Motion.from_cycles(motion.q[: exhibit.sample + 1])  # From there on the way is the controller's.
        return build_plan_view(exhibit.model, motion, check(judged, exhibit.model, distance=None))

    commanded = exhibit.commanded
    return DemoMotion(
        exhibit=exhibit,
        plan=draw(commanded),
        scene=draw(exhibit.moved),
        run=Run(plan=commanded, cycles=exhibit.whole, model=exhibit.model),
    )
