"""Jog: what the buttons move and how fast; each joint with slider, buttons and number; the axes of the tool."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.goal.goal import NEAR_LIMIT, verdict_lead
from rcilab.app.goal.goal_actions import MoveJoint
from rcilab.app.jog.jog_actions import SetJog
from rcilab.app.jog.jog_state import AXES, FASTEST_JOINT, FASTEST_TOOL, FRAMES, STEPS, HoldJog, PressJog, no_jog
from rcilab.app.request import Request
from rcilab.app.setup.configuration_state import goal_verdict
from rcilab.app.text import Text
from rcilab.conformance.explain import explain_limit
from rcilab.i18n.translator import with_space
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press, shown

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_HOLD_RATE = 10.0  # [1/s] Rate of messages of a held button.


class JogPanel:
    """The switch between goal and robot, step and speed; one row per joint, the limits at its ends."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        with gui.add_folder(self._text("jog.how")):
            self._build_settings(gui, state)
        with gui.add_folder(self._text("jog.joints")):
            self._build_joints(gui, state)
        self._sentence = Html(gui)

    def _build_settings(self, gui: Any, state: UiState) -> None:
        text, ask, jog = self._text, self._ask, state.jog
        gui.add_html('<i class="rl-jogset"></i>')
        robot = gui.add_checkbox(text("jog.robot"), jog.robot, hint=text("jog.robot_hint"))
        self._robot = BoundControl(robot, ask, lambda v, p: SetJog(page=p, robot=bool(v)))
        steps = {
            text("jog.step_of", length=1e-3 * step, angle=math.radians(step)) if step else text("jog.held"): step
            for step in STEPS
        }
        self._steps = {step: label for label, step in steps.items()}
        step = gui.add_dropdown(
            text("jog.step"), tuple(steps), initial_value=self._steps[jog.step], hint=text("jog.step_hint")
        )
        self._step = BoundControl(step, ask, lambda v, p: SetJog(page=p, step=steps.get(v)))
        speed = gui.add_slider(text("jog.speed"), 1, 100, 1, round(100.0 * jog.speed), hint=text("jog.speed_hint"))
        self._speed = BoundControl(speed, ask, lambda v, p: SetJog(page=p, speed=v / 100.0))
        self._speed_value, self._note = Html(gui), Html(gui)
        self._agree = gui.add_button(text("jog.confirm"), color="red", icon="hand-move", visible=False)
        on_press(self._agree, ask, lambda page: SetJog(page=page, robot=True, agreed=True))
        self._cancel = gui.add_button(text("run.cancel"), color="gray", visible=False)
        on_press(self._cancel, ask, lambda page: SetJog(page=page, robot=False))

    def _build_joints(self, gui: Any, state: UiState) -> None:
        text, limits = self._text, state.model.limits.joint
        self._sliders: list[BoundControl] = []
        self._fields: list[NumberField] = []
        self._margins: list[Html] = []
        source = explain_limit(state.model.limits.source("joint.lower"), text.language)
        factor, _ = text.units.from_si("rad")
        step, digits = (0.1, 3) if text.units.angle == "deg" else (0.001, 5)
        angles = factor * state.goal.q
        gui.add_html('<i class="rl-joints rl-held"></i>')
        for joint in range(state.model.n):
            low, high = (float(factor * bound[joint]) for bound in (limits.lower, limits.upper))
            ends = [float(bound[joint]) for bound in (limits.lower, limits.upper)]
            hint = text("jog.limit_hint", joint=joint + 1, low=ends[0], high=ends[1], source=source)
            add_jog_button(gui, self._ask, f"J{joint + 1}", f"joint.{joint}", -1)
            value = round(float(np.clip(angles[joint], low, high)), digits)
            slider = gui.add_slider(
                f"J{joint + 1}", round(low, digits), round(high, digits), step, value, marks=((0.0, ""),), hint=hint
            )
            self._sliders.append(BoundControl(slider, self._ask, _joint_request(joint, factor)))
            add_jog_button(gui, self._ask, f"J{joint + 1}", f"joint.{joint}", 1)
            box = gui.add_text("", "", hint=text("jog.type_hint"))
            self._fields.append(NumberField(box, self._ask, f"joint.{joint}", text.unit("deg")))
            self._margins.append(Html(gui))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows goal and settings."""
        jog, limits = state.jog, state.model.limits.joint
        self._robot.show(jog.robot or jog.asked)
        self._robot.handle.disabled = bool(state.watched)
        self._note.show(note_html(state, self._text))
        self._agree.visible = self._cancel.visible = jog.asked
        self._step.show(self._steps[jog.step])
        self._speed.show(round(100.0 * jog.speed))
        self._speed_value.show(speed_value_html(jog.speed, self._text))
        factor, digits = self._text.units.from_si("rad")[0], 3 if self._text.units.angle == "deg" else 5
        for joint, angle in enumerate(state.goal.q):
            self._sliders[joint].show(round(float(factor * angle), digits))
            field = self._fields[joint]
            field.show(shown(math.degrees(angle)), state.problems.get(field.field), state.entered)
            ends = float(limits.lower[joint]), float(limits.upper[joint])
            self._margins[joint].show(margin_html(float(state.goal.q[joint]), *ends, self._text))
        fields = [(field.field, f"J{number}") for number, field in enumerate(self._fields, start=1)]
        sentence = problems_html(state, self._text, fields) + said_html(state, status, self._text)
        self._sentence.show(f'<div class="rl-slot">{sentence}</div>')


class ToolJogPanel:
    """A group of the Jog tab."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text = self._text
        with gui.add_folder(text("jog.tool")):
            gui.add_html('<i class="rl-axes rl-held"></i>')
            frames = {text(f"jog.frame.{frame}"): frame for frame in FRAMES}
            self._frames = {frame: label for label, frame in frames.items()}
            chosen = self._frames[state.jog.frame]
            frame = gui.add_dropdown(
                text("jog.frame"), tuple(frames), initial_value=chosen, hint=text("jog.frame_hint")
            )
            self._frame = BoundControl(frame, self._ask, lambda v, p: SetJog(page=p, frame=frames.get(v)))
            for place in range(3):
                for axis in (AXES[place], AXES[place + 3]):
                    add_jog_button(gui, self._ask, text(f"target.{axis}"), axis, -1)
                    add_jog_button(gui, self._ask, text(f"target.{axis}"), axis, 1)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the settings."""
        self._frame.show(self._frames[state.jog.frame])


def add_jog_button(gui: Any, ask: Ask, label: str, axis: str, sign: int) -> None:
    """Adds a button that moves an axis while it is held, or by a step per press."""
    button = gui.add_button(f"{label} {'+' if sign > 0 else '−'}")

    @button.on_hold(callback_hz=_HOLD_RATE)
    async def _(event: Any) -> None:
        ask(HoldJog(page=event.client_id, axis=axis, sign=sign))

    on_press(button, ask, lambda page: PressJog(page=page, axis=axis, sign=sign))


def note_html(state: UiState, text: Text) -> str:
    """Returns what the buttons move, or the question before a foreign robot is moved."""
    if state.jog.asked:
        asked = text("jog.ask", model=state.model.name, address=state.target)
        return f'<p class="rl-verdict rl-warn" role="alert">{esc(asked)}</p>'
    if state.jog.robot:
        return f'<p class="rl-verdict rl-warn rl-slim">{esc(text("jog.live"))}</p>'
    return f'<p class="rl-note">{esc(text("jog.note_watched" if state.watched else "jog.note"))}</p>'


def speed_value_html(speed: float, text: Text) -> str:
    """Returns the speed."""
    sentence = text("jog.speed_value", tool=speed * FASTEST_TOOL, joint=speed * FASTEST_JOINT)
    return f'<p class="rl-jog-speed">{esc(sentence)}</p>'


def margin_html(angle: float, low: float, high: float, text: Text) -> str:
    """Returns the limits of a joint and its distance from the nearer one, [rad], as a bar and as text.

    All are rounded towards the inside.
    """
    left = max(min(angle - low, high - angle), 0.0)
    tone, sign = ("bad", "◆ ") if left < 1e-3 else ("warn", "▲ ") if left < NEAR_LIMIT else ("good", "")
    share = 100.0 * min(left / (0.5 * (high - low)), 1.0)
    digits, unit = 0 if tone == "good" else 1, "" if text.units.angle == "deg" else "#"  # The heading has it.
    angle_left = text.units.format(_rounded_down(left, digits, text), f"rad.{digits}f{unit}")
    limits = text.units.format([(-_rounded_down(-low, 0, text), _rounded_down(high, 0, text))], "rad.0f#")
    return (
        f'<div class="rl-margin rl-{tone}"><span>{limits}</span><i class="rl-meter">'
        f'<i style="width:{share:.0f}%"></i></i><b>{esc(sign + text("jog.left", angle=angle_left))}</b></div>'
    )


def _rounded_down(angle: float, digits: int, text: Text) -> float:
    """Returns an angle, [rad], rounded down to decimals of a degree, or to two more of a radian."""
    factor, name = text.units.from_si("rad")
    step = 10.0 ** -(digits + 2 if name == "rad" else digits) / factor
    return step * math.floor(angle / step + 1e-3)  # A limit of 224.9998 degrees is 225.


def said_html(state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns why a jog cannot begin, what ended the last one, or else the message on the goal.

    While a rejected number is shown, the status of the goal is hidden: it is about other joint angles.
    """
    reason = no_jog(state, status) if state.jog.robot else None
    sentence = reason or state.jog.sentence
    if sentence is None:
        is_rejected = any(field.startswith("joint.") for field in state.problems)
        return "" if is_rejected else reach_html(state, text)
    return f'<p class="rl-verdict rl-warn" role="alert"><b>▲</b> {esc(text.render(sentence))}</p>'


def problems_html(state: UiState, text: Text, fields: list[tuple[str, str]]) -> str:
    """Returns the problems of typed numbers, one line per field."""
    return "".join(
        f'<p class="rl-problem" role="alert"><b>{esc(label)}</b> {esc(text.render(state.problems[field]))}</p>'
        for field, label in fields
        if field in state.problems
    )


def reach_html(state: UiState, text: Text) -> str:
    """Returns the status of the target, with its tone as a word and as a sign."""
    tone, why = goal_verdict(state)
    lead, reason = with_space(text(verdict_lead(tone, why)), text.render(why))
    return f'<p class="rl-verdict rl-{tone}"><b>{esc(lead)}</b>{esc(reason)}</p>'


def _joint_request(joint: int, factor: float):  # type: ignore[no-untyped-def]
    def make(angle: float, page: int | None) -> Request:
        return MoveJoint(page=page, joint=joint, angle=angle / factor)

    return make
