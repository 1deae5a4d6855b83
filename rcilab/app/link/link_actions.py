"""Requests that open a link to a view. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.app.cell.cell_actions import CellActions
from rcilab.app.connection import PageConnection
from rcilab.app.link.page_link import LinkQuestion, PageLink, decode_link
from rcilab.app.program.program_actions import ProgramActions
from rcilab.app.request import Handlers, Request
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.run_actions import RunActions
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import message


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenLink(Request):
    """A page was opened with a link, or a page that is open got one."""

    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerLink(Request):
    """Whether a link that replaces something is opened."""

    yes: bool


class LinkActions:
    """Opens links: arm, cell and program of the page. None moves a robot, or sends anything to one at an address.

    Args:
        store: The state.
        connection: The robot; it reports whether the arm moves.
        run: Chooses another arm of the virtual controller.
        program: Takes the program.
        cell: Takes the cell.
    """

    def __init__(
        self, store: Store, connection: PageConnection, run: RunActions, program: ProgramActions, cell: CellActions
    ) -> None:
        self._store, self._connection, self._run, self._program, self._cell = store, connection, run, program, cell

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {OpenLink: self.open, AnswerLink: self.answer}

    def open(self, request: OpenLink) -> None:
        """Opens a link, or asks first if that replaces a program, a cell or the arm."""
        state = self._store.state
        try:
            link = decode_link(request.text)
        except RcilabError as error:
            self._store.notify("bad", explain_error(error), page=request.page)
            return
        is_other = link.model != state.model.name
        if state.watched or (is_other and state.target != "virtual"):
            sentence = message("link.other_arm", theirs=link.model, ours=state.model.name)
            self._store.notify("warn", sentence, page=request.page)
            return
        if is_other or state.program.draft.steps or state.cell.cell is not None:
            self._store.update(link=LinkQuestion(request.page, link))
        else:
            self._take(link)

    def answer(self, request: AnswerLink) -> None:
        """Takes the answer of the page that opened the link."""
        question = self._store.state.link
        if question is None or request.page != question.page:
            return
        self._store.update(link=None)
        if request.yes:
            self._take(question.link)

    def _take(self, link: PageLink) -> None:
        state = self._store.state
        if is_moving(self._connection.status()):
            self._store.notify("warn", message("notice.moving"))
            return
        if link.model != state.model.name:
            if state.watched or state.target != "virtual":  # It was connected after the question.
                sentence = message("link.other_arm", theirs=link.model, ours=state.model.name)
                self._store.notify("warn", sentence)
                return
            self._run.open(link.model, "virtual")
            self._cell.tick()
        if link.cell is not None:
            self._cell.take(link.cell, message("cell.loaded", name=link.cell.name, count=len(link.cell.obstacles)))
        if link.program is not None:
            self._program.restore(link.program)
        count = 0 if link.program is None else len(link.program.waypoints)
        self._store.notify("good", message("link.opened", model=link.model, count=count))
