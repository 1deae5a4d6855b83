"""A page that watches a virtual controller which a foreign client drives: real sockets, real shared memory."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rcilab.app.check.freshness import outdated
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import GoalActions, MoveJoint, PlanGoal
from rcilab.app.request import TypeField
from rcilab.app.run.readiness import obstacle
from rcilab.app.run.replay import replayed
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.run.watch_actions import WatchActions, draw_plan
from rcilab.app.run.watched_controller import WatchedController
from rcilab.app.run.world_state import WorldState
from rcilab.app.setup.configuration_state import pending_parts
from rcilab.app.setup.setup_actions import SetupActions
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.app.view_actions import PLOTS
from rcilab.core.errors import ConnectionLostError, InvalidValueError, ProtocolError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotMode
from rcilab.execution.simulation_control import SimulationControl, parse_simulation_port
from rcilab.model.dynamics.payload import Payload
from rcilab.motion import Motion
from rcilab.recording.client_motions import ClientMotions, MotionPart
from rcilab.sim.api import NetworkFaults, WorldStatus, decode_world_answer, encode_world_answer
from rcilab.workbench.app import Workbench, WorkbenchConfig
from rcilab.workbench.panels.health import health_html
from rcilab.workbench.panels.outcome import outcome_html
from rcilab.workbench.panels.plots import Plots
from rcilab.workbench.panels.setup import SetupPanel
from tests.peers import programs, wire
from tests.peers.arena import Arena, arena
from tests.peers.robot import ControlException
from tests.sim.test_cycle_capture import Bench
from tests.waiting import wait_for

NEAR = tuple(angle + 0.02 for angle in programs.START[7])  # [rad]
SECONDS = 1.0  # [s]


@pytest.fixture(scope="module")
def place() -> Iterator[Arena]:
    with arena(is_recorded=True, world_port=0) as found:
        yield found


@pytest.fixture
def watching(place: Arena) -> Iterator[tuple[Store, WatchActions, WatchedController]]:
    assert place.server.world_address is not None
    controller = WatchedController(place.server.world_address)
    model = controller.model
    store = Store(UiState(model=model, goal=goal_at(model, model.home), watched=controller.name))
    yield store, WatchActions(store, controller), controller
    controller.close()


def test_the_status_is_that_of_the_newest_cycle(place: Arena, watching) -> None:
    _, _, controller = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        last = robot.receive_fresh_state()
        wait_for(lambda: controller.status().phase == "idle")
        status = controller.status()
    assert status.q is not None
    assert status.q.tolist() == list(last.q[:7])
    assert (status.robot_mode, status.powered, status.faults) == (RobotMode.IDLE, True, ())
    assert status.world_address == place.server.world_address


def test_the_commands_of_a_client_become_plan_and_recording(place: Arena, watching) -> None:
    store, actions, _ = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        programs.line(robot, SECONDS, period=SECONDS)

        def has_ended() -> bool:
            actions.tick()
            return any(notice.text.code == "watch.ended" for notice in store.state.notices) and (
                store.state.recording is not None
                and store.state.recording.run is not None
                and store.state.recording.run.setup.mode == "cartesian_position"
                and store.state.recording.run.stopped is None
            )

        wait_for(has_ended)
    state = store.state
    assert state.plan is not None
    assert state.recording is not None
    run = state.recording.run
    assert run is not None
    assert len(run.cycles) >= SECONDS / 1e-3
    assert state.plan.report.ok
    half = len(run.cycles) // 2
    np.testing.assert_allclose(state.plan.motion.q[:half], run.q_c[1 : half + 1], rtol=0, atol=1e-9)
    assert state.goal.q.tolist() == run.q_c[-1].tolist()


def test_a_motion_in_progress_is_drawn_without_a_violation_at_its_end(place: Arena, watching) -> None:
    """Cut off at every speed, as a page sees it."""
    store, actions, _ = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        actions.tick()
        programs.line(robot, SECONDS, period=SECONDS)
        wait_for(lambda: (actions.tick(), store.state.recording is not None)[1])
    run = store.state.recording.run
    for count in range(10, len(run.cycles) - 20, 97):
        cut = dataclasses.replace(run, cycles=run.cycles[:count])
        plan = draw_plan(cut, run.model)
        assert plan.report.ok, count
        assert len(plan.report.usage().ratio) == len(plan.motion.q)  # The scene colours the path by it.


def test_commands_that_come_late_are_drawn_as_they_are_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """While the motion is in progress and after its end; a burst at its start answers old states."""
    monkeypatch.setattr("rcilab.app.run.watch_actions._PERIOD", -1.0)
    bench = Bench()
    bench.end()  # A page and a recorder read the next motion.
    controller = WatchedController(lie(status(record=bench.ring.descriptor)))
    recorder = ClientMotions(bench.ring)
    store = Store(UiState(model=controller.model, goal=goal_at(controller.model, controller.model.home)))
    actions, parts = WatchActions(store, controller), list[MotionPart]()

    def advance(count: int) -> list[int]:
        """The page looks at every cycle; returns the numbers of their states."""
        numbers: list[int] = []
        for _ in range(count):
            numbers.append(bench.number)
            bench.cycles(1)
            actions.tick()
        parts.extend(recorder.poll())
        return numbers

    bench.start()
    for count in (30, *(1,) * 400, 65, *(1,) * 300):
        for number in advance(count):
            bench.send(number)
        assert store.state.plan is None or store.state.plan.motion.notes == ()
    bench.end()
    actions.tick()
    parts.extend(recorder.poll())
    controller.close()
    bench.ring.close()
    assert parts[-1].end is not None
    shown = store.state.recording
    assert shown is not None
    assert shown.run is not None
    assert shown.run.timing.late == parts[-1].end.late > 10
    assert shown.run.cycles.tobytes() == np.concatenate([part.cycles for part in parts]).tobytes()


def shown_violations(state: UiState) -> set[str]:
    """The curves in which the page marks a violation."""
    plots = Plots(Text("en"))
    return {
        name
        for name in ("dq", "ddq", "jerk", "tau")
        if plots._joint_frame(state, name, 1.0).violated.any()  # As `show` draws them, without a browser.
    }


@pytest.mark.parametrize("first", [0, 400], ids=["whole", "its newest part"])
@pytest.mark.parametrize("mode", [wire.JOINT_POSITION, wire.JOINT_IMPEDANCE, wire.TORQUE])
def test_no_curve_of_a_motion_has_a_violation_at_an_end_that_moves(
    place: Arena, watching, mode: int, first: int
) -> None:
    """In progress, and ended while it moves; also of a long motion, of which a page draws the newest part."""
    store, actions, _ = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        wait_for(lambda: (actions.tick(), any(n.text.code == "watch.ended" for n in store.state.notices))[1])
        if mode == wire.TORQUE:
            programs.torque(robot, 1.0, period=2.0)
        else:
            programs.joint_sine(robot, 0.75, mode=mode, amplitude=0.02, period=1.0)  # It ends in full motion.
        ends = ("watch.ended", "watch.stopped")
        wait_for(lambda: (actions.tick(), sum(n.text.code in ends for n in store.state.notices) > 1)[1])
    recording = store.state.recording
    assert recording is not None
    run, model = recording.run, store.state.model
    assert run is not None
    for count in (500, 700, len(run.cycles)):
        rows = run.cycles[first:count].copy()
        rows["t"] -= rows["t"][0]
        cut = dataclasses.replace(run, cycles=rows, truncated=bool(first))
        plan = draw_plan(cut, model)
        shown = dataclasses.replace(store.state, plan=plan, recording=whole_recording(cut))
        assert shown_violations(shown) == set(), count
        assert plan.report.ok or count == len(run.cycles), str(plan.report)
    assert shown_violations(replayed(store.state, run)) == set()


def test_a_refused_command_is_drawn_and_reported(place: Arena, watching) -> None:
    store, actions, controller = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        with pytest.raises(ControlException):
            programs.joint_sine(robot, SECONDS, period=0.05)
        wait_for(lambda: (actions.tick(), any(n.text.code == "watch.stopped_more" for n in store.state.notices))[1])
        assert controller.status().phase == "fault"
        shown = dataclasses.replace(store.state, target=controller.name)  # As the workbench has it.
        outcome = outcome_html(shown, controller.status(), Text("en"))
        assert "Ended by a fault" in outcome
        assert re.search(r"Joint acceleration, joint \d: \S+ passes ", outcome)  # The joint, its value and the bound.
        in_progress = dataclasses.replace(shown, last_run=None)
        assert outcome_html(in_progress, controller.status(), Text("en")) == ""
        robot.automatic_error_recovery()
    assert store.state.plan is not None
    assert not store.state.plan.report.ok


def test_health_counts_a_motion_as_notice_and_log_do() -> None:
    network = NetworkFaults(loss=0.02, reorder=0.02)
    with arena(is_recorded=True, world_port=0, network=network, states_network=NetworkFaults(), patience=0.02) as place:
        assert place.server.world_address is not None
        controller = WatchedController(place.server.world_address)
        model = controller.model
        store = Store(UiState(model=model, goal=goal_at(model, model.home), watched=controller.name))
        actions = WatchActions(store, controller)
        with place.connect() as robot:
            programs.prepare(robot, NEAR, factor=0.2)
            wait_for(lambda: (actions.tick(), store.state.notice is not None)[1])
        assert store.state.notice is not None
        counts = store.state.notice.text.values
        status = controller.status()
        assert status.lost_cycles > 0
        assert (status.lost_cycles, status.late_cycles) == (counts["lost"], counts["late"])
        assert status.success_rate < 1.0
        table = health_html(store.state, status, Text("en"))
        assert f"<td>{counts['lost']} of " in table
        assert f" without a command; {counts['late']} commands late<" in table
        assert "100.0 %" not in table
        assert "control process" not in table
        assert status.answer_time is not None
        assert status.round_trip is not None
        assert 0.0005 < status.round_trip < 0.01
        with world_of(place) as world:
            world.press("estop")
            wait_for(lambda: controller.status().is_pressed)
        assert controller.status().powered is False
        controller.close()


def test_a_page_that_watches_sends_nothing(watching) -> None:
    store, _, controller = watching
    with pytest.raises(UsageError, match="only watches"):
        controller.robot()
    controller.stop()
    reason = obstacle(store.state, controller.status())
    assert reason is not None
    assert reason.code == "ready.watched"


def world_of(place: Arena) -> SimulationControl:
    assert place.server.world_address is not None
    return SimulationControl(*parse_simulation_port(place.server.world_address))


def follow(place: Arena, store: Store, actions: WatchActions) -> None:
    """Lets the page read the status of the simulation port once."""
    with world_of(place) as world:
        store.update(world=WorldState(status=world.status()))
    actions.tick()


def setup_table(store: Store, controller: WatchedController) -> str:
    panel = SetupPanel(Text("en"), lambda request: None)
    return panel._verdict_html(store.state, controller.status()) + panel._table_html(store.state, controller.status())


def test_a_page_shows_the_setup_of_its_controller_from_the_beginning_and_follows_it() -> None:
    box = SafetyBox(size=(2.0, 2.0, 2.0), T_base_box=Pose((0.0, 0.0, 0.9)))
    with arena(is_recorded=True, world_port=0) as place, world_of(place) as world:
        own = place.cycle.model.limits.joint
        world.set_tool(Pose((0.0, 0.0, 0.12)))
        world.set_load(Payload(mass=1.5))
        world.set_box(box)
        world.set_soft_limits([-2.0, *own.lower[1:]], [2.0, *own.upper[1:]])
        assert place.server.world_address is not None
        controller = WatchedController(place.server.world_address)
        store = Store(UiState(model=controller.model, goal=goal_at(controller.model, np.zeros(7)), watched="rci://it"))
        actions = WatchActions(store, controller)
        actions.tick()
        state = store.state
        assert state.setup.seen == {"box", "tool", "load"}
        assert state.setup.touched == frozenset()
        assert state.setup.wanted.box is not None
        assert state.setup.wanted.box.active
        assert state.model.T_flange_tool.position.tolist() == [0.0, 0.0, 0.12]
        assert state.model.load.mass == 1.5
        assert state.model.limits.joint.upper.tolist() == [2.0, *own.upper[1:]]
        table = setup_table(store, controller)
        for value in ("0, 0, 120 mm", "1.50 kg", "on, 2000 × 2000 × 2000 mm, centre 0, 0, 900 mm", "-115…115"):
            assert value in table, value
        before = state.setup
        follow(place, store, actions)
        assert store.state.setup is before  # Nothing has changed.
        world.set_tool(Pose((0.0, 0.0, 0.2)))
        world.set_box(dataclasses.replace(box, active=False))
        follow(place, store, actions)
        assert store.state.setup.seen == {"tool", "load"}
        assert store.state.model.T_flange_tool.position.tolist() == [0.0, 0.0, 0.2]
        assert "0, 0, 200 mm" in setup_table(store, controller)
        controller.close()


def test_a_page_that_watches_offers_no_change_of_the_setup(place: Arena, watching) -> None:
    """Also after a motion, whose tool and load are those of the controller."""
    store, actions, controller = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        wait_for(lambda: (actions.tick(), store.state.recording is not None)[1])
    setup, table = store.state.setup, setup_table(store, controller)
    assert pending_parts(store.state, controller.status()) == ()
    assert outdated(store.state) is None
    assert "Not sent" not in table
    assert "Send" not in table
    SetupActions(store, controller).type_field(TypeField(page=None, field="setup.tool.x", text="50"))
    assert store.state.setup is setup
    assert store.state.notice is not None
    assert store.state.notice.text.code == "ready.watched"


def test_what_a_page_that_watches_cannot_do_is_off(place: Arena) -> None:
    address, text = place.server.world_address, Text("en")
    with (
        place.connect() as robot,
        Workbench(WorkbenchConfig(port=0, quality="light", watch=address)) as bench,
    ):
        programs.prepare(robot, NEAR, factor=1.0)
        wait_for(lambda: any(notice.text.code == "watch.ended" for notice in bench.store.state.notices))
        handles = bench.server.gui._gui_input_handle_from_uuid.values()
        names = ("connect", "recover", "power_on", "power_off", "plan")
        labels = {text("destination.leave"), *(text(f"run.{name}") for name in names)}
        labels |= {text("jog.robot"), text("settings.model")}
        labels |= {text("setup.edit"), text("softlimits.lower", joint=1), text("softlimits.upper", joint=7)}
        buttons = [handle for handle in handles if getattr(handle, "label", "") in labels]
        assert len(buttons) == len(labels)
        wait_for(lambda: all(button.disabled for button in buttons))
        target = bench.server.scene._handle_from_node_name["/target"]
        wait_for(lambda: not target.visible)
        bench.dispatcher.ask(MoveJoint(page=None, joint=0, angle=0.5))  # As the Jog tab does.
        wait_for(lambda: target.visible)


def test_the_page_waits_for_the_first_motion(place: Arena, watching) -> None:
    store, _, controller = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        wait_for(lambda: controller.status().phase == "idle")
        q_c = controller.status().q_c
        assert q_c is not None
        store.update(goal=goal_at(store.state.model, q_c))
        GoalActions(store, controller).plan(PlanGoal())
    assert store.state.no_plan is not None
    assert store.state.no_plan.code == "plan.watched"


def test_the_force_frame_is_that_of_the_latest_motion(place: Arena, watching) -> None:
    store, actions, controller = watching
    assert "known once a motion begins" in setup_table(store, controller)
    frame = Pose((0.0, 0.0, 0.05))
    with place.connect() as robot:
        robot.set_fc_coor(frame.as_row_major(), 1)
        programs.prepare(robot, NEAR, factor=1.0)
        programs.line(robot, SECONDS, period=SECONDS)
        wait_for(lambda: (actions.tick(), store.state.recording is not None)[1])
        robot.set_fc_coor(Pose().as_row_major(), 0)
    assert "0, 0, 50 mm, axes: tool" in setup_table(store, controller)
    follow(place, store, actions)
    assert "0, 0, 50 mm, axes: tool" in setup_table(store, controller)


def test_curves_show_the_soft_limits_of_their_motion(place: Arena, watching) -> None:
    store, actions, _ = watching
    own = place.cycle.model.limits.joint
    with place.connect() as robot:
        robot.set_joint_limit((2.0, *own.upper[1:]), (-2.0, *own.lower[1:]))
        programs.prepare(robot, NEAR, factor=1.0)
        programs.line(robot, SECONDS, period=SECONDS)
        wait_for(lambda: (actions.tick(), store.state.recording is not None)[1])
        robot.set_joint_limit(own.upper, own.lower)
    run = store.state.recording.run
    assert run is not None
    follow(place, store, actions)
    for state in (store.state, replayed(store.state, run)):
        state = dataclasses.replace(state, plot_joint=1)
        frame = Plots(Text("en"))._joint_frame(state, "q", 1.0)
        assert (np.unique(frame.lower).tolist(), np.unique(frame.upper).tolist()) == ([-2.0], [2.0])


def test_all_plots_have_one_time_axis_when_the_recording_ends_after_the_commands(place: Arena, watching) -> None:
    """Acceleration and jerk end with the commands, the others with the recording, beyond the next round number."""
    store, actions, _ = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        programs.line(robot, SECONDS, period=SECONDS)
        wait_for(lambda: (actions.tick(), getattr(store.state.recording, "tracking", None) is not None)[1])
    plan = store.state.plan
    assert plan is not None
    plan = dataclasses.replace(plan, motion=Motion.from_cycles(plan.motion.q[:501]))
    state = dataclasses.replace(store.state, plan=plan, plots=frozenset(PLOTS))
    gui = Mock()
    gui.add_uplot.side_effect = lambda *_, **facts: SimpleNamespace(data=(), series=(), **facts)
    plots = Plots(Text("en"))
    plots.build(gui, state)
    plots.show(state)
    ranges = {name: plot.scales["x"]["range"] for name, plot in plots._plots.items() if plot.visible}
    assert {"dq", "ddq", "error", "tool"} <= set(ranges)
    assert set(ranges.values()) == {(0.0, plots.end)}
    assert plots.end > plan.motion.duration


@pytest.mark.parametrize(("address", "error"), [("x", InvalidValueError), ("127.0.0.2:1", ConnectionLostError)])
def test_an_address_without_a_controller_is_refused(address: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        WatchedController(address)


def test_a_controller_without_a_record_is_refused() -> None:
    with arena(world_port=0) as place:
        assert place.server.world_address is not None
        with pytest.raises(UsageError, match="keeps no record"):
            WatchedController(place.server.world_address)


def lie(answer: bytes) -> str:
    """Returns the address of a simulation port that gives this answer to its first client."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        with listener:
            client, _ = listener.accept()
            with client:
                client.recv(4096)
                client.sendall(answer)

    threading.Thread(target=serve, daemon=True).start()
    return "{}:{}".format(*listener.getsockname())


def status(**changed: Any) -> bytes:
    """Returns the answer of a controller that keeps a record, with other values; None removes one."""
    right = WorldStatus(model="xMatePro7", plant="ideal", cycle=1, phase="idle", pid=os.getpid(), record=0)
    content = json.loads(encode_world_answer(right, 1))
    for name, value in changed.items():
        holder = content if name in content else content["status"]
        holder[name] = value
        if value is None:
            del holder[name]
    return json.dumps(content).encode() + b"\n"


def test_a_true_answer_is_understood() -> None:
    _, answer = decode_world_answer(status())
    assert isinstance(answer, WorldStatus)
    assert answer.pid == os.getpid()


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (status(pid=2**22 + 1), "process 4194305) cannot be opened: No such file or directory"),
        (status(record=10_000), "cannot be opened: No such file or directory"),
        (status(record=-1), "keeps no record to watch"),
        (status(model=None), "(status: model is missing); check the address"),
        (status(colour="red"), "(status: colour is unknown); check the address"),
        (status(status=[1]), "(status: not a JSON object)"),
        (status(q="x" * 100), "is not a list"),
        (status(q="x" * 1000), "xxx"),
        (status(commands={"loss": 5}), "(status: loss needs 0 to 1, got 5)"),
        (status(remark={"facts": {"facts": 1}}), "the remark on the last fault is not valid"),
        (b'{"id":1,"ok":true}\n', "the response to a status request is Done()"),
        (b"220 mail ESMTP\n", "not valid JSON"),
        (b"x" * 70_000, "a line is longer than 65536 bytes"),
        (b"", "it closed the connection"),
    ],
    ids=[
        "another process", "another descriptor", "no record", "no model", "an unknown value", "no object", "no list",
        "long text", "a share of 5", "no remark", "no status", "another protocol", "a long line", "silence",
    ],
)  # fmt: skip
def test_what_is_not_a_controller_or_contradicts_itself_is_refused_in_one_sentence(
    answer: bytes, expected: str
) -> None:
    with pytest.raises((ConnectionLostError, ProtocolError, UsageError)) as raised:
        WatchedController(lie(answer))
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 400


def test_a_descriptor_of_another_file_is_refused(tmp_path: Path) -> None:
    with open(tmp_path / "other", "wb+") as other:
        other.write(bytes(100_000))
        other.flush()
        with pytest.raises(UsageError, match="not the record of a controller"):
            WatchedController(lie(status(record=other.fileno())))


@pytest.mark.parametrize("host", ["a..b", "x" * 100])
def test_a_name_that_no_host_can_have_is_refused(host: str) -> None:
    with pytest.raises(ConnectionLostError, match="does not respond to status"):
        WatchedController(f"{host}:80")
