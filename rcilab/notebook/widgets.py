"""Sliders for the joints of an arm: degrees on screen, radians in code."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import ipywidgets
import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_vector, readonly_copy
from rcilab.core.errors import InvalidValueError, KinematicsError
from rcilab.i18n.notebook_language import chosen_language
from rcilab.i18n.rounding import format_fixed
from rcilab.i18n.translator import Text
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.notebook.cells import kernel_cells
from rcilab.notebook.slider_echo import SliderEcho

_STEP_DEG = 0.5


class JointSliders:
    """One slider per joint, its limits at its ends, and the pose of the tool below; displays itself in a notebook.

    Args:
        model: The arm.
        q: Initial joint angles, shape (n,), [rad]; defaults to the arm's home.
        show: Called with the joint angles, shape (n,), [rad], at the start and after every change, e.g. `preview.show`.
        continuous: Whether a slider reports while it is dragged, or once at the end of the drag. Choose False if `show`
            is slow; ipywidgets drops changes that come too fast, so dragging is safe either way.
        language: "en" or "zh"; defaults to that of the notebook.

    Raises:
        InvalidValueError: q is not n angles inside the limits, the model is not one, or the language is unknown.
    """

    def __init__(
        self,
        model: RobotModel,
        q: ArrayLike | None = None,
        *,
        show: Callable[[JointVector], object] | None = None,
        continuous: bool = True,
        language: str | None = None,
    ) -> None:
        self._model = require_model(model)
        kernel_cells()  # Starts the watchdog of the page.
        self._text = text = Text(chosen_language(language), "rcilab.notebook")
        self._show = show
        self._setting = False
        limits = model.limits.joint
        self.sliders = [
            _joint_slider(
                text("jog.joint", joint=i + 1), math.degrees(limits.lower[i]), math.degrees(limits.upper[i]), continuous
            )
            for i in range(model.n)
        ]
        self._echoes = [SliderEcho(slider) for slider in self.sliders]
        self.home = ipywidgets.Button(description=text("jog.home"), tooltip=text("jog.home_hint"))
        self.zero = ipywidgets.Button(description=text("jog.zero"), tooltip=text("jog.zero_hint"))
        self.pose = ipywidgets.HTML()
        self._q = self._checked(model.home if q is None else q)
        for slider in self.sliders:
            slider.observe(self._on_slider, names="value")
        self.home.on_click(lambda _: self._set(model.home))
        self.zero.on_click(lambda _: self._set(np.zeros(model.n)))
        rows = [_with_limits(slider) for slider in self.sliders]
        self.widget = ipywidgets.VBox([*rows, ipywidgets.HBox([self.home, self.zero]), self.pose])
        self._set(self._q)

    @property
    def q(self) -> JointVector:
        """Joint angles, shape (n,), read-only, [rad]. Can be set; the sliders follow."""
        return self._q

    @q.setter
    def q(self, q: ArrayLike) -> None:
        self._set(self._checked(q))

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self.widget._repr_mimebundle_(**options)

    def _set(self, q: JointVector) -> None:
        """Sets angles as they are; the sliders show them rounded, and their echoes are ignored."""
        self._q = readonly_copy(q)
        self._setting = True
        try:
            for slider, echo, angle in zip(self.sliders, self._echoes, np.degrees(self._q).tolist(), strict=True):
                echo.register(angle)
                slider.value = angle
        finally:
            self._setting = False
        self._report()

    def _on_slider(self, change: Any) -> None:
        joint = self.sliders.index(change["owner"])
        if self._setting or not self._echoes[joint].is_drag(change["new"]):
            return
        limits = self._model.limits.joint
        q = self._q.copy()
        q[joint] = np.clip(math.radians(change["new"]), limits.lower[joint], limits.upper[joint])
        self._q = readonly_copy(q)
        self._report()

    def _report(self) -> None:
        T_base_tool = self._model.forward(self._q)
        numbers = np.concatenate((1e3 * T_base_tool.position, np.degrees(T_base_tool.rpy)))
        names = [self._text(f"target.{name}") for name in ("x", "y", "z", "roll", "pitch", "yaw")]
        numbers = [
            f"{name} {number:.1f}" for name, number in zip(names, np.round(numbers, 1) + 0.0, strict=True)
        ]  # No -0.0.
        parts = [f"{', '.join(numbers[:3])} mm", f"{', '.join(numbers[3:])}°"]
        if self._model.redundancy:
            try:
                psi = math.degrees(self._model.arm_angle(self._q))
                parts.append(f"{self._text('jog.arm_angle')} {format_fixed(psi, 1)}°")
            except KinematicsError:  # Stretched or straight above the base: there is no elbow to measure.
                parts.append(self._text("jog.no_arm_angle"))
        self.pose.value = f"<code>{self._text('jog.tool')}: {'; '.join(parts)}</code>"
        if self._show is not None:
            self._show(self._q)

    def _checked(self, q: ArrayLike) -> JointVector:
        angles = as_vector(q, self._model.n, "q", "rad")
        limits = self._model.limits.joint
        for joint, (angle, low, high) in enumerate(zip(angles, limits.lower, limits.upper, strict=True), start=1):
            if not low <= angle <= high:
                raise InvalidValueError(
                    f"q of joint {joint}", float(angle), f"must be from {low:.4f} to {high:.4f} rad"
                )
        return angles


def _joint_slider(name: str, lower: float, upper: float, continuous: bool) -> Any:
    return ipywidgets.FloatSlider(
        description=name,
        min=lower,
        max=upper,
        step=_STEP_DEG,
        readout_format=".1f",
        continuous_update=continuous,
        layout=ipywidgets.Layout(width="26em"),
    )


def _with_limits(slider: Any) -> Any:
    """Returns the slider with its limits at both ends."""
    label = ipywidgets.Layout(width="4em", display="flex", justify_content="center")
    return ipywidgets.HBox([
        ipywidgets.Label(f"{slider.min:.0f}°", layout=label),
        slider,
        ipywidgets.Label(f"{slider.max:.0f}°", layout=label),
    ])  # fmt: skip
