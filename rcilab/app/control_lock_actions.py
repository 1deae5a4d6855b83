"""Pages that come, go, fall silent and ask for the controls. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rcilab.app.control_lock import ClientHeartbeat
from rcilab.app.request import Handlers, Request
from rcilab.app.robot_connection import RobotConnection
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.store import Store
from rcilab.control_process.layout import OPERATOR_TIMEOUT
from rcilab.i18n.translator import message


@dataclass(frozen=True, slots=True, kw_only=True)
class TakeControls(Request):
    """This page wants the controls."""

    needs_control: ClassVar[bool] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Refuse(Request):
    """A page without the controls has tried to use one."""

    needs_control: ClassVar[bool] = False

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"refuse.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerControls(Request):
    """The page that holds the controls was asked for them."""

    needs_control: ClassVar[bool] = False

    yes: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PageOpened(Request):
    """A page has opened."""

    needs_control: ClassVar[bool] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PageClosed(Request):
    """A page has gone."""

    needs_control: ClassVar[bool] = False


class ControlLockActions:
    """Hands the controls from page to page.

    Args:
        store: Where the lease is.
        session: Whether the arm moves.
        presence: When pages were last heard of.
    """

    def __init__(self, store: Store, session: RobotConnection, presence: ClientHeartbeat) -> None:
        self._store, self._session, self._presence = store, session, presence

    @property
    def handlers(self) -> Handlers:
        """What it does for each of its requests."""
        return {
            TakeControls: self.take_controls,
            AnswerControls: self.answer,
            PageOpened: self.page_came,
            PageClosed: self.page_went,
        }

    def page_came(self, request: PageOpened) -> None:
        """Notes a page; it gets the controls when no page has them."""
        if request.page is not None:
            self._presence.came(request.page)
            self._store.update(lease=self._store.state.lease.arrive(request.page))

    def page_went(self, request: PageClosed) -> None:
        """Notes that a page has gone. Without a holder no sign of life reaches the robot: a motion ends after 2 s."""
        if request.page is not None:
            self._presence.went(request.page)
            self._store.update(lease=self._store.state.lease.leave(request.page, self._presence.now()))
            self._store.forget_page(request.page)

    def take_controls(self, request: TakeControls) -> None:
        """Gives a page free controls, or asks their holder."""
        page, lease = request.page, self._store.state.lease
        if page is None or lease.allows(page) or lease.asking == page:
            return
        after = lease.ask(page, self._presence.now())
        self._store.update(lease=after)
        if after.holder == page:
            self._store.say("good", message("notice.taken", page=after.number(page)))
        elif after.asking == page:
            self._store.say("good", message("lease.asked", page=lease.number(page), holder=lease.number(lease.holder)))
        else:
            self._store.say("warn", message("lease.busy", page=lease.number(lease.asking)), page=page)

    def answer(self, request: AnswerControls) -> None:
        """Hears whether the holder hands over."""
        lease = self._store.state.lease
        if request.page is None or request.page != lease.holder or lease.asking is None:
            return
        asking = lease.number(lease.asking)
        self._store.update(lease=lease.answer(request.page, request.yes))
        said = message("notice.taken", page=asking) if request.yes else message("lease.kept", page=asking)
        self._store.say("good" if request.yes else "warn", said)

    def tick(self) -> None:
        """Does what time asks for: a silent holder loses the controls, an unanswered question counts as yes."""
        lease, now = self._store.state.lease, self._presence.now()
        if lease.holder is not None and self._presence.is_silent(lease.holder):
            silent = lease.number(lease.holder)
            lease = self._store.update(lease=lease.fall_silent(now)).lease
            if len(lease.pages) > 1:
                self._store.say("warn", message("lease.silent", page=silent))
        if lease.holder is not None and lease.is_overdue(now) and not is_moving(self._session.status()):
            taken = lease.number(lease.asking)
            lease = self._store.update(lease=lease.answer(lease.holder, yes=True)).lease
            self._store.say("warn", message("lease.unanswered", page=taken))
        if lease.holder is None and lease.pages:
            self._find_holder(now)

    def _find_holder(self, now: float) -> None:
        """Gives free controls back to the page that had them, or to the only one once the arm stands."""
        lease = self._store.state.lease
        if lease.former is not None and not self._presence.is_silent(lease.former):
            self._store.update(lease=lease.take(lease.former))
        elif len(lease.pages) == 1 and now - lease.since > OPERATOR_TIMEOUT and not is_moving(self._session.status()):
            only = lease.pages[0]
            if not self._presence.is_silent(only):
                self._store.update(lease=lease.take(only))
