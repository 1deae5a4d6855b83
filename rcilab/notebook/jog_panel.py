"""Sliders and typed numbers for the joints: degrees on screen, radians in code."""

from __future__ import annotations

import math
from typing import Any

import ipywidgets
import numpy as np
from numpy.typing import ArrayLike

from rcilab.app.arm_features import has_zero_pose
from rcilab.app.goal.goal import verdict_lead
from rcilab.app.goal.goal_actions import MoveJoint, PoseGoal, PoseName
from rcilab.core.arrays import JointVector
from rcilab.i18n.rounding import format_fixed
from rcilab.notebook.number_field import NumberField
from rcilab.notebook.part import Part
from rcilab.notebook.slider_echo import SliderEcho
from rcilab.notebook.style import block, verdict, write
from rcilab.notebook.widget_sharing import shared_style_widget

_STEP_DEG = 0.5
_BUTTONS: dict[PoseName, str] = {"home": "home", "zero": "zero", "here": "arm", "undo": "undo"}
"""Poses of buttons, and their names in the catalogues."""


class JogPanel(Part):
    """One slider and one number per joint, and the pose of the tool. It sets the goal; it never moves a robot.

    Args:
        subject: A model, a session, or another part of the same arm.
        q: Initial joint angles, shape (n,), [rad]; defaults to the arm's home, or the goal of the other part.
        continuous: Whether a slider reports while it is dragged, or once at the end of the drag.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.

    Raises:
        InvalidValueError: The subject is unknown, or q is not n angles inside the limits.
    """

    def __init__(
        self, subject: object, q: ArrayLike | None = None, *, continuous: bool = True, language: str | None = None
    ) -> None:
        super().__init__(subject, language)
        limits = self.model.limits.joint
        low, high = np.degrees(limits.lower), np.degrees(limits.upper)
        self._writing = False
        if q is not None:
            self.state.pose(q)
        here: list[float] = np.degrees(self.state.now.goal.q).tolist()
        names = [self.text("jog.joint", joint=j + 1) for j in range(self.model.n)]
        self.sliders = [
            shared_style_widget(
                ipywidgets.FloatSlider, value=here[j], tooltip=names[j], min=float(low[j]), max=float(high[j]),
                step=_STEP_DEG, readout=False, continuous_update=continuous,
                layout={"flex": "1 1 auto", "width": "auto", "min_width": "150px"},
            )
            for j in range(self.model.n)
        ]  # fmt: skip
        self.fields = [
            NumberField(
                self.text, "", "deg", round(float(low[j]), 6), round(float(high[j]), 6), self._setter(j), digits=2,
                of=names[j], value=here[j],
            )
            for j in range(self.model.n)
        ]  # fmt: skip
        self._echoes = [SliderEcho(slider) for slider in self.sliders]
        rows: list[Any] = []
        for slider, field in zip(self.sliders, self.fields, strict=True):
            slider.observe(self._on_slider, names="value")
            rows += [_row(slider, field), field.message_box]
        buttons = [self._button(name) for name in _BUTTONS if name != "zero" or has_zero_pose(self.model)]
        self._pose, self._reach = block(), block()
        self.build([*rows, shared_style_widget(ipywidgets.HBox, buttons), self._pose, self._reach], min_width="360px")
        self.subscribe("goal", self._show)

    @property
    def q(self) -> JointVector:
        """Joint angles of the goal, shape (n,), read-only, [rad]. Can be set; all parts follow."""
        return self.state.now.goal.q

    @q.setter
    def q(self, q: ArrayLike) -> None:
        self.state.pose(q)

    def _show(self) -> None:
        state = self.state
        self._writing = True
        try:
            shown = np.degrees(state.now.goal.q).tolist()
            for slider, echo, field, angle in zip(self.sliders, self._echoes, self.fields, shown, strict=True):
                if abs(slider.value - angle) > 1e-9:
                    echo.register(angle)
                    slider.value = angle
                field.show(angle)
        finally:
            self._writing = False
        write(self._pose, self._describe_pose())
        reach = state.now.goal.reach
        lead = self.text(verdict_lead(reach.tone, reach.reason))
        write(self._reach, verdict(reach.tone, lead, self.text.render(reach.reason)))

    def _describe_pose(self) -> str:
        pose = self.model.forward(self.state.now.goal.q)
        numbers = np.round(np.concatenate((1e3 * pose.position, np.degrees(pose.rpy))), 1) + 0.0  # No -0.0.
        names = [self.text(f"target.{name}") for name in ("x", "y", "z", "roll", "pitch", "yaw")]
        units = [" mm"] * 3 + ["°"] * 3
        cells = [f"{name} <b>{number:.1f}</b>{unit}" for name, number, unit in zip(names, numbers, units, strict=True)]
        psi = self.state.now.goal.psi
        if psi is not None:
            cells.append(f"{self.text('jog.arm_angle')} <b>{format_fixed(math.degrees(psi), 1)}</b>°")
        elif self.model.redundancy:
            cells.append(self.text("jog.no_arm_angle"))
        return f'<p class="rl-soft rl-num">{self.text("jog.tool")}: {", ".join(cells)}</p>'

    def _on_slider(self, change: Any) -> None:
        joint = self.sliders.index(change["owner"])
        if not self._writing and self._echoes[joint].is_drag(change["new"]):
            self._move(joint, math.radians(change["new"]))

    def _setter(self, joint: int) -> Any:
        return lambda degrees: self._move(joint, math.radians(degrees))

    def _move(self, joint: int, angle: float) -> None:
        self.state.ask(MoveJoint(joint=joint, angle=angle))

    def _on_button(self, name: PoseName) -> None:
        self.state.ask(PoseGoal(name=name))

    def _button(self, name: PoseName) -> Any:
        button = shared_style_widget(
            ipywidgets.Button,
            description=self.text(f"jog.{_BUTTONS[name]}"),
            tooltip=self.text(f"jog.{_BUTTONS[name]}_hint"),
            layout={"width": "auto"},
        )
        button.on_click(lambda _: self._on_button(name))
        return button


def _row(slider: Any, field: NumberField) -> Any:
    """Returns the slider with its limits at both ends, and the number."""
    low, high = (f"<span>{end:.0f}°</span>" for end in (slider.min, slider.max))
    before = block(f'<div class="rl-ends"><span>{slider.tooltip}</span>{low}</div>', width="8em", flex="0 0 auto")
    behind = block(high, width="2.6em", flex="0 0 auto")
    return shared_style_widget(
        ipywidgets.HBox, [before, slider, behind, field.box, field.unit], layout={"align_items": "center"}
    )
