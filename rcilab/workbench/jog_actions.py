"""What happens when somebody jogs: the goal or the robot moves while a button is held, or by one step a press.

Owned by the conductor's thread; it never waits for the robot.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rcilab.clock import CYCLE_TIME
from rcilab.errors import RcilabError
from rcilab.kinematics.collision import link_name
from rcilab.motion import Jog
from rcilab.supervisor.jog_command import HOLD_TIMEOUT
from rcilab.workbench import requests
from rcilab.workbench.goal_actions import GoalActions
from rcilab.workbench.jogging import (
    FASTEST_JOINT,
    FRAMES,
    SLOWEST,
    STEPS,
    Axis,
    at_limit,
    inside,
    is_too_near,
    jog_velocity,
    no_jog,
    step_joint,
    step_pose,
)
from rcilab.workbench.planning import Plan, make_plan
from rcilab.workbench.reach import judge_pose
from rcilab.workbench.readiness import is_moving
from rcilab.workbench.session import Session
from rcilab.workbench.store import Goal, Store
from rcilab.workbench.telling import tell_error
from rcilab.workbench.text import Message, message

if TYPE_CHECKING:
    from rcilab.arrays import JointVector
    from rcilab.supervisor import Ticket

_LONGEST_LOOK = 100  # Cycles a preview goes on at most in one tick: a page that stood still does not jump.
_STILL = 1e-3  # [rad/s] A choice: below this a jogged joint has come to rest.


@dataclass
class _Press:
    """A button from its press to its release."""

    page: int | None
    axis: Axis
    heard: float
    """When it was last said to be held, [s]."""
    is_robot: bool
    is_spent: bool = False
    """Whether it moves nothing any more, though it is still held: it was refused, or something ended the motion."""


class JogActions:
    """The buttons of the Jog tab.

    Args:
        store: The state.
        session: The robot side.
        goal: Poses the goal.
    """

    def __init__(self, store: Store, session: Session, goal: GoalActions) -> None:
        self._store, self._session, self._goal = store, session, goal
        self._press: _Press | None = None
        self._preview: Jog | None = None  # The goal on its way, until it stands.
        self._ticket: Ticket | None = None  # The robot on its way, until it stands.
        self._followed: Goal | None = None  # The goal that was put where the robot was jogged to.
        self._distance: float | None = None
        self._robot: tuple[object, ...] = ()

    def set_jog(self, request: requests.SetJog) -> None:
        """Changes how to jog; what does not exist is ignored. A foreign robot is jogged after a second yes only."""
        state, changes = self._store.state, dict[str, object]()
        if request.step in STEPS:
            changes["step"] = request.step
        if request.frame in FRAMES:
            changes["frame"] = request.frame
        if request.speed is not None and math.isfinite(request.speed):
            changes["speed"] = min(max(request.speed, SLOWEST), 1.0)
        if request.robot is not None:
            is_asked = request.robot and state.target != "virtual" and not (request.agreed and state.jog.asked)
            changes |= {"robot": request.robot and not is_asked, "asked": is_asked, "said": None}
        self.release()
        self._change(**changes)

    def hold(self, request: requests.HoldJog) -> None:
        """Goes on with the jog of a button, for as long as it is said again and again."""
        axis, state, now = Axis(request.axis, request.sign), self._store.state, time.monotonic()
        if state.jog.step or not axis.exists(state.model):
            return
        press = self._press
        if press is None or (press.page, press.axis) != (request.page, axis) or now - press.heard > HOLD_TIMEOUT:
            self.release()
            self._press = press = _Press(request.page, axis, now, state.jog.robot)
            self._begin(press)
        press.heard = now
        if press.is_robot and not press.is_spent:
            self._renew(press)

    def press(self, request: requests.PressJog) -> None:
        """Makes a step, or ends what was held: a button says so when it is released."""
        axis, state = Axis(request.axis, request.sign), self._store.state
        if not axis.exists(state.model):
            return
        if not state.jog.step:
            self.release()
            return
        self._change(said=None)
        if state.jog.robot:
            self._step_robot(axis)
        else:
            self._step_goal(axis)

    def release(self) -> None:
        """Brings to rest what a button moves."""
        press, self._press = self._press, None
        if press is not None and press.is_robot:
            self._let_go()
        if self._preview is not None:
            self._preview.stop()

    def tick(self, elapsed: float) -> None:
        """Lets go for who has gone silent, moves the goal on, follows the robot."""
        state, press = self._store.state, self._press
        robot = (state.target, state.model.name, state.plant, state.lease.holder)
        if robot != self._robot:
            self._robot = robot
            self._follow_another()
        if press is not None and (time.monotonic() - press.heard > HOLD_TIMEOUT or not state.lease.allows(press.page)):
            self.release()
        if self._preview is not None:
            self._advance(self._preview, elapsed)
        if self._ticket is not None:
            self._watch(self._ticket, elapsed)

    def _begin(self, press: _Press) -> None:
        """Takes the first word of a button that is held."""
        state = self._store.state
        self._change(said=None)
        if not press.is_robot:
            self._store.remember()
            q = inside(state.model, state.goal.q)
            self._preview = Jog(state.model, q)
            kind, values = jog_velocity(state.model, q, state.jog, press.axis)
            if kind == "joint":
                self._preview.set_joint_velocity(values)
            else:
                self._preview.set_twist(values, frame=kind)
        elif not self._refuse(no_jog(state, self._session.status())):
            self._distance = None
            if self._ticket is not None and self._ticket.done:
                self._ticket = None
            if self._ticket is None:
                self._store.remember()
        else:
            press.is_spent = True

    def _renew(self, press: _Press) -> None:
        """Tells the control process that the button is still held; one whose motion has been ended moves no more."""
        state, status = self._store.state, self._session.status()
        ticket = self._ticket
        if (ticket is not None and ticket.error is not None) or status.q_c is None or status.phase == "stopping":
            press.is_spent = True
            return
        if ticket is not None and ticket.done and is_moving(status):
            return  # It ended in the moment of the press; the next word begins another one.
        try:
            kind, values = jog_velocity(state.model, status.q_c, state.jog, press.axis)
            self._ticket = self._session.supervisor().jog(kind, values)
        except RcilabError as error:
            press.is_spent = True
            self._change(said=tell_error(error, status))

    def _advance(self, preview: Jog, elapsed: float) -> None:
        """Moves the goal on as the robot would go."""
        for _ in range(min(round(elapsed / CYCLE_TIME), _LONGEST_LOOK)):
            preview.step()
        if np.abs(preview.q - self._store.state.goal.q).max() > 1e-9:
            self._goal.pose(preview.q)
        if self._press is not None:
            self._tell_limit(self._press, preview.q, preview.dq)
        elif preview.is_at_rest:
            self._preview = None

    def _watch(self, ticket: Ticket, elapsed: float) -> None:
        """Has the goal follow the robot, and ends a jog that leads links into each other."""
        state, status, press = self._store.state, self._session.status(), self._press
        if status.q_c is not None and (press is not None or status.dq is None or np.abs(status.dq).max() > _STILL):
            self._follow(status.q_c)
        if press is not None and press.is_robot and not press.is_spent and status.q_c is not None:
            self._guard(press, status.q_c, elapsed)
            if status.dq is not None:
                self._tell_limit(press, status.q_c, status.dq)
        if not ticket.done or is_moving(status):
            return
        self._ticket = None
        if press is not None and press.is_robot:
            press.is_spent = True
        if status.q_c is not None and self._followed in (None, self._store.state.goal):
            self._goal.pose(status.q_c)
        self._followed = None
        if ticket.error is not None:
            stopped = status.phase == "idle"
            self._change(said=message("jog.stopped") if stopped else tell_error(ticket.error, status))

    def _follow(self, q: JointVector) -> None:
        if self._followed is None or self._followed is self._store.state.goal:
            self._followed = self._goal.follow(q)

    def _guard(self, press: _Press, q: JointVector, elapsed: float) -> None:
        """Ends a jog before links touch each other or the floor: no controller looks for that."""
        found = self._store.state.model.clearance(q)
        distance, before = float(found.distance), self._distance
        self._distance = distance
        if not is_too_near(distance, before, elapsed):
            return
        press.is_spent = True
        self._let_go()
        first, second = (
            message(f"link.{link_name(int(number)).split()[0]}", number=int(number)) for number in found.links
        )
        self._change(said=message("jog.near", first=first, second=second, mm=f"{1000.0 * distance:.0f}"))

    def _tell_limit(self, press: _Press, q: JointVector, dq: JointVector) -> None:
        """Says which limit a jog has come to, once it stands there."""
        if float(np.abs(dq).max()) < _STILL:
            said = at_limit(self._store.state.model, q, press.axis)
            if said is not None and self._store.state.jog.said is None:
                self._change(said=said)

    def _step_goal(self, axis: Axis) -> None:
        goal = self._store.state.goal
        q = self._stepped(axis, goal.q)
        if q is not None:
            self._store.remember()
            self._goal.pose(q)

    def _step_robot(self, axis: Axis) -> None:
        """Has the robot make one step: a planned motion, judged like any other, collisions too."""
        state, status = self._store.state, self._session.status()
        if self._refuse(no_jog(state, status)) or self._refuse(message("ready.moving") if is_moving(status) else None):
            return
        assert status.q_c is not None
        q = self._stepped(axis, status.q_c)
        if q is None:
            return
        share = state.jog.speed * FASTEST_JOINT / float(state.model.limits.joint.velocity.max())
        # A straight line of the joints: the tool leaves its own by 0.03 mm in a step of 10 mm.
        made = make_plan(state.model, status.q_c, q, share, "jerk_limited")
        if not isinstance(made, Plan):
            self._change(said=made)
            return
        report = made.completed(state.model).report
        if report.certificate is None:
            worst = report.violations[0].condition.id
            self._change(said=message("jog.unsafe", condition=message(f"condition.{worst}")))
            return
        self._store.remember()
        self._ticket = self._session.supervisor().execute(made.motion, report.certificate)
        self._followed = None

    def _stepped(self, axis: Axis, q: JointVector) -> JointVector | None:
        """Returns where a step leads; None where there is no further step, and says why."""
        state, joint = self._store.state, axis.joint
        if joint is not None:
            moved = step_joint(state.model, q, joint, math.radians(axis.sign * state.jog.step))
            if axis.sign * (moved[joint] - q[joint]) <= 1e-9:
                self._change(said=at_limit(state.model, q, axis))
                return None
            self._change(said=at_limit(state.model, moved, axis))
            return moved
        reach = judge_pose(state.model, step_pose(state.model.forward(q), axis, state.jog), q)
        if reach.tone == "bad":
            self._change(said=message("jog.no_way", reason=reach.reason))
            return None
        return reach.q

    def _refuse(self, reason: Message | None) -> bool:
        if reason is not None:
            self._change(said=reason)
        return reason is not None

    def _let_go(self) -> None:
        try:
            self._session.supervisor().release_jog()
        except RcilabError:
            return  # There is none, or none any more: nothing of ours moves.

    def _follow_another(self) -> None:
        """Another arm, destination or person: the buttons pose the goal again until somebody wants otherwise."""
        self.release()
        self._preview = self._ticket = self._followed = None
        self._change(robot=False, asked=False, said=None)

    def _change(self, **changes: object) -> None:
        jog = self._store.state.jog
        changed = replace(jog, **changes)  # type: ignore[arg-type]
        if changed != jog:
            self._store.update(jog=changed)
