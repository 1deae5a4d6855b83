"""Values computed for the scene from goal and plan, updated in every tick, and its requests. Owned by the dispatcher.

A tick looks at the newest goal and plan only: a drag that comes faster than ticks does not wait for any of this.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

from rcilab.app.goal.elbow import compute_elbow
from rcilab.app.goal.goal_actions import GoalActions, SetArmAngle
from rcilab.app.request import Handlers, Request
from rcilab.app.scene.closest import compute_closest
from rcilab.app.scene.path_strip import compute_path_strip
from rcilab.app.scene.scene_extras import (
    EXTRAS,
    WorkspaceCut,
    compute_ellipsoid,
    compute_swept_volume,
    compute_workspace,
)
from rcilab.app.store import Store
from rcilab.i18n.translator import message
from rcilab.views.elbow_view import OUTWARD


@dataclass(frozen=True, slots=True, kw_only=True)
class DragElbow(Request):
    """The handle on the elbow's circle was dragged."""

    eye: tuple[float, ...]
    """Where the page's camera is, base axes, [m]."""
    hand: tuple[float, ...]
    """A point under the mouse, base axes, [m]."""
    phase: Literal["start", "update", "end"]

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"elbow.{self.page}" if self.phase == "update" else None


@dataclass(frozen=True, slots=True, kw_only=True)
class HighlightBranch(Request):
    """A branch of the list is under the mouse or has the focus."""

    is_silent: ClassVar[bool] = True

    index: int | None
    """From 0, in the order of the list; None when it is left."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"HighlightBranch.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class EditElbow(Request):
    """The elbow's handle or its controls are pointed at, or are left: its circle is shown meanwhile."""

    is_silent: ClassVar[bool] = True

    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowViolation(Request):
    """Go to a violation on the path and say what it is."""

    number: int
    """From 0, worst first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowExtra(Request):
    """Show or hide one of the things that the scene has switches for."""

    name: str
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class CutWorkspace(Request):
    """A plane across the drawn workspace was moved."""

    axis: Literal["none", "x", "y", "z"]
    at: float
    """Where it crosses that axis of the base, [m]."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"CutWorkspace.{self.page}"


class SceneActions:
    """The elbow's circle, the path with its markers, the branch under the mouse, and what is behind switches.

    Args:
        store: The state.
        goal: Moves the elbow.
    """

    def __init__(self, store: Store, goal: GoalActions) -> None:
        self._store, self._goal = store, goal
        self._seen: dict[str, tuple[object, ...]] = {}
        self._executor = ThreadPoolExecutor(1, thread_name_prefix="scene")
        self._made: dict[str, Future[Any]] = {}

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            DragElbow: self.drag_elbow,
            HighlightBranch: self.peek,
            EditElbow: lambda request: self._change(is_elbow_edited=request.on),
            ShowViolation: self.show_violation,
            ShowExtra: self.show_extra,
            CutWorkspace: self.cut,
        }

    def close(self) -> None:
        """Drops what is being computed."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    def drag_elbow(self, request: DragElbow) -> None:
        """Turns the elbow to where the mouse sees its circle."""
        elbow = self._store.state.scene.elbow
        numbers = (*request.eye, *request.hand)
        if elbow is None or len(numbers) != 6 or not all(math.isfinite(number) for number in numbers):
            return
        if request.phase == "start":
            self._store.push_undo()
            return
        psi = elbow.circle.angle_along(request.eye, request.hand, elbow.psi, OUTWARD)
        self._goal.set_arm_angle(SetArmAngle(page=request.page, psi=psi), elbow.branch)

    def peek(self, request: HighlightBranch) -> None:
        """Shows a branch before it is chosen."""
        solutions = self._store.state.goal.reach.solutions
        known = solutions is not None and request.index is not None and 0 <= request.index < len(solutions)
        self._change(peek=request.index if known else None)

    def show_violation(self, request: ShowViolation) -> None:
        """Takes the preview to a violation and says what it is."""
        state = self._store.state
        ribbon = state.scene.ribbon
        if ribbon is None or not 0 <= request.number < len(ribbon.markers):
            return
        bead = ribbon.markers[request.number]
        self._store.update(playhead=bead.playhead, playing=False)
        self._store.notify("bad", message("notice.plain", text=bead.violations[0]))

    def show_extra(self, request: ShowExtra) -> None:
        """Turns a switch."""
        extra = next((name for name in EXTRAS if name == request.name), None)
        if extra is not None:
            extras = self._store.state.scene.extras
            self._change(extras=extras | {extra} if request.on else extras - {extra})

    def cut(self, request: CutWorkspace) -> None:
        """Draws the workspace up to a plane only, or all of it."""
        if request.axis == "none":
            self._change(cut=None)
        elif math.isfinite(request.at):
            self._change(cut=WorkspaceCut(axis=request.axis, at=request.at))

    def tick(self) -> None:
        """Looks at what has changed since the last tick."""
        state = self._store.state
        model, goal, plan, box = state.model, state.goal, state.plan, state.setup.wanted.box
        extras = state.scene.extras
        if self._is_new("elbow", model, goal, box):
            self._change(elbow=compute_elbow(model, goal.q, box), peek=None)
        if self._is_new("ribbon", None if plan is None else plan.report):
            self._change(ribbon=None if plan is None else compute_path_strip(plan))
            self._change(closest=None if plan is None else compute_closest(plan))
        if self._is_new("ellipsoid", *((model, goal.q) if "ellipsoid" in extras else ())):
            self._change(ellipsoid=compute_ellipsoid(model, goal.q) if "ellipsoid" in extras else None)
        self._compute("cloud", (model,) if "cloud" in extras else (), lambda: compute_workspace(model))
        moved = () if plan is None or "swept" not in extras else (model, plan.motion)
        self._compute("swept", moved, lambda: compute_swept_volume(model, plan.motion))  # type: ignore[union-attr]

    def _compute(self, name: str, wanted: tuple[object, ...], work: Callable[[], Any]) -> None:
        """Computes a value in the background when its inputs have changed, and shows it once it is ready."""
        running = self._made.get(name)
        if running is not None and running.done():
            del self._made[name]
            self._change(**{name: running.result()})
        elif running is None and self._is_new(name, *wanted):
            self._change(**{name: None})
            if wanted:
                self._made[name] = self._executor.submit(work)

    def _is_new(self, name: str, *of: object) -> bool:
        """Returns whether something is to be looked at again: by identity, as all of it is frozen."""
        before = self._seen.get(name)
        if before is not None and len(before) == len(of) and all(a is b for a, b in zip(before, of, strict=True)):
            return False
        self._seen[name] = of
        return True

    def _change(self, **changes: Any) -> None:
        scene = self._store.state.scene
        if any(getattr(scene, name) is not value for name, value in changes.items()):
            self._store.update(scene=replace(scene, **changes))
