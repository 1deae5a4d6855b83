"""A control that is given the value it has sends nothing; every other value takes the way through viser."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from rcilab.views import same_value
from rcilab.views.gate import Gate
from rcilab.views.guarded_server import GuardedServer, listen


@pytest.fixture
def gui() -> Iterator[Any]:
    bound = listen("127.0.0.1", 0)
    with GuardedServer(bound, Gate(host="127.0.0.1", port=bound.getsockname()[1], token=None, title="test")) as server:
        yield server.viser.gui


def _sent(handle: Any, **values: object) -> list[tuple[str, object]]:
    """Returns what giving a control these values queues for the pages."""
    sent: list[tuple[str, object]] = []
    object.__setattr__(handle, "_queue_update", lambda name, value: sent.append((name, value)))
    for name, value in values.items():
        setattr(handle, name, value)
    return sent


def test_a_value_that_stands_already_is_not_sent(gui: Any):
    button = gui.add_button("go", color="red")
    assert _sent(button, visible=True, disabled=False, label="go", color="red") == []


def test_another_value_is_set_and_sent(gui: Any):
    button = gui.add_button("go", color="red")
    assert _sent(button, visible=False, label="stop", color=None) == [
        ("visible", False),
        ("label", "stop"),
        ("color", None),
    ]
    assert (button.visible, button.label, button.color) == (False, "stop", None)
    assert _sent(button, visible=False, label="stop", color=None) == []


def test_a_value_of_another_type_goes_through_viser(gui: Any):
    button = gui.add_button("go")
    assert _sent(button, disabled=0) == []  # viser finds 0 equal to False.
    assert button.disabled is False


def test_the_number_of_a_control_goes_through_its_own_setter(gui: Any):
    box = gui.add_text("name", "a")
    heard: list[str] = []
    box.on_update(lambda event: heard.append(event.target.value))
    box.value = "b"
    box.value = "b"
    assert heard == ["b"]


def test_a_control_that_was_removed_says_so(gui: Any):
    button = gui.add_button("go")
    button.remove()
    with pytest.raises(RuntimeError, match="removed"):
        button.visible = True


def test_viser_is_changed_once():
    from viser._assignable_props_api import AssignablePropsBase

    same_value.install()
    before = AssignablePropsBase.__setattr__
    same_value.install()
    assert AssignablePropsBase.__setattr__ is before
