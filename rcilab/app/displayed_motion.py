"""The motion that scene, timeline and curves draw instead of the plan: of a triggered fault, or of a notebook cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rcilab.app.planning import Plan, build_plan_view
from rcilab.conformance.check import check
from rcilab.motion import Motion
from rcilab.recording.run import Run
from rcilab.recording.run_setup import Setup

if TYPE_CHECKING:
    from rcilab.app.fault_lab.fault_demo import FaultDemo
    from rcilab.model.robot_model import RobotModel

_FEWEST = 8  # [cycles] A shorter run of a cell did not move anything.


@dataclass(frozen=True, eq=False, kw_only=True)
class DisplayedMotion:
    """A motion drawn instead of the plan. It cannot be executed."""

    plan: Plan
    """Drawn in timeline and curves: what was commanded; of a fault with the violating command and the stop after it."""
    scene: Plan
    """Drawn in the scene: of a run the same as `plan`; of a fault where the arm moved, measured unless
    a position command was wrong."""
    run: Run
    """The recorded cycles, measured and commanded, for the curves of measured values."""
    moment: float | None = None
    """Time of the fault report on the clock of `plan`, [s]; None without a fault."""


def display_fault(demo: FaultDemo) -> DisplayedMotion:
    """Returns a provoked fault as scene, timeline and curves draw it."""

    def draw(motion: Motion) -> Plan:
        reported = demo.cycle
        checked = Motion.from_cycles(motion.q[: reported + 1])  # The rest is the controller's stop.
        return build_plan_view(demo.model, motion, check(checked, demo.model, distance=None))

    commanded = demo.commanded
    return DisplayedMotion(
        plan=draw(commanded),
        scene=draw(demo.moved),
        run=Run(plan=commanded, cycles=demo.whole, model=demo.model, setup=Setup(mode=demo.scenario.mode)),
        moment=demo.time,
    )


def display_run(run: Run, model: RobotModel) -> DisplayedMotion | None:
    """Returns a run of `execute` or of a callback as it is drawn; None where there is too little to draw."""
    if len(run.cycles) < _FEWEST:
        return None
    motion = run.plan or run.commanded()
    plan = build_plan_view(model, motion, check(motion, model, distance=None))
    return DisplayedMotion(plan=plan, scene=plan, run=run)
