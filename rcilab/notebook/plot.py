"""A motion as curves: angle, velocity, acceleration and jerk against their limits, the plan next to the run."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.conformance.check import HOLD_SAMPLES, check
from rcilab.conformance.common_conditions import JOINT_CONDITIONS
from rcilab.core.arrays import Array, as_vector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Bounds, Condition
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits
from rcilab.core.optional_deps import require_installed
from rcilab.i18n.notebook_language import chosen_language
from rcilab.i18n.translator import Text
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.motion import Motion, require_motion
from rcilab.notebook.fonts import select_font
from rcilab.notebook.palette import JOINT_COLORS
from rcilab.recording.run import Run
from rcilab.views.plots import QUANTITIES, plan_curves, planned_differences, recorded_curves

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rcilab.conformance.report import Report, Violation
    from rcilab.recording.run import Run

VIOLATION_COLOR = "#B00020"
BEYOND_LIMIT_COLOR = "#808080"

_RESOLUTION = 110  # [dots an inch] Sharp in a notebook, small in a file.
_HEADROOM = 1.12
"""Range of a panel as a factor of the limit."""


@dataclass(frozen=True, slots=True, eq=False)
class _Panel:
    """One row of the figure: the quantity of one condition, joint by joint."""

    condition: Condition
    values: Array
    """As the controller evaluates it, shape (N, n)."""
    lower: Array
    upper: Array
    """Bounds, shape (n,); shape (N, n) where they depend on the angles."""
    actual: Array | None
    """From the run, shape (M, n): measured angles and velocities, differences of the commanded angles; or None."""


def plot(
    motion: Motion | Run,
    model: RobotModel,
    run: Run | None = None,
    *,
    joints: Sequence[int] | None = None,
    language: str | None = None,
) -> Figure:
    """Draws angle, velocity, acceleration and jerk of a motion against the arm's limits.

    Velocity, acceleration and jerk are backward differences at 1 ms, because the controller checks these. The area
    beyond a limit is grey; if joints have different limits it gets darker at each. Violations of `check` are hatched in
    red over their duration, and the title gives their number, where a jump of all joints counts once. With a run, its
    data is drawn as a broad line under the dashed plan (acceleration and jerk: of its commanded angles), and a fifth
    panel shows the difference; all on the plan's time, without the robot's play-out delay (`run.delay`). No display is
    needed: the figure displays itself in a notebook, and `savefig` writes it to a file.

    Args:
        motion: A motion, or a run, which contains its plan; for a callback, its commands are drawn.
        model: The arm, whose limits are drawn.
        run: The run of the motion on a robot, from `execute`.
        joints: Numbers of the joints to draw, from 1; None draws all.
        language: "en" or "zh"; defaults to that of the notebook. Without a Chinese font it is English.

    Raises:
        InvalidValueError: A joint number does not exist on this arm, or an argument has another type.
        UsageError: matplotlib is not installed.
    """
    chosen = chosen_language(language)
    require_installed("matplotlib", "plot")
    motion, run = _motion_and_run(motion, run)
    require_model(model)
    indices = _joint_indices(joints, model.n)
    with select_font(chosen) as shown_language:
        return _draw(motion, model, run, indices, Text(shown_language, "rcilab.notebook"))


def _draw(motion: Motion, model: RobotModel, run: Run | None, chosen: Sequence[int], text: Text) -> Figure:
    report = check(motion, model)
    panels = _panels(motion, model.limits.joint.in_mode("" if run is None else run.setup.mode), run)
    figure = _new_figure(len(panels) + (run is not None))
    axes: list[Axes] = list(figure.axes)
    for panel, ax in zip(panels, axes, strict=False):
        _draw_panel(ax, panel, run, chosen, text)
        _shade_violations(ax, panel, report.violations, chosen)
    if run is not None:
        _draw_error(axes[-1], run, chosen, text)
    axes[0].secondary_yaxis("right", functions=(np.degrees, np.radians)).set_ylabel("[deg]")
    axes[0].legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(chosen) + 1, frameon=False, fontsize="small"
    )
    axes[-1].set_xlabel(text("plot.time") if run is None else text("figure.delayed", delay=run.delay))
    axes[-1].set_xlim(
        0.0,
        max(motion.duration, float(_plan_times(run)[-1]) if run is not None and len(run.t) else 0.0)
        + HOLD_SAMPLES * CYCLE_TIME,
    )
    figure.suptitle(_title(model, motion, report, text), fontsize="medium")
    return figure


def _new_figure(rows: int) -> Figure:
    """Returns an empty figure that belongs to no window and shows itself in a notebook."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    class NotebookFigure(Figure):
        """A figure that IPython can display without pyplot and its back end."""

        def _repr_png_(self) -> bytes:
            picture = io.BytesIO()
            FigureCanvasAgg(self).print_png(picture)  # As `savefig`, without drawing the figure twice.
            return picture.getvalue()

    figure = NotebookFigure(figsize=(9.0, 0.6 + 1.75 * rows), dpi=_RESOLUTION, layout="constrained")
    figure.subplots(rows, 1, sharex=True)
    return figure


def _panels(motion: Motion, limits: JointLimits, run: Run | None) -> list[_Panel]:
    return [
        _Panel(
            condition,
            planned_differences(motion.q, condition.order),
            *_bounds(condition, limits, motion),
            None if run is None else recorded_curves(run.t, run.q, run.q_c, run.dq, QUANTITIES[condition.order]).values,
        )
        for condition in JOINT_CONDITIONS
    ]


def _bounds(condition: Condition, limits: JointLimits, motion: Motion) -> Bounds:
    if condition.bounds_at is None or not condition.depends_on_angles(limits):
        return condition.bounds(limits)
    before = plan_curves(motion, "dq").q
    assert before is not None  # Only bounds of velocities depend on the angles.
    return condition.bounds_at(limits, before)


def _draw_panel(ax: Axes, panel: _Panel, run: Run | None, joints: Sequence[int], text: Text) -> None:
    times: Array = CYCLE_TIME * np.arange(len(panel.values), dtype=np.float64)
    planned: dict[str, Any] = {"linewidth": 1.3}
    if run is not None and panel.actual is not None:
        planned = {"linestyle": (0, (4, 2)), "linewidth": 1.0, "zorder": 3.0}
        for joint in joints:
            ax.plot(_plan_times(run), panel.actual[:, joint], color=_color(joint), linewidth=3.0, alpha=0.45)
    for joint in joints:
        label = text("check.joint", joint=joint + 1)
        ax.plot(times, panel.values[:, joint], color=_color(joint), label=label, **planned)
    ax.set_ylabel(f"{QUANTITIES[panel.condition.order]} [{panel.condition.unit.replace('^2', '²').replace('^3', '³')}]")
    ax.margins(x=0.0)
    ax.grid(visible=True, color="#E0E0E0", linewidth=0.6)
    lower, upper = panel.lower[..., list(joints)], panel.upper[..., list(joints)]
    _draw_limits(ax, times, lower, upper, everything=panel.condition.order > 0)


def _draw_limits(ax: Axes, times: Array, lower: Array, upper: Array, *, everything: bool) -> None:
    """Shades the area beyond each limit.

    Args:
        ax: Axes to draw into.
        times: Times of bounds that depend on the angles, shape (N,), [s].
        lower: Lower bounds of the drawn joints, shape (k,) or (N, k).
        upper: Upper bounds of the drawn joints.
        everything: Whether the panel shows all limits; otherwise it fits the angles, because a wrist that may turn by
            360 degrees would flatten every other curve.
    """
    low, high = ax.get_ylim()
    if everything:
        low, high = min(low, _HEADROOM * float(lower.min())), max(high, _HEADROOM * float(upper.max()))
    beyond: dict[str, Any] = {"color": BEYOND_LIMIT_COLOR, "alpha": 0.16, "linewidth": 0.0, "zorder": 0.5}
    edge: dict[str, Any] = {"color": BEYOND_LIMIT_COLOR, "linewidth": 0.8, "linestyle": (0, (1, 1.5)), "zorder": 0.6}
    if upper.ndim == 2:
        for side, end in ((upper, high), (lower, low)):
            for bound in side.T:
                ax.fill_between(times, bound, end, **beyond)
                ax.plot(times, bound, **edge)
        ax.set_ylim(low, high)
        return
    for bound in np.unique(upper[upper < high]):
        ax.axhspan(bound, high, **beyond)
        ax.axhline(bound, **edge)
    for bound in np.unique(lower[lower > low]):
        ax.axhspan(low, bound, **beyond)
        ax.axhline(bound, **edge)
    ax.set_ylim(low, high)


def _shade_violations(ax: Axes, panel: _Panel, violations: Sequence[Violation], joints: Sequence[int]) -> None:
    """Hatches the time in which a joint violates its bound, and marks the worst sample of each violation."""
    broken = [v for v in violations if v.condition.id == panel.condition.id and v.joint - 1 in joints]
    for begin, end in _union((v.time - CYCLE_TIME, v.time + (v.count - 1) * CYCLE_TIME) for v in broken):
        ax.axvspan(begin, end, facecolor=VIOLATION_COLOR, edgecolor=VIOLATION_COLOR, alpha=0.2, hatch="///", zorder=0.7)
    worst: dict[str, Any] = {"color": VIOLATION_COLOR, "markersize": 5, "markeredgewidth": 1.5, "linestyle": "none"}
    ax.plot([v.worst_time for v in broken], [v.value for v in broken], "x", **worst)


def _union(spans: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Returns the union of time spans, without overlaps; a difference belongs to the cycle before it."""
    merged: list[tuple[float, float]] = []
    for begin, end in sorted(spans):
        if merged and begin <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((begin, end))
    return merged


def _plan_times(run: Run) -> Array:
    """Returns the times of the plan for the rows of a run, shape (N,), [s]: without the play-out delay."""
    return run.t - run.delay * CYCLE_TIME


def _motion_and_run(motion: object, run: object) -> tuple[Motion, Run | None]:
    """Returns the motion to draw, and its run.

    Raises:
        InvalidValueError: An argument has another type.
    """
    if isinstance(motion, Run):
        return motion.plan or motion.commanded(), motion
    if run is not None and not isinstance(run, Run):
        raise InvalidValueError("run", run, "is not a run; execute returns one")
    return require_motion(motion), run


def _draw_error(ax: Axes, run: Run, joints: Sequence[int], text: Text) -> None:
    error = 1e3 * run.error
    for joint in joints:
        ax.plot(_plan_times(run), error[:, joint], color=_color(joint), linewidth=1.0)
    ax.set_ylabel(text("figure.error"))
    ax.margins(x=0.0)
    ax.grid(visible=True, color="#E0E0E0", linewidth=0.6)


def _color(joint: int) -> str:
    return JOINT_COLORS[joint % len(JOINT_COLORS)]


def _title(model: RobotModel, motion: Motion, report: Report, text: Text) -> str:
    # A jump shows in one first, two second and three third differences: within HOLD_SAMPLES cycles it counts once.
    reach = HOLD_SAMPLES * CYCLE_TIME
    count = len(_union((v.time - CYCLE_TIME, v.time + v.count * CYCLE_TIME + reach) for v in report.violations))
    if not count and report.warnings:
        ids = ", ".join(dict.fromkeys(warning.condition.id for warning in report.warnings))
        return text("figure.advised", model=model.name, duration=f"{motion.duration:.3f}", ids=ids)
    code = "figure.inside" if not count else "figure.beyond_one" if count == 1 else "figure.beyond"
    return text(code, model=model.name, duration=f"{motion.duration:.3f}", count=count)


def _joint_indices(joints: Sequence[int] | None, n: int) -> list[int]:
    if joints is None:
        return list(range(n))
    if not isinstance(joints, Iterable):
        raise InvalidValueError("joints", joints, f"must be a list of numbers from 1 to {n}, such as [{n}]")
    joints = list(joints)
    numbers = as_vector(joints, len(joints), "joints").tolist()
    if not numbers or any(number not in range(1, n + 1) for number in numbers):
        raise InvalidValueError("joints", list(joints), f"must be numbers from 1 to {n}")
    return [int(number) - 1 for number in numbers]
