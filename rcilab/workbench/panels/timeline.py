"""Timeline: the planned motion over time, with playback and scrubber, above its plots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.check.freshness import outdated
from rcilab.app.program.program_draft import describe_place
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.played_motion import played_at, scaled_motion_of
from rcilab.app.run.readiness import connection_note, is_plan_current, time_shown
from rcilab.app.run.replay_actions import CloseRun
from rcilab.app.text import Text
from rcilab.app.view_actions import PLOTS, RATES, Play, Seek, SetView, ShowPlot, has_plot
from rcilab.core.clock import CYCLE_TIME
from rcilab.workbench.panels.outcome import replay_html
from rcilab.workbench.panels.plots import Plots
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_BANNER, _BACK = 72, 40  # [px] Height of the line about a recorded run, and of the button below it.


class TimelinePanel:
    """Play, scrub, loop, and the plots with their common time axis and cursor."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._plots = Plots(text)

    @property
    def end(self) -> float:
        """End of the time axis, [s]."""
        return self._plots.end

    @property
    def marks(self) -> list[dict[str, Any]]:
        """Marks on the time axis, for the page's script."""
        return self._plots.marks

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls and empty plots."""
        text, ask = self._text, self._ask
        gui.add_html('<i class="rl-strip"></i>')
        self._play = gui.add_button(text("timeline.play"), icon="player-play", hint=text("timeline.play_hint"))
        on_press(self._play, ask, lambda page: Play(page=page))
        scrub = gui.add_slider(text("timeline.time"), 0.0, 100.0, 0.1, 0.0, marks=(), hint=text("timeline.scrub_hint"))
        self._scrub = BoundControl(scrub, ask, lambda v, p: Seek(page=p, playhead=v / 100.0))
        rates = {f"{rate:g}×": rate for rate in RATES}
        self._rates = {rate: label for label, rate in rates.items()}
        rate = gui.add_dropdown(text("timeline.rate"), tuple(rates), initial_value="1×")
        self._rate = BoundControl(rate, ask, lambda v, p: SetView(page=p, name="rate", value=rates.get(v, 1.0)))
        joints = {text("timeline.all"): 0, **{f"J{j + 1}": j + 1 for j in range(state.model.n)}}
        self._joints = {joint: label for label, joint in joints.items()}
        choice = gui.add_dropdown(text("timeline.joint"), tuple(joints), hint=text("timeline.joint_hint"))
        self._joint = BoundControl(choice, ask, lambda v, p: SetView(page=p, name="plot_joint", value=joints.get(v, 0)))
        with gui.add_folder(text("timeline.show"), expand_by_default=False):
            self._build_choices(gui, state)
        self._banner = Html(gui)
        self._back = gui.add_button(text("replay.back"), icon="arrow-back-up", visible=False)
        on_press(self._back, ask, lambda page: CloseRun(page=page))
        self._readout = Html(gui)
        self._plots.build(gui, state)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Moves the scrubber; redraws plots when plan, recording or choice have changed."""
        text, banner = self._text, replay_html(state, status, self._text) or _demo_html(state, self._text)
        self._banner.show(banner)
        self._back.visible = state.replay is not None
        self._play.label = text("timeline.hold" if state.playing else "timeline.play")
        self._play.disabled = state.plan is None
        duration = 0.0 if state.plan is None else state.plan.motion.duration
        self._scrub.show(round(100.0 * min(time_shown(state, status) / max(duration, CYCLE_TIME), 1.0), 1))
        self._scrub.handle.disabled = state.plan is None
        self._rate.show(self._rates[state.rate])
        self._joint.show(self._joints[state.plot_joint])
        self._loop.show(state.loop)
        for name, box in self._choices.items():
            box.show(name in state.plots)
        self._readout.show(self._read(state, status))
        self._plots.show(state, (_BANNER if banner else 0) + (_BACK if state.replay is not None else 0))

    def _build_choices(self, gui: Any, state: UiState) -> None:
        text, ask = self._text, self._ask
        gui.add_html('<i class="rl-choices"></i>')
        self._choices: dict[str, BoundControl] = {}
        for name in PLOTS:
            if has_plot(state.model, name):
                box = gui.add_checkbox(text(f"plot.{name}"), name in state.plots)
                self._choices[name] = BoundControl(box, ask, _choice(name))
        loop = gui.add_checkbox(text("timeline.loop"), state.loop, hint=text("program.loop_hint"))
        self._loop = BoundControl(loop, ask, lambda v, p: SetView(page=p, name="loop", value=bool(v)))

    def _read(self, state: UiState, status: SupervisorStatus) -> str:
        """Returns the place of the preview, and the labels of the plots."""
        text = self._text
        if state.plan is None:
            why = state.no_plan
            if status.code == "moving.guided" or (state.jog.robot and is_moving(status)):
                sentence = text("timeline.by_hand")
            elif state.watched:
                sentence = text("timeline.watched")
            elif why is None or why.code == "plan.here":
                lost = None if is_plan_current(state, status) else connection_note(state, status)
                hint = "timeline.jog" if state.jog.robot else "timeline.nothing"
                sentence = text(hint) if lost is None else text.render(lost)
            else:
                sentence = text.render(why)
            return f'<p class="rl-note rl-welcome">{esc(sentence)}</p>'
        duration = state.plan.motion.duration
        t, kinds = min(time_shown(state, status), duration), text("timeline.plan_only")
        if state.recording is not None:
            run = state.recording.run
            wanted = "_commanded" if run is not None and run.plan is None else ""
            kinds = text(f"timeline.kinds{wanted}", delay=state.recording.delay)
            if status.q is None:
                kinds = text(f"timeline.replayed{wanted}")
        where = describe_place(state.plan, t)
        kinds = kinds if where is None else text.render(where)
        if state.plan.missed_by is not None and state.recording is None:
            kinds = text("timeline.short")
        kinds = kinds if state.learn.show is not None or outdated(state) is None else f"▲ {text('check.outdated')}"
        scaled_motion = scaled_motion_of(state)
        if scaled_motion is not None:  # On the time axis of the plots: that of the run.
            t, duration = played_at(state, t), scaled_motion.duration
        return f'<p class="rl-clock"><b>{t:.3f}</b> /&nbsp;{duration:.3f}&nbsp;s<span>{esc(kinds)}</span></p>'


def _choice(name: str):  # type: ignore[no-untyped-def]
    return lambda value, page: ShowPlot(page=page, name=name, on=bool(value))


def _demo_html(state: UiState, text: Text) -> str:
    """Returns the message that the curves are those of a provoked fault, if one is displayed; else ""."""
    if state.learn.show is None:
        return ""
    sentence = f"<b>{esc(text('timeline.demo'))}</b> {esc(text('timeline.demo_long'))}"
    return f'<p class="rl-verdict rl-warn">{sentence}</p>'
