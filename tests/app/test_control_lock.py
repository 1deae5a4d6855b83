"""One page holds the controls, the others watch and may ask; whoever no longer answers holds nothing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.app.control_lock import PATIENCE, ClientHeartbeat, ControlLock
from rcilab.app.control_lock_actions import AnswerControls, ControlLockActions, PageClosed, PageOpened, TakeControls
from rcilab.app.dispatcher import Dispatcher
from rcilab.app.goal.goal import goal_at
from rcilab.app.store import Store, UiState
from rcilab.app.view_actions import Seek
from rcilab.control_process import SupervisorStatus
from rcilab.control_process.layout import OPERATOR_TIMEOUT
from rcilab.i18n.translator import message
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")


def test_the_first_page_gets_the_controls_and_they_are_free_when_it_goes():
    lock = ControlLock().arrive(7).arrive(9)
    assert lock.holder == 7
    assert lock.allows(7)
    assert not lock.allows(9)
    assert lock.leave(7).holder is None
    assert lock.leave(7).arrive(11).holder == 11  # Such as the same page, loaded anew.
    assert lock.leave(7).leave(9).pages == ()


def test_the_holder_decides_and_free_controls_are_taken_at_once():
    asked = ControlLock().arrive(1).arrive(2).arrive(3).ask(2, 0.0)
    assert (asked.holder, asked.asking) == (1, 2)
    assert asked.ask(3, 1.0) == asked
    assert asked.answer(2, yes=True) == asked
    assert asked.answer(1, yes=False).asking is None
    assert asked.answer(1, yes=True).holder == 2
    assert asked.leave(1).holder == 2
    assert ControlLock((1, 2), None).ask(2, 0.0).holder == 2
    assert asked.ask(5, 0.0) == asked


def test_our_own_doing_is_always_allowed():
    assert ControlLock().allows(None)


@given(st.lists(st.tuples(st.sampled_from(["arrive", "leave", "take", "ask", "yes", "silent"]), st.integers(0, 4))))
def test_holder_and_asker_are_open_pages_and_never_the_same(events):
    lock = ControlLock()
    for name, page in events:
        act = {
            "ask": lambda lock, page: lock.ask(page, 0.0),
            "yes": lambda lock, page: lock.answer(page, yes=True),
            "silent": lambda lock, page: lock.fall_silent(0.0),
        }.get(name, lambda lock, page, name=name: getattr(lock, name)(page))
        lock = act(lock, page)
        assert len(set(lock.pages)) == len(lock.pages)
        assert lock.holder is None or lock.holder in lock.pages
        assert lock.asking is None or (lock.asking in lock.pages and lock.holder not in (None, lock.asking))
        assert lock.number(lock.holder) == (lock.pages.index(lock.holder) + 1 if lock.holder is not None else 0)


class Robot:
    """A session of which only the phase matters."""

    phase = "idle"

    def status(self) -> SupervisorStatus:
        return SupervisorStatus(phase=self.phase, code=self.phase)


class Desk:
    """The actions with a clock that a test moves, and two pages that answer."""

    def __init__(self) -> None:
        self.time = 100.0
        self.robot = Robot()
        self.store = Store(UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home)))
        self.presence = ClientHeartbeat(lambda: self.time)
        self.actions = ControlLockActions(self.store, self.robot, self.presence)
        for page in (1, 2):
            self.actions.page_came(PageOpened(page=page))
        self.wait(0.1, 1, 2)

    @property
    def lock(self) -> ControlLock:
        return self.store.state.control_lock

    def wait(self, seconds: float, *answering: int) -> None:
        """Lets time pass in which only these pages answer."""
        end = self.time + seconds
        while self.time < end:
            self.time += 0.1
            for page in answering:
                self.presence.mark_seen(page)
            self.actions.tick()

    @property
    def told(self) -> str:
        return self.store.state.notice.text.code


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_a_frozen_tab_loses_the_controls_and_gets_them_back_unless_somebody_took_them(desk):
    desk.wait(OPERATOR_TIMEOUT + 0.2, 2)
    assert desk.lock.holder is None
    assert desk.told == "control_lock.silent"
    desk.wait(0.3, 1, 2)
    assert desk.lock.holder == 1
    desk.wait(OPERATOR_TIMEOUT + 0.2, 2)
    desk.actions.take_controls(TakeControls(page=2))
    desk.wait(0.3, 1, 2)
    assert desk.lock.holder == 2


def test_a_question_without_an_answer_is_a_yes_but_not_while_the_arm_moves(desk):
    desk.robot.phase = "moving"
    desk.actions.take_controls(TakeControls(page=2))
    assert desk.told == "control_lock.asked"
    desk.wait(PATIENCE + 1.0, 1, 2)
    assert desk.lock.holder == 1
    desk.robot.phase = "idle"
    desk.wait(0.2, 1, 2)
    assert desk.lock.holder == 2
    assert desk.told == "control_lock.unanswered"


def test_who_is_told_no_may_ask_again(desk):
    desk.actions.take_controls(TakeControls(page=2))
    desk.actions.answer(AnswerControls(page=2, yes=True))
    assert desk.lock.holder == 1
    desk.actions.answer(AnswerControls(page=1, yes=False))
    assert desk.told == "control_lock.kept"
    assert desk.lock.asking is None
    desk.actions.take_controls(TakeControls(page=2))
    desk.actions.answer(AnswerControls(page=1, yes=True))
    assert desk.lock.holder == 2


def test_the_only_page_left_gets_the_controls_once_the_arm_stands(desk):
    desk.robot.phase = "moving"
    desk.actions.page_went(PageClosed(page=1))
    desk.wait(OPERATOR_TIMEOUT + 1.0, 2)
    assert desk.lock.holder is None
    desk.robot.phase = "idle"
    desk.wait(0.2, 2)
    assert desk.lock.holder == 2


def test_a_page_that_still_loads_is_waited_for(desk):
    desk.actions.page_went(PageClosed(page=1))
    desk.actions.page_went(PageClosed(page=2))
    desk.actions.page_came(PageOpened(page=3))
    desk.wait(10.0)
    assert desk.lock.holder == 3


def test_what_one_page_is_told_takes_no_place_of_what_another_is_told(desk):
    """However fast a page without the controls presses."""
    dispatcher = Dispatcher(desk.store, desk.robot)
    for page in (1, 2):
        dispatcher.act(PageOpened(page=page))
    for number in range(3):
        desk.store.notify("bad", message("notice.taken", page=number), page=1)
        for _ in range(100):
            dispatcher.act(Seek(page=2, playhead=0.5))
            dispatcher.act(TakeControls(page=2))
    notices = desk.store.state.notices
    assert [notice.text.values["page"] for notice in notices if notice.page == 1] == [0, 1, 2]
    assert sum(notice.page == 2 for notice in notices) <= 4
    assert sum(notice.page is None for notice in notices) <= 4
    desk.actions.page_went(PageClosed(page=1))
    assert all(notice.page != 1 for notice in desk.store.state.notices)
