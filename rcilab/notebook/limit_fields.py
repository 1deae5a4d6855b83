"""Soft joint limits, and whether a virtual controller stops commands inside them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import ipywidgets
import numpy as np

from rcilab.app.arm_features import explain_missing_part
from rcilab.app.run.world_actions import SetWiring, WorldActions
from rcilab.app.setup.setup_fields import exact_end, joint_limits_between
from rcilab.control_process import SupervisorStatus
from rcilab.core.errors import RcilabError
from rcilab.core.limits import JointLimits
from rcilab.i18n.translator import Message, Text
from rcilab.makers.configuration import RobotConfiguration, SoftJointLimits
from rcilab.makers.maker import capabilities_of
from rcilab.notebook.number_field import NumberField
from rcilab.notebook.signal_fields import SendRequest
from rcilab.notebook.state import LabState
from rcilab.notebook.style import block, problem, soft, verdict, write
from rcilab.notebook.widget_sharing import shared_style_widget
from rcilab.robots import describe_robot

_WIDTHS = ("9.2em", "3.4em", "2.6em")  # With both ends of a joint in one row.


class LimitFields:
    """A folded group of `RunPanel`; typed values are sent by a button.

    Args:
        state: State of the lab.
        text: The catalogue.
        world: Sets auto_limit at a virtual controller.
        send: Sends a request to the connected robot, by its name.
        button: Creates a button of the panel.
    """

    def __init__(
        self, state: LabState, text: Text, world: WorldActions, send: SendRequest, button: Callable[..., Any]
    ) -> None:
        self._state, self._text, self._world, self._send = state, text, world, send
        self.fields: list[tuple[NumberField, NumberField]] = []
        """Lower and upper end of every joint, once the group was opened."""
        self._typed: list[list[float]] = []  # Lower ends and upper ends, [rad].
        self._shown: JointLimits | None = None
        self._pending: SoftJointLimits | None = None
        self._writing = False
        self.send = button("softlimits.send", lambda: self._propose(*self._typed))
        self.whole = button("softlimits.whole", self._propose_whole)
        self.yes = button("softlimits.confirm", self._send_limits, style="danger")
        self.no = button("run.cancel", self._cancel_question)
        self.auto: Any = shared_style_widget(
            ipywidgets.Checkbox, value=False, indent=False, description=text("softlimits.auto"),
            tooltip=text("softlimits.auto_hint"), layout={"width": "auto"},
        )  # fmt: skip
        self.auto.observe(self._on_auto, names="value")
        self._inside: Any = shared_style_widget(ipywidgets.VBox, [])
        self.message_box = block()
        self._answers = shared_style_widget(
            ipywidgets.HBox, [self.yes, self.no], layout=ipywidgets.Layout(display="none")
        )
        is_there = explain_missing_part(state.model, "joints") is None
        has_auto = "auto_limit" in capabilities_of(state.model).options
        rows = [
            block(soft(text("softlimits.hint"))),
            self._inside,
            shared_style_widget(ipywidgets.HBox, [self.send, self.whole]),
            self.message_box,
            self._answers,
            *([self.auto, block(soft(text("softlimits.note")))] if has_auto else ()),
        ]
        self.folder: Any = shared_style_widget(
            ipywidgets.Accordion,
            [shared_style_widget(ipywidgets.VBox, rows)],
            titles=(text("softlimits.title"),),
            selected_index=None,
            layout=ipywidgets.Layout(display=None if is_there else "none"),
        )
        self.folder.observe(self._on_open, names="selected_index")

    def show(self, status: SupervisorStatus | None) -> None:
        """Follows the controller and the limits of the arm."""
        is_ready = status is not None and status.phase in ("idle", "fault")
        self.send.disabled = not is_ready or not self.fields
        self.whole.disabled = not is_ready
        if not is_ready:
            self._cancel_question()
        now = self._state.now
        is_virtual = self._state.robot is not None and now.is_virtual
        self.auto.disabled = not is_ready or not is_virtual
        self._writing = True
        # A group that was never opened shows no status of the controller.
        self.auto.value = bool(self.fields) and is_virtual and now.world.auto_limit
        self._writing = False
        limits = self._state.model.limits.joint
        if self.fields and limits is not self._shown:
            self._fill(limits)

    def take(self, error: RcilabError | None) -> None:
        """Takes the answer: model, plan and checks use the limits that a controller has accepted."""
        asked, self._pending = self._pending, None
        if error is None and asked is not None:
            self._state.limit_joints(asked.lower, asked.upper)
            write(self.message_box, soft(self._text("softlimits.taken")))

    def _propose(self, lower: list[float], upper: list[float]) -> None:
        joints = joint_limits_between(lower, upper)
        if isinstance(joints, Message):
            write(self.message_box, problem(self._text.render(joints)))
            return
        self._pending = joints
        now = self._state.now
        if now.is_virtual:
            self._send_limits()
            return
        write(self.message_box, verdict("warn", "▲", self._text("softlimits.ask", address=now.target)))
        self._answers.layout.display = None

    def _propose_whole(self) -> None:
        own = describe_robot(self._state.model.name).limits.joint
        self._propose(own.lower.tolist(), own.upper.tolist())

    def _send_limits(self) -> None:
        self._answers.layout.display = "none"
        write(self.message_box, "")
        asked = self._pending
        if asked is not None:
            self._send("limits", lambda robot: robot.configure(RobotConfiguration(joints=asked)))

    def _cancel_question(self) -> None:
        if self._answers.layout.display is None:
            self._pending = None
            self._answers.layout.display = "none"
            write(self.message_box, "")

    def _on_auto(self, change: Any) -> None:
        if not self._writing:
            with self._state.lock:
                self._world.set_wiring(SetWiring(name="auto_limit", on=bool(change["new"])))

    def _on_open(self, change: Any) -> None:
        """Creates the fields when they are needed: fourteen of them would delay the cell."""
        if change["new"] != 0 or self.fields:
            return
        own = describe_robot(self._state.model.name).limits.joint
        rows: list[Any] = []
        for joint, (least, largest) in enumerate(zip(np.degrees(own.lower), np.degrees(own.upper), strict=True)):
            low, high = self._field("lower", joint, least, largest), self._field("upper", joint, least, largest)
            self.fields.append((low, high))
            rows += [shared_style_widget(ipywidgets.HBox, [*low.cells, *high.cells]), low.message_box, high.message_box]
        self._fill(self._state.model.limits.joint)
        self._inside.children = tuple(rows)
        self.show(self._state.status)

    def _field(self, end: str, joint: int, least: float, largest: float) -> NumberField:
        def take(degrees: float) -> None:
            own = describe_robot(self._state.model.name).limits.joint
            angle = exact_end(own, end, joint, math.radians(degrees))
            self._typed[0 if end == "lower" else 1][joint] = angle

        label = self._text(f"softlimits.{end}", joint=joint + 1)
        low, high = round(float(least), 6), round(float(largest), 6)
        return NumberField(self._text, label, "deg", low, high, take, widths=_WIDTHS)

    def _fill(self, limits: JointLimits) -> None:
        self._shown = limits
        self._typed = [limits.lower.tolist(), limits.upper.tolist()]
        for joint, ends in enumerate(self.fields):
            for field, bounds in zip(ends, self._typed, strict=True):
                field.show(math.degrees(bounds[joint]))
