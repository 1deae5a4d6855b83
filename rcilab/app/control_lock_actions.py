"""Pages that open, close, fall silent and ask for the controls. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rcilab.app.connection import PageConnection
from rcilab.app.control_lock import ClientHeartbeat
from rcilab.app.request import Handlers, Request
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.store import Store
from rcilab.control_process.layout import OPERATOR_TIMEOUT
from rcilab.i18n.translator import message


@dataclass(frozen=True, slots=True, kw_only=True)
class TakeControls(Request):
    """A page asks for the controls."""

    needs_control: ClassVar[bool] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Refuse(Request):
    """A page without the controls has used a control."""

    needs_control: ClassVar[bool] = False

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"refuse.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerControls(Request):
    """The answer of the holder to a page that asked for the controls."""

    needs_control: ClassVar[bool] = False

    yes: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PageOpened(Request):
    """A page has opened."""

    needs_control: ClassVar[bool] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PageClosed(Request):
    """A page has closed."""

    needs_control: ClassVar[bool] = False


class ControlLockActions:
    """Passes the controls from page to page.

    Args:
        store: Has the lock.
        connection: The robot; it reports whether the arm moves.
        presence: When each page last sent a heartbeat.
    """

    def __init__(self, store: Store, connection: PageConnection, presence: ClientHeartbeat) -> None:
        self._store, self._connection, self._presence = store, connection, presence

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            TakeControls: self.take_controls,
            AnswerControls: self.answer,
            PageOpened: self.page_came,
            PageClosed: self.page_went,
        }

    def page_came(self, request: PageOpened) -> None:
        """Registers a page; it gets the controls if no page has them."""
        if request.page is not None:
            self._presence.came(request.page)
            self._store.update(control_lock=self._store.state.control_lock.arrive(request.page))

    def page_went(self, request: PageClosed) -> None:
        """Removes a page. Without a holder no heartbeat reaches the robot: a motion ends after 2 s."""
        if request.page is not None:
            self._presence.went(request.page)
            self._store.update(control_lock=self._store.state.control_lock.leave(request.page, self._presence.now()))
            self._store.forget_page(request.page)

    def take_controls(self, request: TakeControls) -> None:
        """Gives a page free controls, or asks their holder."""
        page, lock = request.page, self._store.state.control_lock
        if page is None or lock.allows(page) or lock.asking == page:
            return
        after = lock.ask(page, self._presence.now())
        self._store.update(control_lock=after)
        if after.holder == page:
            self._announce(page)
        elif after.asking == page:
            self._store.notify("good", message("control_lock.asked", holder=lock.number(lock.holder)), page=page)
        else:
            self._store.notify("warn", message("control_lock.busy", page=lock.number(lock.asking)), page=page)

    def answer(self, request: AnswerControls) -> None:
        """Takes the answer of the holder."""
        lock = self._store.state.control_lock
        if request.page is None or request.page != lock.holder or lock.asking is None:
            return
        self._store.update(control_lock=lock.answer(request.page, request.yes))
        if request.yes:
            self._announce(lock.asking)
        else:
            self._store.notify("warn", message("control_lock.kept", page=lock.number(lock.asking)))

    def tick(self) -> None:
        """Handles timeouts: a silent holder loses the controls, a request without an answer is granted."""
        lock, now = self._store.state.control_lock, self._presence.now()
        if lock.holder is not None and self._presence.is_silent(lock.holder):
            silent = lock.number(lock.holder)
            lock = self._store.update(control_lock=lock.fall_silent(now)).control_lock
            if len(lock.pages) > 1:
                self._store.notify("warn", message("control_lock.silent", page=silent))
        if lock.holder is not None and lock.is_overdue(now) and not is_moving(self._connection.status()):
            taken = lock.number(lock.asking)
            lock = self._store.update(control_lock=lock.answer(lock.holder, yes=True)).control_lock
            self._store.notify("warn", message("control_lock.unanswered", page=taken))
        if lock.holder is None and lock.pages:
            self._find_holder(now)

    def _announce(self, holder: int) -> None:
        """Notifies every page which page has the controls."""
        lock = self._store.state.control_lock
        for page in lock.pages:
            sentence = message("notice.yours") if page == holder else message("notice.taken", page=lock.number(holder))
            self._store.notify("good", sentence, page=page)

    def _find_holder(self, now: float) -> None:
        """Returns free controls to their former holder, or to the only page once the arm stands still."""
        lock = self._store.state.control_lock
        if lock.former is not None and not self._presence.is_silent(lock.former):
            self._store.update(control_lock=lock.take(lock.former))
        elif len(lock.pages) == 1 and now - lock.since > OPERATOR_TIMEOUT and not is_moving(self._connection.status()):
            only = lock.pages[0]
            if not self._presence.is_silent(only):
                self._store.update(control_lock=lock.take(only))
