"""A typed number: taken after a pause, and not written over under the hand that typed it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from rcilab.app.request import Request, TypeField
from rcilab.app.view_actions import DropProblem
from rcilab.i18n.translator import message
from rcilab.workbench import widgets
from rcilab.workbench.widgets import BoundControl, NumberField


class Box:
    """A text box as viser has it: tells of every key, and keeps what was written into it."""

    def __init__(self) -> None:
        self.value = ""
        self._hear: Callable[[Any], Any] | None = None

    def on_update(self, hear: Callable[[Any], Any]) -> Callable[[Any], Any]:
        self._hear = hear
        return hear

    def type(self, text: str) -> None:
        self.value = text
        assert self._hear is not None
        asyncio.run(self._hear(SimpleNamespace(client_id=1, target=self)))


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    clock = SimpleNamespace(time=100.0)
    monkeypatch.setattr(widgets, "time", SimpleNamespace(monotonic=lambda: clock.time))
    return clock


def make() -> tuple[Box, NumberField, list[Request]]:
    box, asked = Box(), []
    return box, NumberField(box, asked.append, "joint.1"), asked


def test_a_number_counts_once_the_typing_has_paused_and_stands_as_it_was_typed(now: SimpleNamespace) -> None:
    box, field, asked = make()
    field.show("30.00", None)
    assert box.value == "30.00"
    for text in ("1", "10"):
        box.type(text)
        now.time += 0.5
        field.show("30.00", None)
    assert asked == []
    now.time += 0.3
    field.show("30.00", None)
    assert asked == [TypeField(page=1, field="joint.1", text="10")]
    now.time += 0.1
    field.show("30.00", None)
    assert box.value == "10", "the answer may still be on its way"
    for _ in range(20):
        now.time += 0.12
        field.show("10.00", None)
        assert box.value == "10", "somebody may be about to type on"
    now.time += 1.0
    field.show("10.00", None)
    assert box.value == "10.00"
    assert len(asked) == 1


def test_a_number_that_is_entered_counts_at_once_and_is_soon_restated(now: SimpleNamespace) -> None:
    box, field, asked = make()
    box.type("10")
    now.time += 0.1
    field.show("30.00", None, {1: 100.0 - 0.1, 2: now.time})
    assert asked == [], "another page's, and one of before"
    field.show("30.00", None, {1: now.time})
    assert asked == [TypeField(page=1, field="joint.1", text="10")]
    for _ in range(6):
        now.time += 0.1
        field.show("10.00", None, {1: 100.1})
    assert box.value == "10.00"
    box.type("12")
    field.show("10.00", None, {1: 100.1})
    assert len(asked) == 1, "what is typed after that is a new number"


def test_what_becomes_another_number_meanwhile_is_shown_at_once(now: SimpleNamespace) -> None:
    box, field, _ = make()
    box.type("10")
    for seconds, number in ((0.8, "30.00"), (0.3, "10.00")):
        now.time += seconds
        field.show(number, None)
    assert box.value == "10"
    field.show("12.50", None)  # A drag, an undo.
    assert box.value == "12.50"


def test_what_is_wrong_is_left_as_it_is(now: SimpleNamespace) -> None:
    box, field, _ = make()
    box.type("abc")
    for _ in range(60):
        now.time += 0.1
        field.show("30.00", message("number.not_a_number", typed="abc"))
    assert box.value == "abc"


WRONG = message("number.not_a_number", typed="abc")


def refused(now: SimpleNamespace) -> tuple[Box, NumberField, list[Request]]:
    box, field, asked = make()
    box.type("")
    for seconds, problem in ((0.8, None), (0.3, WRONG), (5.0, WRONG)):
        now.time += seconds
        field.show("30.00", problem)
    assert box.value == ""
    asked.clear()
    return box, field, asked


def test_what_is_wrong_goes_when_the_number_changes_from_elsewhere(now: SimpleNamespace) -> None:
    box, field, asked = refused(now)
    field.show("31.00", WRONG)  # A jog.
    assert box.value == "31.00"
    assert asked == [DropProblem(field="joint.1")]


def test_what_is_wrong_stands_while_it_has_not_changed_and_a_second_mistake_too(now: SimpleNamespace) -> None:
    box, field, asked = refused(now)
    box.type("x")
    now.time += 0.8
    field.show("30.00", WRONG)
    for _ in range(20):
        now.time += 0.5
        field.show("30.00", message("number.not_a_number", typed="x"))
    assert box.value == "x"
    assert [type(request) for request in asked] == [TypeField]


def test_a_field_built_anew_beside_a_problem_shows_the_number(now: SimpleNamespace) -> None:
    box, field, asked = make()
    field.show("30.00", WRONG)  # The page in another language.
    assert box.value == "30.00"
    assert asked == [DropProblem(field="joint.1")]


def test_what_is_wrong_with_a_number_that_was_not_typed_stands_too(now: SimpleNamespace) -> None:
    box, field, asked = make()
    field.show("30.00", None)
    for _ in range(3):
        field.show("31.00", WRONG)  # What was typed in another field does not go with it.
    assert box.value == "31.00"
    assert asked == []


def test_a_field_that_was_exchanged_meanwhile_shows_the_number(now: SimpleNamespace) -> None:
    box, field, asked = refused(now)
    field.field = "joint.2"
    field.show("55.00", None)
    field.field = "joint.1"
    field.show("30.00", WRONG)
    assert box.value == "30.00"
    assert asked == [DropProblem(field="joint.1")]


def test_a_field_that_becomes_another_ones_shows_that_one_at_once(now: SimpleNamespace) -> None:
    box, field, asked = make()
    box.type("10")
    field.field = "joint.2"
    field.show("55.00", None)
    assert asked == [TypeField(page=1, field="joint.1", text="10")]
    field.show("55.00", None)
    assert box.value == "55.00"


def test_a_control_that_a_hand_has_just_moved_is_not_written_over_before_its_word_has_come(
    now: SimpleNamespace,
) -> None:
    box = Box()
    box.value = "off"
    linked = BoundControl(box, lambda _: None, lambda value, page: None)
    linked.show("off")
    box.value = "on"  # viser keeps the value, then calls us.
    linked.show("off")
    assert box.value == "on"
    box.type("on")
    now.time += 1.0
    linked.show("on")
    linked.show("off")
    assert box.value == "off", "nobody touches it any more"
