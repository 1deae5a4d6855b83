"""What a cell did with the arm, as scene, timeline and curves draw it in place of the plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rcilab.app.planning import Plan, build_plan_view

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion
    from rcilab.recording.run import Run

_FEWEST = 8  # [cycles] A choice: what is shorter did not move anything.


@dataclass(frozen=True, eq=False, kw_only=True)
class CellRun:
    """A motion that a cell ran, by `execute` or by a callback. It is never one to execute again."""

    plan: Plan
    """What was meant to happen; of a callback what it commanded."""
    run: Run
    """What the arm did."""
    moment: None = None

    @property
    def scene(self) -> Plan:
        """Where the arm is to be seen."""
        return self.plan


def cell_run_of(run: Run, model: RobotModel) -> CellRun | None:
    """Returns a run as scene, timeline and curves draw it; None where there is next to nothing to draw."""
    from rcilab.conformance.check import check

    if len(run.cycles) < _FEWEST:
        return None
    motion = run.plan or _commanded(run)
    return CellRun(plan=build_plan_view(model, motion, check(motion, model, distance=None)), run=run)


def _commanded(run: Run) -> Motion:
    """Returns what a callback commanded, each row at the time of its command; of torques, where they led."""
    from rcilab.motion import Motion

    return Motion.from_cycles(run.q if run.setup.mode == "torque" else run.q_c[run.delay :])
