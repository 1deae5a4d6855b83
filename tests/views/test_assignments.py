"""viser's handles take and tell the same values, and look at their types once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from rcilab.views.viser_ext import assignments


@pytest.fixture
def server() -> Iterator[Any]:
    import viser

    assignments.install()
    assignments.install()
    found = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield found
    found.stop()


def test_plain_values_are_taken_and_told_once(server: Any) -> None:
    button = server.gui.add_button("one")
    told: list[tuple[str, object]] = []
    queue = type(button)._queue_update
    object.__setattr__(
        button, "_queue_update", lambda name, value: told.append((name, value)) or queue(button, name, value)
    )
    for label in ("one", "two", "two"):
        button.label = label
    button.color = (1, 2, 3)
    assert button.label == "two"
    assert button.color == (1, 2, 3)
    assert told == [("label", "two"), ("color", (1, 2, 3))]


def test_arrays_are_converted_as_viser_does_it(server: Any) -> None:
    cloud = server.scene.add_point_cloud("/cloud", np.zeros((2, 3)), np.zeros((2, 3), dtype=np.uint8))
    cloud.points = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    cloud.colors = np.array([[0.0, 0.5, 1.0], [1.0, 1.0, 1.0]])
    lines = server.scene.add_line_segments("/lines", np.zeros((1, 2, 3)), np.zeros((1, 2, 3), dtype=np.uint8))
    lines.points = [[[1, 2, 3], [4, 5, 6]]]
    assert (lines.points.dtype, lines.points.tolist()) == (np.float32, [[[1, 2, 3], [4, 5, 6]]])
    assert cloud.points.dtype in (np.float16, np.float32)
    assert cloud.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert cloud.colors.dtype == np.uint8
    assert cloud.colors.tolist() == [[0, 127, 255], [255, 255, 255]]


def test_every_type_that_viser_looks_at_is_left_to_viser() -> None:
    """What the replacement leaves out is what viser gives back untouched, for every property of every handle."""
    import viser._messages as messages
    from viser._assignable_props_api import AssignablePropsBase

    original = AssignablePropsBase._cast_value_recursive
    if (inner := original.__closure__) is not None:
        original = next(cell.cell_contents for cell in inner if callable(cell.cell_contents))
    asker: Any = object.__new__(AssignablePropsBase)
    value, looked_at = (0.25, 1.0), 0
    for props in vars(messages).values():
        if isinstance(props, type) and props.__name__.endswith("Props"):
            for name, hint in assignments._hints(props).items():
                if name not in assignments.converted_properties(props):
                    looked_at += 1
                    assert original(asker, hint, value, name) is value, f"{props.__name__}.{name}: {hint}"
    assert looked_at > 200
