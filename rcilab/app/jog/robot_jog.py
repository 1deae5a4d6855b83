"""The robot under the jog buttons: held through the supervisor, or one checked motion per step; the goal follows.

Owned by the dispatcher's thread; it never waits for the robot.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from rcilab.app.connection import PageConnection
from rcilab.app.goal.goal import Goal
from rcilab.app.goal.goal_actions import GoalActions
from rcilab.app.jog.jog_state import (
    FASTEST_JOINT,
    FASTEST_TOOL,
    STANDING,
    STILL,
    Axis,
    at_limit,
    box_share,
    change_jog,
    fastest_tool,
    jog_velocity,
    no_jog,
    safe_share,
)
from rcilab.app.jog.jog_step import take_step
from rcilab.app.planning import Plan, make_plan
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.core.clearance import ADVISED_DISTANCE, link_name
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import message

if TYPE_CHECKING:
    from rcilab.control_process import PendingRequest, SupervisorStatus
    from rcilab.core.arrays import JointVector


class RobotJog:
    """Jogs of the robot, one at a time.

    Args:
        store: The state.
        connection: The robot.
        goal: Sets the goal.
    """

    def __init__(self, store: Store, connection: PageConnection, goal: GoalActions) -> None:
        self._store, self._connection, self._goal = store, connection, goal
        self._request: PendingRequest | None = None  # In progress, until the arm stands still.
        self._followed: Goal | None = None  # The goal that was set to the jogged position.

    def begin(self) -> bool:
        """Returns whether a button may move the robot now; shows why not."""
        state = self._store.state
        reason = no_jog(state, self._connection.status())
        change_jog(self._store, sentence=reason)
        if reason is not None:
            return False
        if self._request is None or self._request.done:
            self._request = None
            self._store.push_undo()
        return True

    def renew(self, axis: Axis, stops: int | None) -> bool:
        """Informs the control process that a button is still held; returns False when that moves nothing any more.

        Args:
            axis: Direction.
            stops: Number of stops when the message of the button was sent.
        """
        state, status, request = self._store.state, self._connection.status(), self._request
        if (request is not None and request.error is not None) or status.q_c is None or status.phase == "stopping":
            return False
        if request is not None and request.done and is_moving(status):
            return True  # It ended just before the press; the next message begins another one.
        kind, values = jog_velocity(state.model, status.q_c, state.jog, axis)
        share, links = safe_share(state.model, status.q_c, kind, values)
        room = box_share(state.model, status.q_c, kind, values, state.setup.wanted.box)
        if room < STANDING:
            self.let_go()
            change_jog(self._store, sentence=message("jog.box"))
            return False
        if share < STANDING:
            self.let_go()
            first, second = (message(f"link.{link_name(link).split()[0]}", number=link) for link in links)
            change_jog(self._store, sentence=message("jog.near", first=first, second=second, distance=ADVISED_DISTANCE))
            return False
        try:
            continues = None if request is None or request.done else request
            self._request = self._connection.robot().jog(
                kind, min(share, room) * values, continues=continues, stops=stops
            )
        except RcilabError as error:
            change_jog(self._store, sentence=explain_error(error, status))
            return False
        return True

    def let_go(self) -> None:
        """Stops the jog of a held button."""
        with suppress(RcilabError):  # There is no supervisor, or no longer: nothing of ours moves.
            self._connection.robot().release_jog()

    def step(self, axis: Axis, stops: int | None) -> None:
        """Makes one step: a planned motion, checked like any other, collisions too.

        Args:
            axis: Direction.
            stops: Number of stops when the button was pressed.
        """
        state, status = self._store.state, self._connection.status()
        reason = no_jog(state, status) or (message("ready.moving") if is_moving(status) else None)
        if reason is not None or status.q_c is None:
            change_jog(self._store, sentence=reason)
            return
        result = take_step(state.model, status.q_c, state.jog, axis)
        change_jog(self._store, sentence=result.sentence)
        if result.q is None:
            return
        share = state.jog.speed * FASTEST_JOINT / float(state.model.limits.joint.velocity.max())
        box = state.setup.wanted.box
        made = make_plan(state.model, status.q_c, result.q, share, "jerk_limited", box)
        if isinstance(made, Plan) and (fast := fastest_tool(made) / FASTEST_TOOL) > 1.0:
            made = make_plan(state.model, status.q_c, result.q, share / fast, "jerk_limited", box)
        if not isinstance(made, Plan):
            change_jog(self._store, sentence=made)
            return
        report = made.completed(cell=state.cell_for(state.model)).report
        if report.certificate is None:
            violated = message(f"condition.{report.violations[0].condition.id}")
            change_jog(self._store, sentence=message("jog.unsafe", condition=violated))
            return
        try:
            request = self._connection.robot().execute(made.motion, report.certificate, stops=stops)
        except RcilabError as error:
            change_jog(self._store, sentence=explain_error(error, status))
            return
        self._store.push_undo()
        self._followed, self._request = None, request

    def watch(self, axis: Axis | None) -> bool:
        """Has the goal follow the arm; returns False if the held button moves nothing any more.

        Args:
            axis: The held button; None: none.
        """
        request = self._request
        if request is None:
            return True
        status = self._connection.status()
        if status.q_c is not None and status.dq is not None:
            speed = float(np.abs(status.dq).max())
            if axis is not None or speed > STILL:
                self._follow(status.q_c)
            if axis is not None and speed < STILL and self._store.state.jog.sentence is None:
                change_jog(self._store, sentence=at_limit(self._store.state.model, status.q_c, axis))
        if not request.done or is_moving(status):
            return True
        self._end(request, status)
        return request.error is None

    def forget(self) -> None:
        """Drops the jog: the arm or its destination has changed."""
        self._request = self._followed = None

    def _follow(self, q: JointVector) -> None:
        if self._followed in (None, self._store.state.goal):  # Not if the goal was changed meanwhile.
            self._followed = self._goal.follow(q)

    def _end(self, request: PendingRequest, status: SupervisorStatus) -> None:
        if status.q_c is not None and self._followed in (None, self._store.state.goal):
            self._goal.set_joints(status.q_c)
        self._request = self._followed = None
        if request.error is not None:
            is_stopped = status.phase == "idle"
            change_jog(
                self._store, sentence=message("jog.stopped") if is_stopped else explain_error(request.error, status)
            )
