"""Target: the pose of the tool as numbers, its branches, and the circle of the arm angle."""

from __future__ import annotations

import math
from typing import Any

import ipywidgets
import numpy as np

from rcilab.app.goal.goal import NO_SOLUTIONS, POSE_FIELDS, distinguishing_joints, margin, verdict_lead
from rcilab.app.goal.goal_actions import FURTHEST, ChooseBranch, SetArmAngle
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose
from rcilab.notebook.arc_circle import draw_circle
from rcilab.notebook.number_field import NumberField
from rcilab.notebook.part import Part
from rcilab.notebook.slider_echo import SliderEcho
from rcilab.notebook.style import block, head, soft, verdict, write
from rcilab.notebook.widget_sharing import shared_style_widget

_MAX_COORDINATE = 1000.0 * FURTHEST  # [mm]
_WHOLE_TURN = 360.0  # [deg]


class TargetPanel(Part):
    """The target pose of the tool. The arm takes the nearest branch; the others, and every arm angle, can be chosen.

    Args:
        subject: A model, a session, or another part of the same arm.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
    """

    def __init__(self, subject: object, *, language: str | None = None) -> None:
        super().__init__(subject, language)
        text = self.text
        self.fields = [
            NumberField(
                text, text(f"target.{name}"), "mm" if index < 3 else "deg",
                *((-_MAX_COORDINATE, _MAX_COORDINATE) if index < 3 else (-_WHOLE_TURN, _WHOLE_TURN)),
                self._setter(index),
            )
            for index, name in enumerate(POSE_FIELDS)
        ]  # fmt: skip
        self._reach, self._table, self._circle = block(), block(), block()
        self.branches = shared_style_widget(
            ipywidgets.Dropdown, description=text("target.branch"), tooltip=text("target.branch_hint"),
            layout=ipywidgets.Layout(width="22em"), style={"description_width": "8em"},
        )  # fmt: skip
        self.branches.observe(self._on_branch, names="value")
        pairs = [
            shared_style_widget(
                ipywidgets.VBox,
                [
                    shared_style_widget(ipywidgets.HBox, [*first.cells, *second.cells]),
                    first.message_box,
                    second.message_box,
                ],
            )
            for first, second in zip(self.fields[:3], self.fields[3:], strict=True)
        ]
        rows: list[Any] = [block(head(text("target.pose", in_mm="mm", in_deg="deg"))), *pairs, self._reach]
        self.psi: Any = None
        if self.model.redundancy:
            rows += self._arm_angle_rows()
        rows += [block(head(text("target.branches"))), self._table, self.branches]
        self._writing = False
        self.build(rows, min_width="360px")
        self.subscribe("goal", self._show)

    def _arm_angle_rows(self) -> list[Any]:
        text = self.text
        self.psi = shared_style_widget(
            ipywidgets.FloatSlider, description="ψ", min=-180.0, max=180.0, step=1.0, readout=False,
            tooltip=text("target.psi_hint"),
            layout={"width": "98%"}, style={"description_width": "1.5em"},
        )  # fmt: skip
        self._psi_echo = SliderEcho(self.psi)
        self.psi.observe(self._on_psi, names="value")
        self._psi_field = NumberField(text, "", "deg", -180.0, 180.0, self._turn)
        side = shared_style_widget(ipywidgets.VBox, [
            self.psi,
            shared_style_widget(ipywidgets.HBox, self._psi_field.cells, layout={"align_items": "center"}),
            self._psi_field.message_box,
            block(soft(text("target.psi_hint"))),
        ], layout={"flex": "1 1 170px", "min_width": "170px"})  # fmt: skip
        row = shared_style_widget(
            ipywidgets.HBox, [self._circle, side], layout={"align_items": "center", "flex_flow": "row wrap"}
        )
        return [block(head(text("target.psi_title", in_deg="deg"))), row]

    def _setter(self, index: int) -> Any:
        def take(value: float) -> None:
            target = self.state.now.goal.target
            position, rpy = np.array(target.position), np.array(target.rpy)
            if index < 3:
                position[index] = value / 1000.0
            else:
                rpy[index - 3] = math.radians(value)
            self.state.aim(Pose.from_rpy(position, rpy))

        return take

    def _turn(self, degrees: float) -> None:
        self.state.ask(SetArmAngle(psi=math.radians(degrees)))

    def _on_psi(self, change: Any) -> None:
        if not self._writing and self._psi_echo.is_drag(change["new"]):
            self._turn(change["new"])

    def _on_branch(self, change: Any) -> None:
        if not self._writing and change["new"] is not None:
            self.state.ask(ChooseBranch(index=change["new"]))

    def _show(self) -> None:
        state, text = self.state, self.text
        self._writing = True
        try:
            goal = state.now.goal
            values = (*(1e3 * goal.target.position), *np.degrees(goal.target.rpy))
            for field, value in zip(self.fields, values, strict=True):
                field.show(float(value))
            tone, why = goal.reach.tone, goal.reach.reason
            sentence = verdict(tone, text(verdict_lead(tone, why)), text.render(why))
            if goal.reach.missed_by is not None:
                sentence += soft(text("target.leads_short", short=text.render(goal.reach.missed_by)))
            write(self._reach, sentence)
            if self.psi is not None:
                self._show_arm_angle()
            self._show_branches()
        finally:
            self._writing = False

    def _show_arm_angle(self) -> None:
        psi = self.state.now.goal.psi
        if psi is not None:
            degrees = math.degrees(psi)
            if abs(self.psi.value - degrees) > 1e-6:
                self._psi_echo.register(degrees)
                self.psi.value = degrees
            self._psi_field.show(degrees)
        try:
            arcs = self.model.feasible_arcs(self.model.forward(self.state.now.goal.q))
        except KinematicsError:
            write(self._circle, soft(self.text("jog.no_arm_angle")))
            return
        write(self._circle, draw_circle(arcs, psi, self.text))

    def _show_branches(self) -> None:
        state, text = self.state, self.text
        goal = state.now.goal
        solutions = goal.reach.solutions
        if solutions is None or not len(solutions):
            self.branches.layout.display = "none"
            code = NO_SOLUTIONS.get(verdict_lead(goal.reach.tone, goal.reach.reason), "target.no_branches")
            write(self._table, soft(text(code)))
            return
        model, rows, angles = self.model, [], np.asarray(list(solutions))
        joints = distinguishing_joints(angles)
        distances = np.abs(angles - state.here).max(axis=1).tolist()
        turned = np.abs(np.remainder(angles - goal.q + math.pi, math.tau) - math.pi).max(axis=1)
        chosen = int(turned.argmin()) if turned.min() < 1e-6 else None
        for number, (distance, degrees) in enumerate(zip(distances, np.degrees(angles).tolist(), strict=True)):
            least = margin(model, angles[number])
            label = text("target.way", number=number + 1, margin=least.angle, joint=least.joint, away=distance)
            rows.append(" · ".join([label, *(f"J{j + 1} {degrees[j]:.0f}°" for j in joints)]))
        options = [(row, number) for number, row in enumerate(rows)]
        if tuple(options) != self.branches.options:
            self.branches.options = options
        self.branches.value = chosen
        self.branches.layout.display = None
        others = len(solutions.all) - len(solutions)
        write(self._table, soft(text("target.forbidden", count=others)) if others else "")
