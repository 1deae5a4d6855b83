"""Requests that jog: the goal or the robot moves while a button is held, or by one step per press.

Owned by the dispatcher's thread; it never waits for the robot.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from rcilab.app.connection import PageConnection
from rcilab.app.goal.goal_actions import GoalActions
from rcilab.app.jog.jog_state import (
    FRAMES,
    SLOWEST,
    STEPS,
    STILL,
    Axis,
    HoldJog,
    PressJog,
    at_limit,
    change_jog,
    inside,
    jog_velocity,
)
from rcilab.app.jog.jog_step import take_step
from rcilab.app.jog.robot_jog import RobotJog
from rcilab.app.request import Handlers, Request
from rcilab.app.store import Store
from rcilab.control_process.jog_record import HOLD_TIMEOUT
from rcilab.core.clock import CYCLE_TIME
from rcilab.motion import Jog

_LONGEST_LOOK = 100  # Maximum number of preview cycles in one tick: after a stall of the page nothing jumps.
_SAME = 1e-9  # [rad]
_FORGOTTEN = 2.0  # [s] A button that moves nothing any more must be silent for this time before it moves again.


@dataclass(frozen=True, slots=True, kw_only=True)
class SetJog(Request):
    """Settings of the jog; None leaves a value unchanged."""

    robot: bool | None = None
    """Whether the buttons move the robot, not the goal."""
    agreed: bool = False
    """Whether this is the second confirmation for a foreign robot."""
    step: float | None = None
    """Step per press, [mm] or [deg]; 0: moves while the button is held."""
    frame: str | None = None
    speed: float | None = None
    """Share of the fastest jog, 0 to 1."""


@dataclass
class _Press:
    """A button from its press to its release."""

    page: int | None
    axis: Axis
    last_seen: float
    """Time of the last message that it is held, [s]."""
    is_robot: bool
    is_spent: bool = False
    """Whether it moves nothing any more, though it is still held: it was refused, or its motion has ended."""

    def is_over(self, now: float) -> bool:
        """Returns whether it was silent for so long that it counts as released."""
        return now - self.last_seen > (_FORGOTTEN if self.is_spent else HOLD_TIMEOUT)


class JogActions:
    """The buttons of the Jog tab.

    Args:
        store: The state.
        connection: The robot.
        goal: Sets the goal.
    """

    def __init__(self, store: Store, connection: PageConnection, goal: GoalActions) -> None:
        self._store, self._goal = store, goal
        self._robot = RobotJog(store, connection, goal)
        self._press: _Press | None = None
        self._preview: Jog | None = None  # The moving goal, until it stops.
        self._context: tuple[object, ...] = ()

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            SetJog: self.set_jog,
            HoldJog: self.hold,
            PressJog: self.press,
        }

    def set_jog(self, request: SetJog) -> None:
        """Changes the settings; invalid values are ignored. A foreign robot needs a second confirmation."""
        state, changes = self._store.state, dict[str, object]()
        if request.step in STEPS:
            changes["step"] = request.step
        if request.frame in FRAMES:
            changes["frame"] = request.frame
        if request.speed is not None and math.isfinite(request.speed):
            changes["speed"] = min(max(request.speed, SLOWEST), 1.0)
        if request.robot is not None:
            is_asked = request.robot and state.target != "virtual" and not (request.agreed and state.jog.asked)
            changes |= {"robot": request.robot and not is_asked, "asked": is_asked, "sentence": None}
        self.release()
        change_jog(self._store, **changes)

    def hold(self, request: HoldJog) -> None:
        """Continues the jog of a button as long as messages that it is held arrive."""
        axis, state, now = Axis(request.axis, request.sign), self._store.state, time.monotonic()
        if state.jog.step or not axis.exists(state.model):
            return
        press = self._press
        if press is None or (press.page, press.axis) != (request.page, axis) or press.is_over(now):
            self.release()
            self._press = press = _Press(request.page, axis, now, state.jog.robot)
            press.is_spent = not (self._robot.begin() if press.is_robot else self._begin_preview(axis))
        press.last_seen = now
        if press.is_robot and not press.is_spent:
            press.is_spent = not self._robot.renew(axis, request.stops)

    def press(self, request: PressJog) -> None:
        """Makes a step, or ends the jog of a button that was released."""
        axis, state = Axis(request.axis, request.sign), self._store.state
        if not axis.exists(state.model):
            return
        if not state.jog.step:
            self.release()
        elif state.jog.robot:
            self._robot.step(axis, request.stops)
        else:
            self._step_goal(axis)

    def release(self) -> None:
        """Stops what a button moves."""
        press, self._press = self._press, None
        if press is not None and press.is_robot:
            self._robot.let_go()
        if self._preview is not None:
            self._preview.stop()

    def tick(self, elapsed: float) -> None:
        """Releases the button of a page that has fallen silent or has lost the controls."""
        state = self._store.state
        who = (state.target, state.model.name, state.plant, state.control_lock.holder)
        if who != self._context:
            self._context = who
            self._reset()
        press = self._press
        is_held = press is not None and press.is_robot and not press.is_spent
        # First: a jog that has ended stays ended, also after a long pause.
        if not self._robot.watch(press.axis if press is not None and is_held else None) and press is not None:
            press.is_spent = True
        if press is not None and press.is_over(time.monotonic()):
            self.release()
        if self._preview is not None:
            self._advance(self._preview, elapsed)

    def _begin_preview(self, axis: Axis) -> bool:
        state = self._store.state
        change_jog(self._store, sentence=None)
        self._store.push_undo()
        q = inside(state.model, state.goal.q)
        self._preview = Jog(state.model, q)
        kind, values = jog_velocity(state.model, q, state.jog, axis)
        if kind == "joint":
            self._preview.set_joint_velocity(values)
        else:
            self._preview.set_twist(values, frame=kind)
        return True

    def _advance(self, preview: Jog, elapsed: float) -> None:
        """Advances the goal as the robot would move."""
        for _ in range(min(round(elapsed / CYCLE_TIME), _LONGEST_LOOK)):
            preview.step()
        state, press = self._store.state, self._press
        if float(np.abs(preview.q - state.goal.q).max()) > _SAME:
            self._goal.set_joints(preview.q)
        if press is None:
            self._preview = None if preview.is_stationary else preview
        elif float(np.abs(preview.dq).max()) < STILL:
            change_jog(self._store, sentence=at_limit(state.model, preview.q, press.axis))

    def _step_goal(self, axis: Axis) -> None:
        state = self._store.state
        result = take_step(state.model, state.goal.q, state.jog, axis)
        change_jog(self._store, sentence=result.sentence)
        if result.q is not None:
            self._store.push_undo()
            self._goal.set_joints(result.q)

    def _reset(self) -> None:
        """Another arm, destination or operator: the buttons move the goal again until changed."""
        self.release()
        self._preview = None
        self._robot.forget()
        change_jog(self._store, robot=False, asked=False, sentence=None)
