from __future__ import annotations

from dataclasses import replace

import pytest

from rcilab.app.run.requested_speed import RequestedSpeed, describe_override_refusal
from rcilab.control_process import SupervisorStatus
from rcilab.core.errors import ConnectionLostError, PlanningError

IDLE = SupervisorStatus(phase="idle", code="idle")
MOVING = SupervisorStatus(phase="moving", code="moving", motion_duration=3.0, speed_override=1.0)
HELD = replace(MOVING, code="moving.held", speed_override=0.0)


def due(wish: RequestedSpeed, status: SupervisorStatus, *, is_pending: bool = False) -> float | None:
    return wish.due(status, is_pending=is_pending)


def test_of_many_wishes_only_the_newest_is_handed_over_and_only_once() -> None:
    wish = RequestedSpeed()
    for speed_override in (0.9, 0.5, 0.3):
        wish.choose(speed_override, MOVING)
    assert due(wish, MOVING, is_pending=True) is None
    assert due(wish, MOVING) == 0.3
    assert due(wish, MOVING) is None


def test_what_is_chosen_while_nothing_moves_is_no_wish_of_the_next_motion() -> None:
    wish = RequestedSpeed()
    wish.choose(0.4, IDLE)
    assert due(wish, IDLE) is None
    assert due(wish, MOVING) is None, "it begins at the pace it is executed with"
    wish.choose(0.4, MOVING)
    assert due(wish, replace(MOVING, speed_override=0.4)) is None


def test_a_held_motion_keeps_waiting_while_the_pace_is_chosen() -> None:
    wish = RequestedSpeed()
    wish.hold()
    assert due(wish, MOVING) == 0.0
    wish.choose(0.5, HELD)
    assert due(wish, HELD) is None
    wish.go_on(0.5)
    assert due(wish, HELD) == 0.5


@pytest.mark.parametrize("status", [IDLE, replace(MOVING, motion_duration=None)])
def test_nothing_is_asked_of_an_arm_that_no_motion_moves(status: SupervisorStatus) -> None:
    wish = RequestedSpeed()
    wish.hold()
    assert due(wish, status) is None
    assert due(wish, MOVING) is None, "what was wanted before is forgotten"


def test_a_refusal_says_what_cannot_be_and_nothing_once_the_motion_is_over() -> None:
    def code(error: PlanningError | ConnectionLostError, speed_override: float, status: SupervisorStatus) -> str | None:
        told = describe_override_refusal(error, speed_override, status)
        return None if told is None else told.code

    assert code(PlanningError("no"), 0.0, MOVING) == "speed_override.no_pause"
    assert code(PlanningError("no"), 0.5, MOVING) == "speed_override.no_change"
    assert code(ConnectionLostError("late"), 0.5, HELD) == "speed_override.late"
    assert code(ConnectionLostError("late"), 0.5, IDLE) is None
