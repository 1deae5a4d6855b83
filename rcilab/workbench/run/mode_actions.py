"""What happens when somebody chooses a mode, its parameters or a pace. Owned by the conductor's thread."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from rcilab.client.control_settings import control_ranges, standard_control
from rcilab.client.setup import RobotSetup
from rcilab.errors import PlanningError, RcilabError
from rcilab.motion.pacing import SLOWEST_PACE
from rcilab.posing.driving import SECOND_THOUGHT, ask_to_send
from rcilab.state import MODES, Mode
from rcilab.words.number import parse_number
from rcilab.workbench import requests
from rcilab.workbench.run.driving import control_field, is_pending
from rcilab.workbench.run.readiness import is_moving
from rcilab.workbench.session import Session
from rcilab.workbench.setup.post import SetupPost
from rcilab.workbench.store import Store
from rcilab.workbench.text import Message, message

if TYPE_CHECKING:
    from rcilab.supervisor import Ticket

_SAME_PACE = 1e-3


class ModeActions:
    """Mode, parameters, pause, pace. Our own controller is told at once, a foreign one when asked for twice."""

    def __init__(self, store: Store, session: Session) -> None:
        self._store, self._session = store, session
        self._post = SetupPost(session, self._refuse)
        self._changing: Ticket | None = None
        self._wish: float | None = None  # A pace that waits until the last change was taken.
        self._asked_to_send = -math.inf
        self._code = ""
        self._arm = store.state.model.name

    def set_drive(self, request: requests.SetDrive) -> None:
        """Chooses a mode, whose conditions then judge the plan, or a pace; what does not exist is ignored."""
        state, status = self._store.state, self._session.status()
        if request.mode in MODES and request.mode != state.drive.mode:
            if is_moving(status):
                self._store.say("warn", message("notice.moving"))
                return
            mode = cast("Mode", request.mode)
            plan = None if state.plan is None else state.plan.completed(mode)
            self._store.update(drive=replace(state.drive, mode=mode), plan=plan, asked=None)
        if request.pace is not None and math.isfinite(request.pace):
            pace = min(max(request.pace, SLOWEST_PACE), 1.0)
            self._store.update(drive=replace(self._store.state.drive, pace=pace))
            if status.code == "moving" and status.motion_place is not None:
                self._wish = pace

    def pause(self) -> None:
        """Holds the motion under way."""
        if self._require_motion():
            self._wish = 0.0

    def resume(self) -> None:
        """Goes on with a motion that is held."""
        if self._require_motion():
            self._wish = self._store.state.drive.pace

    def type_field(self, request: requests.TypeField) -> None:
        """Takes a typed parameter, or says beside the field what is wrong with it."""
        state = self._store.state
        found = control_field(state.model, request.field)
        if found is None:
            return
        part, place = found
        bounds = control_ranges(state.model.limits)[part][place]
        parsed = parse_number(request.text, bounds.low, bounds.high, bounds.unit)
        if parsed.value is None:
            assert parsed.problem is not None
            self._store.complain(request.field, parsed.problem)
            return
        drive = state.drive.with_number(state.model, part, place, parsed.value)
        self._store.clear_problems(request.field)
        self._store.update(drive=drive, typed=state.typed + 1)

    def press(self, request: requests.PressControl) -> None:
        """Sends the parameters, or takes those that a controller wakes up with."""
        state, now = self._store.state, time.monotonic()
        if request.what == "reset":
            control = standard_control(state.model.limits)
            drive = replace(state.drive, control=control, refusal=None)
            self._store.clear_problems("control.")
            self._store.update(drive=drive, typed=state.typed + 1)
            return
        if state.target != "virtual" and now - self._asked_to_send > SECOND_THOUGHT:
            self._asked_to_send = now
            self._store.say("warn", ask_to_send(state.target))
            return
        self._asked_to_send = -math.inf
        self._store.update(drive=replace(state.drive, refusal=None))
        self._send()

    def tick(self) -> None:
        """Looks what became of what was sent, tells our own controller what is new, changes the pace."""
        state, status = self._store.state, self._session.status()
        if state.model.name != self._arm:
            self._arm, self._wish = state.model.name, None
            self._post.forget()
        self._post.collect()
        state = self._store.state
        if state.target == "virtual" and state.drive.refusal is None and status.phase == "idle":
            self._send()
        is_new = status.code == "moving" and self._code not in ("moving", "moving.held")
        self._code = status.code
        if is_new and state.drive.pace < 1.0:
            self._wish = state.drive.pace
        self._change_pace(status.code, status.pace)

    def _send(self) -> None:
        state = self._store.state
        if not self._post.is_underway and is_pending(state, self._session.status()):
            self._post.send(RobotSetup(control=state.drive.control))

    def _refuse(self, why: Message) -> None:
        self._store.update(drive=replace(self._store.state.drive, refusal=why))

    def _require_motion(self) -> bool:
        if self._session.status().code in ("moving", "moving.held"):
            return True
        self._store.say("warn", message("pace.nothing"))
        return False

    def _change_pace(self, code: str, pace: float) -> None:
        """Hands the wish of now over once the last change was taken; of a slider's many only the newest counts."""
        changing, self._changing = self._changing, None
        if changing is not None and not changing.done:
            self._changing = changing
            return
        if changing is not None and changing.error is not None and code in ("moving", "moving.held"):
            self._store.say("warn", message("pace.late"))
        wish, self._wish = self._wish, None
        if wish is None or code not in ("moving", "moving.held") or abs(wish - pace) < _SAME_PACE:
            return
        supervisor = self._session.supervisor()
        try:
            self._changing = supervisor.pause() if wish == 0.0 else supervisor.set_pace(wish)
        except PlanningError:
            self._store.say("warn", message("pace.no_pause" if wish == 0.0 else "pace.no_change"))
        except RcilabError:
            if self._session.status().code in ("moving", "moving.held"):
                self._store.say("warn", message("pace.late"))
