"""The queue keeps the order, and drops only what a newer value of the same drag replaces."""

from __future__ import annotations

import threading

from rcilab.app.dispatcher import CoalescingQueue


def drained(box: CoalescingQueue) -> list:
    taken = []
    while (item := box.take(0.0)) is not None:
        taken.append(item)
    return taken


def test_a_newer_drag_replaces_the_waiting_one():
    box: CoalescingQueue[str] = CoalescingQueue()
    for item in ("a1", "a2", "a3"):
        box.put(item, "drag")
    assert drained(box) == ["a3"]


def test_nothing_is_replaced_across_another_request():
    box: CoalescingQueue[str] = CoalescingQueue()
    box.put("a1", "drag")
    box.put("press")
    box.put("a2", "drag")
    box.put("b1", "other")
    assert drained(box) == ["a1", "press", "a2", "b1"]


def test_take_wakes_up_for_a_request_from_another_thread():
    box: CoalescingQueue[str] = CoalescingQueue()
    threading.Timer(0.05, lambda: box.put("late")).start()
    assert box.take(10.0) == "late"


def test_take_gives_up_when_nothing_comes():
    assert CoalescingQueue().take(0.01) is None
