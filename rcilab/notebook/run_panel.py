"""Run: the robot, power, mode, Execute and Stop, the timing, and how a motion ended."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import fields
from itertools import zip_longest
from typing import Any

import ipywidgets

from rcilab.app.app_state import AppState
from rcilab.app.arm_features import explain_missing_feature, is_only_planned
from rcilab.app.connection import Robot
from rcilab.app.robot_connection import RobotConnection
from rcilab.app.run.drive_state import parameter_obstacle
from rcilab.app.run.mode_actions import ModeActions
from rcilab.app.run.plan_readiness import arm_obstacle, ask_to_move, plan_obstacle
from rcilab.app.run.robot_requests import Outcome, RobotRequests
from rcilab.app.run.world_actions import WorldActions
from rcilab.app.session_connection import SessionConnection
from rcilab.app.status_text import FAILED_STARTS, StartingError
from rcilab.control_process import PendingRequest, SupervisorStatus
from rcilab.control_process.supervisor import VIRTUAL
from rcilab.core.errors import SAFETY_STOP, PlanningError, RcilabError
from rcilab.i18n.translator import Message, message
from rcilab.makers.driver import parse_address
from rcilab.makers.maker import capabilities_of, require_driver
from rcilab.notebook.browser_heartbeat import kernel_heartbeat
from rcilab.notebook.browser_watchdog import PAGE_GONE
from rcilab.notebook.limit_fields import LimitFields
from rcilab.notebook.mode_fields import ModeFields
from rcilab.notebook.part import Part
from rcilab.notebook.signal_fields import SignalFields
from rcilab.notebook.speed_fields import SpeedFields
from rcilab.notebook.state import LabState
from rcilab.notebook.status_texts import describe_refusal, describe_trouble, health_html, name_phase, outcome_html
from rcilab.notebook.style import PHASE_TONES, block, problem, soft, verdict, write
from rcilab.notebook.subshell_routing import handle_during_cells
from rcilab.notebook.widget_sharing import shared_style_widget
from rcilab.recording.run import Run

_POLL_INTERVAL = 0.1  # [s] Between two reads of the robot's status.
_SHOWN = tuple(field.name for field in fields(AppState) if field.name != "goal")
_TARGETS = ("ideal", "mujoco", "address")


class _Connection:
    """The connection to the robot of a lab, with the interface that the application uses.

    Args:
        state: State of the lab.
    """

    def __init__(self, state: LabState) -> None:
        self._state = state

    def status(self) -> SupervisorStatus:
        """Returns the robot's status; "closed" without a connection."""
        return self._state.status or SupervisorStatus()

    def robot(self) -> Robot:
        """Returns the object that takes requests.

        Raises:
            StartingError: No robot is connected.
        """
        robot = self._state.robot
        if robot is None:
            raise StartingError("no robot is connected")
        return robot.robot()

    def take_run(self) -> Run | None:
        """Returns the last run of `execute` if the robot recorded it itself."""
        return None if self._state.robot is None else self._state.robot.take_run()


class RunPanel(Part):
    """All controls that move a robot; a robot is moved by buttons only, not by sliders.

    With a model it connects to its own virtual controller, or to an address; a control process outside of the kernel
    runs the 1 kHz loop. With a session it uses that one. Modes and parameters are those of the page. A robot that is
    not virtual is moved, or gets other parameters, only after a confirmation. A motion is stopped when the page is
    closed, when the kernel is interrupted, restarted or dead, or when the cell runs again.

    Args:
        subject: A model, a session, or another part of the same arm.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
    """

    def __init__(self, subject: object, *, language: str | None = None) -> None:
        super().__init__(subject, language)
        text = self.text
        self._heartbeat = kernel_heartbeat()
        self._ending = threading.Event()
        self._watcher: threading.Thread | None = None
        self.target = shared_style_widget(
            ipywidgets.Dropdown, description=text("run.robot"),
            options=[(text(f"robot.{name}"), name) for name in _TARGETS],
            layout={"width": "24em"},
        )  # fmt: skip
        self.address = shared_style_widget(
            ipywidgets.Text, description=text("run.address"), placeholder=text("run.address_example"),
            tooltip=text("run.address_hint"),
            layout=ipywidgets.Layout(width="24em", display="none"),
        )  # fmt: skip
        self.connect = self._button("run.connect", self._on_connect, icon="plug", own=True)
        self.disconnect = self._button("run.disconnect", self._on_disconnect, own=True)
        self.power_on = self._button(
            "run.power_on", lambda: self._send("power_on", lambda robot: robot.power_on()), icon="power-off"
        )
        self.power_off = self._button("run.power_off", lambda: self._send("power_off", lambda robot: robot.power_off()))
        self.recover = self._button("run.recover", self._on_recover)
        self.execute = self._button("run.execute", self._on_execute, icon="play", style="success")
        self.stop = self._button("run.stop", self.halt, icon="stop", style="danger")
        self.stop.add_class("rl-stop")
        handle_during_cells(self.stop)
        self.yes = self._button("run.confirm", self._move, style="danger")
        self.no = self._button("run.cancel", self._forget_question)
        self.progress = shared_style_widget(
            ipywidgets.FloatProgress, min=0.0, max=1.0, layout=ipywidgets.Layout(width="100%", visibility="hidden")
        )
        self._sentence, self._note, self._plan, self._question = block(), block(), block(), block()
        self._health, self._outcome = block(), block()
        self._was_cell_motion = False
        self._running = 0.0  # [s] Planned duration of the motion in progress.
        connection = _Connection(self.state)
        self._requests = RobotRequests(self.state.store, connection)
        self._world = WorldActions(self.state.store, connection)
        self._mode_actions = ModeActions(self.state.store, connection, keeps_rest=self.state.session is not None)
        self.speed_override = SpeedFields(self.state, text, self._mode_actions)
        self.modes = ModeFields(self.state, text, self._mode_actions)
        self.signals = SignalFields(self.model, text, self._send, self._button)
        self.limits = LimitFields(self.state, text, self._world, self._send, self._button)
        self._answers = shared_style_widget(
            ipywidgets.HBox, [self.yes, self.no], layout=ipywidgets.Layout(display="none")
        )
        self._choice = shared_style_widget(ipywidgets.VBox, [self.target, self.address], layout=ipywidgets.Layout())
        has_power, power = capabilities_of(self.model).switches_power, (self.power_on, self.power_off)
        self.build([
            self._choice,
            shared_style_widget(ipywidgets.HBox, [self.connect, self.disconnect]),
            self._sentence,
            self._note,
            shared_style_widget(ipywidgets.HBox, [*(power if has_power else ()), self.recover]),
            self.modes.choice,
            self._plan,
            shared_style_widget(ipywidgets.HBox, [self.execute, *self.speed_override.buttons, self.stop]),
            *self.speed_override.fields,
            self._question,
            self._answers,
            self.progress,
            self._outcome,
            self.modes.parameters,
            self.limits.folder,
            self.signals.folder,
            self._health,
        ], min_width="360px")  # fmt: skip
        self.target.observe(lambda _: self._show(), names="value")
        if self.state.session is not None:
            self._take(SessionConnection(self.state.session))
        self._shown: tuple[object, ...] = ()  # The values of `_SHOWN`, and the outcome, at the last change of the goal.
        self._cleanups.append(self.state.subscribe("plan", self._on_plan))
        self._cleanups.append(self.state.subscribe("goal", self._follow_goal))
        self.subscribe("robot", self._show)

    def halt(self) -> None:
        """Stops the robot; from any thread, without waiting."""
        self.state.halt()

    def end(self) -> None:
        """Stops a motion and ends the processes that were started here."""
        self._release()

    def _send(self, what: str, ask: Callable[[Robot], PendingRequest]) -> None:
        robot = self.state.robot
        assert robot is not None  # Without one, the buttons are disabled.
        with self.state.lock:
            self._requests.add(what, ask(robot.robot()))

    def _on_recover(self) -> None:
        """Clears the faults; reconnects a lost connection."""
        robot, status = self.state.robot, self.state.status
        if isinstance(robot, RobotConnection) and status is not None and status.phase in ("lost", "crashed"):
            self._requests.add("recover", robot.robot().reconnect())
        else:
            self._send("recover", lambda robot: robot.recover())

    def _on_connect(self) -> None:
        choice = str(self.target.value)
        typed = self.address.value.strip()
        if choice == "address" and not typed:
            write(self._sentence, problem(self.text("run.address_needed")))
            return
        target, plant = (typed, "ideal") if choice == "address" else (VIRTUAL, choice)
        self._release()
        require_driver(self.model)
        robot = RobotConnection(self._on_failure)
        robot.open(self.model, target if target == VIRTUAL else str(parse_address(target, self.model)), plant)
        self.state.store.update(plant=plant)
        self._take(robot)
        self.state.notify("robot")

    def _on_failure(self, error: RcilabError) -> None:
        """Shows why there is no connection; called in the connecting thread."""
        self._show_outcome(Outcome(what="connect", error=error))

    def _on_disconnect(self) -> None:
        self._release()
        self.state.notify("robot")

    def _take(self, robot: RobotConnection | SessionConnection) -> None:
        is_virtual = robot.is_virtual if isinstance(robot, SessionConnection) else robot.name == VIRTUAL
        with self.state.lock:
            self._mode_actions.forget()
            self.state.store.update(target=VIRTUAL if is_virtual else robot.name)
            self.state.set_drive(refusal=None)
        self.state.robot = robot
        self._ending.clear()
        self._watcher = threading.Thread(target=self._watch, args=(robot,), name="rcilab-notebook-watch", daemon=True)
        self._watcher.start()

    def _release(self) -> None:
        self._ending.set()
        watcher, self._watcher = self._watcher, None
        if watcher is not None and watcher is not threading.current_thread():
            watcher.join()
        robot, self.state.robot = self.state.robot, None
        if robot is not None:
            last = robot.status().q_c
            if last is not None:
                self.state.store_position(last)
            self._world.close()
            self._requests.forget()
            robot.close()
            self.state.free_joints()

    def _watch(self, robot: RobotConnection | SessionConnection) -> None:
        """Shows the robot's status, forwards the page's heartbeat, and stops the robot when the page is closed."""
        while not self._ending.wait(_POLL_INTERVAL):
            self._heartbeat.beat()
            if self._heartbeat.is_gone:
                if isinstance(robot, SessionConnection):
                    robot.stop(PAGE_GONE)
                else:
                    robot.stop()
            elif self._heartbeat.was_seen:
                robot.heartbeat()
            with self.state.lock:
                outcomes = self._requests.collect()
            if isinstance(robot, SessionConnection):
                outcomes += [Outcome(what="cell", run=run, error=error) for run, error in robot.take_cell_runs()]
            for outcome in outcomes:
                self._show_outcome(outcome)
            self._follow_world(robot.status())
            with self.state.lock:
                self._mode_actions.tick(robot.status())
            self.state.notify("robot")

    def _follow_world(self, status: SupervisorStatus) -> None:
        with self.state.lock:
            before = self.state.now.notice
            self._world.tick(status)
            notice = self.state.now.notice
        if notice is not None and notice is not before:
            write(self._outcome, problem(self.text.render(notice.text)))

    def _show_outcome(self, outcome: Outcome) -> None:
        if outcome.what == "limits":
            self.limits.take(outcome.error)
        if outcome.what in ("execute", "cell"):
            self.state.take(outcome)
        sentence = outcome_html(outcome, self.state.status, self.text, is_page_gone=self._heartbeat.is_gone)
        if outcome.what == "cell":
            sentence += soft(self.text("run.of_cell"))
        write(self._outcome, sentence)

    def _on_plan(self) -> None:
        self._forget_question()
        self._show()

    def _on_execute(self) -> None:
        reason, plan = _obstacle(self.state), self.state.now.plan
        if reason is not None:
            write(self._sentence, problem(self.text.render(reason)))
            return
        if self.state.now.is_virtual:
            self._move()
            return
        assert plan is not None  # Without one, there is an obstacle.
        question = ask_to_move(plan, self.state.now.target)
        write(self._question, verdict("warn", "▲", self.text.render(question)))
        self._answers.layout.display = None

    def _move(self) -> None:
        self._forget_question()
        reason, plan = _obstacle(self.state), self.state.now.plan
        if reason is None and plan is not None:
            self.state.display(None)
            self.state.look_at(None)
            self.state.outcome = None
            write(self._outcome, "")
            self._running = plan.motion.duration
            try:
                with self.state.lock:
                    self._requests.execute(plan)
            except PlanningError as error:
                write(
                    self._outcome,
                    problem(self.text.render(describe_refusal(error, self.state.status))),
                )

    def _forget_question(self) -> None:
        write(self._question, "")
        self._answers.layout.display = "none"

    def _follow_goal(self) -> None:
        """Shows what a change of the goal has changed here: often nothing, as with every step of a slider."""
        now, outcome = self.state.now, self.state.outcome
        shown = (outcome, *(getattr(now, name) for name in _SHOWN))
        if any(new is not old for new, old in zip_longest(shown, self._shown)):
            self._shown = shown
            self._show()

    def _show(self) -> None:
        state, text = self.state, self.text
        status = state.status
        phase = "closed" if status is None else status.phase
        is_moving = phase in ("moving", "stopping")
        self._choice.layout.display = "none" if status is not None else None
        self.address.layout.display = None if self.target.value == "address" else "none"
        self.connect.layout.display = "none" if status is not None else None
        is_own = isinstance(state.robot, RobotConnection)
        self.disconnect.layout.display = None if is_own else "none"
        reason = _obstacle(state)
        self.connect.disabled = self.target.disabled = is_only_planned(state.model)
        self.execute.disabled = reason is not None
        powered = None if status is None else status.powered
        is_pressed = status is not None and status.is_pressed
        is_ready = phase in ("idle", "fault")
        self.power_on.disabled = not is_ready or powered is not False or is_pressed
        self.power_off.disabled = not is_ready or powered is not True
        is_held = is_pressed and not capabilities_of(state.model).stop_is_error
        is_failed = status is not None and status.code in FAILED_STARTS
        self.recover.disabled = phase not in ("fault", "lost", "crashed") or is_held or is_failed
        name = (
            ""
            if state.robot is None
            else text("run.at", name=text("run.virtual") if state.robot.name == VIRTUAL else state.robot.name)
        )
        tone = PHASE_TONES.get(phase, "none" if status is None else "bad")
        write(self._sentence, verdict(tone, name_phase(status, text), name))
        trouble = describe_trouble(status, text) or ("" if reason is None else text.render(reason))
        is_cell_motion = isinstance(state.robot, SessionConnection) and state.robot.is_cells
        if is_cell_motion and not self._was_cell_motion:
            write(self._outcome, "")
        self._was_cell_motion = is_cell_motion
        if is_cell_motion:
            write(
                self._note,
                problem(text("run.kernel_busy")) if self._heartbeat.is_kernel_busy else soft(text("run.by_cell")),
            )
        else:
            write(self._note, "" if is_moving or not trouble else soft(trouble))
        plan = state.now.plan
        if plan is None:
            write(self._plan, "")
        else:
            tone, word = ("good", "check.passed") if plan.report.ok else ("bad", "check.failed")
            write(self._plan, verdict(tone, text(word), text("plan.ready", duration=f"{plan.motion.duration:.3f}")))
        self._show_progress(status, is_moving)
        self.speed_override.show(status)
        self.modes.show(status)
        self.limits.show(status)
        self.signals.show(status)
        write(self._health, "" if status is None else health_html(status, text))

    def _show_progress(self, status: SupervisorStatus | None, is_moving: bool) -> None:
        place = None if status is None or not is_moving else status.motion_plan_time
        robot = self.state.robot
        whole = robot.planned if isinstance(robot, SessionConnection) else self._running
        self.progress.layout.visibility = "hidden" if place is None or not whole else "visible"
        if place is not None and whole:
            self.progress.value = min(max(place / whole, 0.0), 1.0)

    def _button(
        self, code: str, act: Callable[[], object], *, icon: str = "", style: str = "", own: bool = False
    ) -> Any:
        hint = f"{code}_hint"
        button = shared_style_widget(
            ipywidgets.Button,
            description=self.text(code),
            tooltip=self.text(hint) if self.text.has(hint) else self.text(code),
            icon=icon,
            button_style=style,
            layout=ipywidgets.Layout(width="auto") if own else {"width": "auto"},
        )

        def press(_: object) -> None:
            try:
                act()
            except RcilabError as error:
                write(self._outcome, problem(self.text.render(describe_refusal(error, self.state.status))))

        button.on_click(press)
        return button


def _obstacle(state: LabState) -> Message | None:
    """Returns what prevents Execute, or None if it may be pressed."""
    status = state.status
    missing = explain_missing_feature(
        state.model, "simulation" if is_only_planned(state.model) else state.now.drive.mode
    )
    if missing is not None:
        return missing
    if status is None:
        return message("ready.closed")
    if status.phase == "closed" and state.session is not None:
        return message("ready.session_closed")
    error = None if state.outcome is None else state.outcome.error
    was_stop = status.phase == "fault" and error is not None and error.code == SAFETY_STOP
    is_released = status.code == "fault.released" or was_stop
    resting = arm_obstacle(status.phase, status.powered, is_pressed=status.is_pressed, is_released=is_released)
    if resting is not None or state.now.plan is None:
        return resting or plan_obstacle(None, status.q_c)
    return parameter_obstacle(state.now, status) or plan_obstacle(state.now.plan, status.q_c)
