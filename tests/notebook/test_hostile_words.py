"""Words of unknown senders in a notebook's parts are shown as words."""

from __future__ import annotations

import ipywidgets

from rcilab import load_model, notebook
from rcilab.recording.run import build_run
from rcilab.recording.run_setup import Setup
from tests.recording.runs import MODEL, PLAN, some_cycles

HOSTILE = "<img src=x onerror=alert(1)>&\"'</style><script>alert(2)</script>"


def markup(widget: ipywidgets.Widget) -> list[str]:
    """Every piece of HTML below a widget."""
    found = [widget.value] if isinstance(widget, ipywidgets.HTML) else []
    return found + [text for child in getattr(widget, "children", ()) for text in markup(child)]


def test_an_address_that_is_markup_is_told_as_text() -> None:
    with notebook.RunPanel(load_model("xMatePro7")) as panel:
        for typed in (HOSTILE, f"rci://{HOSTILE}", f"rci://192.0.2.1:1337?{HOSTILE}"):
            panel.target.value = "address"
            panel.address.value = typed
            panel.connect.click()
            shown = "".join(markup(panel.widget))
            assert "<img" not in shown
            assert "<script" not in shown


def test_a_run_that_strangers_have_named_is_shown_as_text() -> None:
    setup = Setup(target=HOSTILE, plant=HOSTILE, mode=HOSTILE, started_ns=1)
    shown = build_run(some_cycles(), plan=PLAN, model=MODEL, setup=setup, stopped=HOSTILE)._repr_html_()
    assert "<img" not in shown
    assert "<script" not in shown
