"""The controls of a page as a list: buttons, switches and choices, where they are and whether they can be used.

The command palette shows them. A page has only those of open tabs, so the list is made here.

Unnecessary once viser's command palette lists the controls of a page, in its language.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import viser


@dataclass(frozen=True, slots=True)
class Control:
    """A control that a page can use."""

    uuid: str
    """Identifier of its element on the page."""
    label: str
    hint: str
    place: tuple[str, ...]
    """Labels of the tab and the folders that contain it."""
    is_disabled: bool
    options: tuple[str, ...] = ()
    """Of a choice."""


def list_controls(server: viser.ViserServer) -> list[Control]:
    """Returns the visible buttons, switches and choices; not those that are held, such as for jogging."""
    gui: Any = server.gui
    found: list[Control] = []
    for uuid, handle in tuple(gui._gui_input_handle_from_uuid.items()):
        props = handle._impl.props
        kind = type(props).__name__
        place = _place_of(gui, handle)
        is_listed = kind in ("GuiButtonProps", "GuiUploadButtonProps", "GuiCheckboxProps", "GuiDropdownProps")
        if not is_listed or place is None or not props.visible or getattr(props, "_hold_callback_freqs", ()):
            continue
        options = tuple(props.options) if kind == "GuiDropdownProps" else ()
        found.append(Control(uuid, props.label, props.hint or "", place, bool(props.disabled), options))
    return found


def _place_of(gui: Any, handle: Any) -> tuple[str, ...] | None:
    """Returns the labels of the containers, outermost first; None if one is not visible."""
    labels: list[str] = []
    while True:
        container: Any = gui._container_handle_from_uuid.get(handle._impl.parent_container_id)
        if container is None:
            return tuple(labels)
        if not hasattr(container, "_impl"):  # A tab, or the page itself.
            return (container._label, *labels) if hasattr(container, "_label") else tuple(labels)
        if not container._impl.props.visible:
            return None
        labels.insert(0, container._impl.props.label)
        handle = container
