"""Shows the motions of a foreign client on a page that watches its controller: commands as the plan, and the run."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.app.goal.goal import goal_at
from rcilab.app.planning import Plan, build_plan_view
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.run.watched_controller import WatchedController
from rcilab.app.setup.configuration_state import SetupState
from rcilab.i18n.error_messages import describe_note
from rcilab.i18n.translator import message
from rcilab.makers.configuration import RobotConfiguration
from rcilab.model.robot_model import RobotModel
from rcilab.recording.client_motions import LAG, ClientMotion, MotionPart
from rcilab.recording.client_report import check_client
from rcilab.recording.run import Run, build_run
from rcilab.recording.sent_motion import with_soft_limits

if TYPE_CHECKING:
    from rcilab.app.store import Store

_PERIOD = 0.4  # [s] Between two drawings of a motion in progress; drawing and check of 10 s take a third of it.
_WINDOW = 10_000  # [cycles] Of a motion in progress.
_LONGEST = 60_000  # [cycles] Of a finished motion; its record in a file is complete.
_FEWEST = 2  # [cycles]


class WatchActions:
    """Owned by the dispatcher's thread.

    Args:
        store: The state.
        controller: The watched controller.
    """

    def __init__(self, store: Store, controller: WatchedController) -> None:
        self._store, self._controller = store, controller
        self._rows: list[NDArray[np.void]] = []
        self._count = 0  # Cycles of the motion so far.
        self._next = 0  # Number of the row after them.
        self._motion: ClientMotion | None = None
        self._shown = float("-inf")
        self._setup: RobotConfiguration | None = None  # The one that is shown.

    def tick(self) -> None:
        """Shows what is new."""
        world = self._store.state.world.status
        if world is not None:
            self._controller.follow(world)
        if self._controller.setup is not self._setup:
            self._show_setup()
        for part in self._controller.poll():
            self._add(part)
        if self._motion is not None and self._has_rows and time.monotonic() - self._shown > _PERIOD:
            self._show(_WINDOW)
            self._shown = time.monotonic()

    @property
    def _has_rows(self) -> bool:
        return sum(map(len, self._rows)) >= _FEWEST

    def _add(self, part: MotionPart) -> None:
        if self._motion is not part.motion or part.skipped:
            self._motion, self._rows, self._count = part.motion, [], part.skipped
        if len(part.cycles):
            self._rows.append(part.cycles)
            self._count += len(part.cycles)
            self._next = part.next
        if part.end is not None:
            if self._has_rows:
                goal = goal_at(self._store.state.model, self._rows[-1]["q_c"][-1])
                self._store.update(goal=goal)  # Before the check, which takes its time.
                self._show(_LONGEST, part.end.stopped, has_ended=True)
            self._report(part)
            self._motion = None

    def _show_setup(self) -> None:
        """Shows what the controller has, also in the scene."""
        held = self._setup = self._controller.setup
        box, tool, load = held.box, held.tool, held.load
        is_drawn = {
            "box": box is not None and box.active,
            "tool": tool is not None and not np.allclose(tool.matrix, np.eye(4)),
            "load": load is not None and load.mass > 0.0,
        }
        setup = SetupState(
            wanted=SetupState().wanted.updated(held), seen=frozenset(part for part, drawn in is_drawn.items() if drawn)
        )
        model = held.applied_to(self._controller.model)
        self._store.update(model=model, setup=setup, goal=goal_at(model, self._store.state.goal.q))

    def _show(self, longest: int, stopped: str | None = None, *, has_ended: bool = False) -> None:
        assert self._motion is not None
        self._rows = [np.concatenate(self._rows)[-_LONGEST:].copy()]
        self._controller.refresh(self._rows[0] if has_ended else self._rows[0][-LAG:], self._next)
        cycles = self._rows[0][-longest:]
        is_whole = len(cycles) == self._count
        if not is_whole:
            cycles = cycles.copy()
            cycles["t"] -= cycles["t"][0]
        model, setup = self._motion.model, self._motion.setup
        run = build_run(cycles, plan=None, stopped=stopped, truncated=not is_whole, model=model, setup=setup)
        plan, recording = draw_plan(run, model), whole_recording(run)
        self._store.update(
            plan=plan, no_plan=None, recording=recording, last_run=recording if has_ended else None, playhead=1.0
        )

    def _report(self, part: MotionPart) -> None:
        end, motion = part.end, part.motion
        assert end is not None
        facts = {"number": motion.number, "client": motion.client, "lost": end.lost, "late": end.late}
        if end.stopped is None:
            self._store.notify("good", message("watch.ended", **facts))
            return
        first, *more = end.stopped.parts
        code = "watch.stopped_more" if more else "watch.stopped"
        self._store.notify("bad", message(code, **facts, reason=describe_note(first), more=len(more)))


def draw_plan(run: Run, model: RobotModel) -> Plan:
    """Returns the commands of a run as scene, timeline and curves draw a plan: those that are checked.

    They end with the newest one, or with a refused one.
    """
    report = check_client(run)
    plan = build_plan_view(with_soft_limits(model, run), report.motion, report)
    return replace(plan, complete=True, is_recorded=True)
