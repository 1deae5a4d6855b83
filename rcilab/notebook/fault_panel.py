"""Faults: each fault of the manual, provoked on a private controller, and the flight recorder of the last stop."""

from __future__ import annotations

from functools import partial
from typing import Any

import ipywidgets
import numpy as np

from rcilab.app.displayed_motion import display_fault
from rcilab.app.fault_lab.demo_view import body_html, head_html
from rcilab.app.fault_lab.fault_demo import FaultDemo
from rcilab.app.fault_lab.private_arm import PrivateArm
from rcilab.app.fault_lab.table import FaultTable
from rcilab.app.status_text import describe_remedy, explain_error
from rcilab.core.errors import RcilabError
from rcilab.core.fault import FaultCode, name_faults
from rcilab.i18n.translator import Text, message
from rcilab.notebook.demo_plot import draw_signal
from rcilab.notebook.flight_recorder import record_html
from rcilab.notebook.long_task import LongTask
from rcilab.notebook.part import Part
from rcilab.notebook.style import block, esc, problem, soft, verdict, write
from rcilab.notebook.widget_sharing import shared_style_widget


class FaultPanel(Part):
    """All faults, those that are set now, and the last milliseconds before a stop.

    "Trigger" triggers the chosen fault on a private virtual controller, which has no other client and ends with this
    panel; the robot of the notebook is not touched. `Scene`, `Timeline` and `MotionPlot` of the same arm show the
    moment of the fault, until the next plan, goal or execution.

    Args:
        subject: A model, a session, or another part of the same arm.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
    """

    def __init__(self, subject: object, *, language: str | None = None) -> None:
        super().__init__(subject, language)
        text = self.text
        self.demo: FaultDemo | None = None
        """The displayed fault; None before the first one."""
        self._faults = FaultTable(self.model)
        self._failed = ""  # Why the last demo failed.
        self._now, self._details, self._record = block(), block(), block()
        self._set: tuple[FaultCode, ...] | None = None
        self._arm = PrivateArm()
        self._work: LongTask[FaultCode, FaultDemo] = LongTask(text, "rcilab-fault-lab", self._take, self._show_demo)
        self.fault: Any = shared_style_widget(
            ipywidgets.Dropdown, description=text("fault.which"), layout={"width": "98%", "max_width": "46em"},
            options=[(_name(fault, text), fault) for fault in self.model.description.faults],
        )  # fmt: skip
        self.provoke = self._button("fault.provoke", self._provoke, icon="bolt", tooltip=text("fault.provoke_hint"))
        self.progress, self.cancel = self._work.progress, self._work.cancel
        self.moment = self._button(
            "learn.moment", self._go_to_fault, icon="crosshairs", tooltip=text("learn.moment_hint")
        )
        self._buttons = shared_style_widget(
            ipywidgets.HBox,
            [self.provoke, self.moment, self.progress, self.cancel],
            layout={"align_items": "center"},
        )
        self.build([self._now, self.fault, self._buttons, self._details, self._record], min_width="360px")
        self.fault.observe(lambda _: self._on_fault(), names="value")
        self._show_demo()
        self.subscribe("robot", self._show)
        self.subscribe("run", lambda: write(self._record, record_html(self.state, self.text)))

    def halt(self) -> None:
        """Cancels the provocation; the private arm is stopped meanwhile."""
        self._work.request_cancel()

    def end(self) -> None:
        """Ends the private controller."""
        self._work.end()
        self._arm.close()

    def _show(self) -> None:
        status, text = self.state.status, self.text
        faults = () if status is None else status.faults
        if faults == self._set:
            return
        self._set = faults
        if not faults:
            write(self._now, verdict("good", "●", text("run.no_faults")))
            return
        names = name_faults(faults)
        write(self._now, verdict("bad", "◆", text("fault.now", faults=names)))
        self.fault.value = faults[0]

    @property
    def _shown(self) -> FaultDemo | None:
        """The demo, if it is that of the chosen fault."""
        demo = self.demo
        return demo if demo is not None and demo.fault is self.fault.value else None

    def _on_fault(self) -> None:
        if self._shown is None:
            self.state.display(None)
        self._failed = ""
        self._show_demo()

    def _go_to_fault(self) -> None:
        """Shows the moment of the fault in scene, timeline and curves."""
        if self._shown is not None:
            self.state.display(display_fault(self._shown))

    def _show_demo(self) -> None:
        fault: FaultCode | None = self.fault.value  # None: an arm of no maker has no faults.
        text, demo = self.text, self._shown
        sentence = self._failed
        if self._work.is_busy and fault is not None:
            sentence = verdict("warn", "…", text("learn.provoking", fault=fault.manual_name))
        obstacle = self._faults.obstacle(fault)
        self.moment.layout.display = "none" if demo is None else None
        if demo is not None:
            details = _demo_html(demo, text)
        else:
            details = ("" if fault is None else _card_html(fault, text)) + soft(
                text("fault.private") if obstacle is None else text.render(obstacle)
            )
        write(self._details, sentence + details)
        self.provoke.disabled = obstacle is not None or self._work.is_busy

    def _provoke(self) -> None:
        fault: FaultCode = self.fault.value
        self.demo, self._failed = None, ""
        self.state.display(None)
        self._work.start(fault, partial(self._arm.provoke, fault, self.model.name))
        self._show_demo()

    def _take(self, fault: FaultCode, found: FaultDemo | RcilabError) -> None:
        if isinstance(found, RcilabError):
            self._failed = problem(self.text.render(message("learn.failed", error=explain_error(found))))
            return
        self.demo = found
        self.fault.value = found.fault
        self._go_to_fault()

    def _button(self, code: str, act: Any, *, icon: str, tooltip: str = "") -> Any:
        sentence = self.text(code)
        button = shared_style_widget(
            ipywidgets.Button,
            description=sentence,
            tooltip=tooltip or sentence,
            icon=icon,
            layout=ipywidgets.Layout(width="auto"),
        )
        button.on_click(lambda _: act())
        return button


def _name(fault: FaultCode, text: Text) -> str:
    label = f"label.{fault.key}"
    return f"{text(label)} · {fault.manual_name}" if text.has(label) else fault.manual_name


def _card_html(fault: FaultCode, text: Text) -> str:
    return (
        f'<div class="rl-card rl-none"><b>{esc(fault.manual_name)}</b> '
        f'<span class="rl-soft">{esc(text("fault.bit", bit=int(fault)))}</span>'
        f"<p>{esc(text(f'fault.{fault.key}'))}</p>"
        f'<p class="rl-soft">{esc(describe_remedy(fault, text))}</p></div>'
    )


def _demo_html(demo: FaultDemo, text: Text) -> str:
    signal, picture = demo.signal, ""
    if signal is not None and signal.has_curve:
        factor = text.units.from_si(signal.condition.unit)[0]
        title = text(f"condition.{signal.condition.id}")
        picture = draw_signal(signal, np.array(demo.cycles["t"]), title, text("plot.time"), factor)
    script = f"<details><summary>{esc(text('learn.script'))}</summary><pre>{esc(demo.script)}</pre></details>"
    return f"{head_html(demo, text)}{picture}{body_html(demo, text)}{script}"
