"""The robot under the jog buttons: held through the supervisor, or by one checked motion a step; the goal goes along.

Owned by the dispatcher's thread; it never waits for the robot.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

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
from rcilab.app.robot_connection import RobotConnection
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.status_text import tell_error
from rcilab.app.store import Store
from rcilab.core.clearance import ADVISED_DISTANCE, link_name
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import message

if TYPE_CHECKING:
    from rcilab.control_process import PendingRequest, SupervisorStatus
    from rcilab.core.arrays import JointVector


class RobotJog:
    """One jog of the robot after the other.

    Args:
        store: The state.
        session: The robot side.
        goal: Poses the goal.
    """

    def __init__(self, store: Store, session: RobotConnection, goal: GoalActions) -> None:
        self._store, self._session, self._goal = store, session, goal
        self._request: PendingRequest | None = None  # On its way, until the arm stands.
        self._followed: Goal | None = None  # The goal that was put where the arm was jogged to.

    def begin(self) -> bool:
        """Returns whether a button that is pressed now may move the robot; says why not."""
        state = self._store.state
        reason = no_jog(state, self._session.status())
        change_jog(self._store, said=reason)
        if reason is not None:
            return False
        if self._request is None or self._request.done:
            self._request = None
            self._store.remember()
        return True

    def renew(self, axis: Axis, stops: int | None) -> bool:
        """Informs the control process that a button is still held; returns False when that moves nothing any more.

        Args:
            axis: Which way.
            stops: How many stops had been heard of when the button said so.
        """
        state, status, request = self._store.state, self._session.status(), self._request
        if (request is not None and request.error is not None) or status.q_c is None or status.phase == "stopping":
            return False
        if request is not None and request.done and is_moving(status):
            return True  # It ended in the moment of the press; the next word begins another one.
        kind, values = jog_velocity(state.model, status.q_c, state.jog, axis)
        share, links = safe_share(state.model, status.q_c, kind, values)
        room = box_share(state.model, status.q_c, kind, values, state.setup.wanted.box)
        if room < STANDING:
            self.let_go()
            change_jog(self._store, said=message("jog.box"))
            return False
        if share < STANDING:
            self.let_go()
            first, second = (message(f"link.{link_name(link).split()[0]}", number=link) for link in links)
            change_jog(self._store, said=message("jog.near", first=first, second=second, distance=ADVISED_DISTANCE))
            return False
        try:
            continues = None if request is None or request.done else request
            self._request = self._session.supervisor().jog(
                kind, min(share, room) * values, continues=continues, stops=stops
            )
        except RcilabError as error:
            change_jog(self._store, said=tell_error(error, status))
            return False
        return True

    def let_go(self) -> None:
        """Brings what is held to rest."""
        with suppress(RcilabError):  # There is no supervisor, or none any more: nothing of ours moves.
            self._session.supervisor().release_jog()

    def step(self, axis: Axis, stops: int | None) -> None:
        """Makes one step: a planned motion, checked like any other, collisions too.

        Args:
            axis: Which way.
            stops: How many stops had been heard of when the button was pressed.
        """
        state, status = self._store.state, self._session.status()
        reason = no_jog(state, status) or (message("ready.moving") if is_moving(status) else None)
        if reason is not None or status.q_c is None:
            change_jog(self._store, said=reason)
            return
        led = take_step(state.model, status.q_c, state.jog, axis)
        change_jog(self._store, said=led.said)
        if led.q is None:
            return
        share = state.jog.speed * FASTEST_JOINT / float(state.model.limits.joint.velocity.max())
        box = state.setup.wanted.box
        made = make_plan(state.model, status.q_c, led.q, share, "jerk_limited", box)
        if isinstance(made, Plan) and (fast := fastest_tool(made) / FASTEST_TOOL) > 1.0:
            made = make_plan(state.model, status.q_c, led.q, share / fast, "jerk_limited", box)
        if not isinstance(made, Plan):
            change_jog(self._store, said=made)
            return
        report = made.completed().report
        if report.certificate is None:
            broken = message(f"condition.{report.violations[0].condition.id}")
            change_jog(self._store, said=message("jog.unsafe", condition=broken))
            return
        try:
            request = self._session.supervisor().execute(made.motion, report.certificate, stops=stops)
        except RcilabError as error:
            change_jog(self._store, said=tell_error(error, status))
            return
        self._store.remember()
        self._followed, self._request = None, request

    def watch(self, axis: Axis | None) -> bool:
        """Has the goal follow the arm; returns False when the button that is held moves nothing any more.

        Args:
            axis: What is held; None: nothing.
        """
        request = self._request
        if request is None:
            return True
        status = self._session.status()
        if status.q_c is not None and status.dq is not None:
            speed = float(np.abs(status.dq).max())
            if axis is not None or speed > STILL:
                self._follow(status.q_c)
            if axis is not None and speed < STILL and self._store.state.jog.said is None:
                change_jog(self._store, said=at_limit(self._store.state.model, status.q_c, axis))
        if not request.done or is_moving(status):
            return True
        self._end(request, status)
        return request.error is None

    def forget(self) -> None:
        """Drops what was jogged: it was another arm, or somewhere else."""
        self._request = self._followed = None

    def _follow(self, q: JointVector) -> None:
        if self._followed in (None, self._store.state.goal):  # Not when the goal was posed meanwhile.
            self._followed = self._goal.follow(q)

    def _end(self, request: PendingRequest, status: SupervisorStatus) -> None:
        if status.q_c is not None and self._followed in (None, self._store.state.goal):
            self._goal.pose(status.q_c)
        self._request = self._followed = None
        if request.error is not None:
            is_stopped = status.phase == "idle"
            change_jog(self._store, said=message("jog.stopped") if is_stopped else tell_error(request.error, status))
