"""The guided lessons: steps that watch the state of the page and end when the learner has done them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from rcilab.app.run.plan_readiness import is_moving
from rcilab.makers.maker import find_missing_feature, maker_of

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.model.robot_model import RobotModel

StepCheck: TypeAlias = "Callable[[UiState, UiState, SupervisorStatus], bool]"
"""Whether the step is done, from the state at its beginning, the current state, and the robot's status."""

_POSED = 0.15  # [rad] At a larger distance from the arm, the learner has moved the goal on purpose.
_TURNED = 0.2  # [rad] Change of the arm angle.
_FAST = 0.95  # Speed to plan with, as a share of the limits.
_FELT = 3.0  # [N] More than the external force of an arm at standstill.


@dataclass(frozen=True, eq=False)
class LessonStep:
    """One step."""

    name: str
    """Its texts are lesson.LESSON.NAME in the catalogues."""
    is_done: StepCheck


def _distance(state: UiState, status: SupervisorStatus) -> float:
    return 0.0 if status.q_c is None else float(np.abs(state.goal.q - status.q_c).max())


def _posed(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return _distance(now, status) > _POSED and now.goal is not then.goal


def _checked(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.plan is not None and now.plan.complete and now.plan.report.ok


def _looked(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.plan is not None and (now.playing or now.playhead != then.playhead)


def _moving(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return is_moving(status)


def _arrived(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    run = None if now.last_run is None else now.last_run.run
    return run is not None and run.is_complete and not run.stopped and not run.faults and not is_moving(status)


def _fast(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.speed >= _FAST


def _refused(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.plan is not None and any(not row.ok for row in now.plan.report.rows)


def _sought(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.check.seek_count != then.check.seek_count


def _slowed(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.check.slowed is not None and now.check.slowed is not then.check.slowed


def _turned(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    if then.goal.psi is None or now.goal.psi is None:
        return False
    stays = float(np.abs(then.goal.target.position - now.goal.target.position).max()) < 1e-6
    return stays and abs(np.remainder(now.goal.psi - then.goal.psi + np.pi, 2.0 * np.pi) - np.pi) > _TURNED


def _other_branch(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.goal.target is then.goal.target and float(np.abs(now.goal.q - then.goal.q).max()) > _TURNED


def _physics(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.plant == "mujoco" and status.phase == "idle"


def _guided(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return status.code == "moving.guided"


def _pushed(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    force = status.tau_ext
    return force is not None and float(np.abs(np.asarray(force)[:3]).max()) > _FELT


def _let_go(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return status.phase == "idle" and status.code != "moving.guided"


def _provoked(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    show = now.learn.show
    return show is not None and show.demo.scenario.cuts_network


def _script(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.learn.is_script_shown


def _closed(then: UiState, now: UiState, status: SupervisorStatus) -> bool:
    return now.learn.show is None


def lessons_of(model: RobotModel) -> tuple[str, ...]:
    """Returns the names of the lessons for an arm."""
    maker = maker_of(model)
    possible = {
        "elbow": bool(model.redundancy),
        "push": find_missing_feature(model, "guiding") is None,
        "network": maker is not None and any(scenario.cuts_network for scenario in maker.scenarios(model)),
    }
    return tuple(name for name in LESSONS if possible.get(name, True))


LESSONS: Mapping[str, tuple[LessonStep, ...]] = MappingProxyType(
    {
        "first": (
            LessonStep("pose", _posed),
            LessonStep("look", _looked),
            LessonStep("check", _checked),
            LessonStep("execute", _moving),
            LessonStep("arrive", _arrived),
        ),
        "limits": (
            LessonStep("fast", _fast),
            LessonStep("far", _refused),
            LessonStep("row", _sought),
            LessonStep("slow", _slowed),
        ),
        "elbow": (
            LessonStep("pose", _posed),
            LessonStep("turn", _turned),
            LessonStep("branch", _other_branch),
        ),
        "push": (
            LessonStep("mujoco", _physics),
            LessonStep("guide", _guided),
            LessonStep("push", _pushed),
            LessonStep("stop", _let_go),
        ),
        "network": (
            LessonStep("cut", _provoked),
            LessonStep("script", _script),
            LessonStep("close", _closed),
        ),
    }
)
"""Every lesson, in the order of the list."""


class Watcher:
    """Watches one step: it keeps the state of the page at its beginning."""

    def __init__(self) -> None:
        self._then: UiState | None = None

    def is_done(self, step: LessonStep, state: UiState, status: SupervisorStatus) -> bool:
        """Returns whether the learner has done it; never at the first call."""
        if self._then is None:
            self._then = state
            return step.is_done is _checked and step.is_done(state, state, status)
        return step.is_done(self._then, state, status)
