"""A page that watches a virtual controller which a foreign client drives: real sockets, real shared memory."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import pytest

from rcilab.app.goal.goal import goal_at
from rcilab.app.run.readiness import obstacle
from rcilab.app.run.watch_actions import WatchActions, draw_plan
from rcilab.app.run.watched_controller import WatchedController
from rcilab.app.store import Store, UiState
from rcilab.core.errors import ConnectionLostError, InvalidValueError, UsageError
from rcilab.core.state import RobotMode
from tests.peers import programs
from tests.peers.arena import Arena, arena
from tests.peers.robot import ControlException
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
    assert state.plan.motion.q[: len(run.cycles) // 2].tolist() == run.q_c[1 : len(run.cycles) // 2 + 1].tolist()
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


def test_a_refused_command_is_drawn_and_reported(place: Arena, watching) -> None:
    store, actions, controller = watching
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        with pytest.raises(ControlException):
            programs.joint_sine(robot, SECONDS, period=0.05)
        wait_for(lambda: (actions.tick(), any(n.text.code == "watch.stopped_more" for n in store.state.notices))[1])
        assert controller.status().phase == "fault"
        robot.automatic_error_recovery()
    assert store.state.plan is not None
    assert not store.state.plan.report.ok


def test_a_page_that_watches_sends_nothing(watching) -> None:
    store, _, controller = watching
    with pytest.raises(UsageError, match="only watches"):
        controller.robot()
    controller.stop()
    reason = obstacle(store.state, controller.status())
    assert reason is not None
    assert reason.code == "ready.watched"


@pytest.mark.parametrize(("address", "error"), [("x", InvalidValueError), ("127.0.0.2:1", ConnectionLostError)])
def test_an_address_without_a_controller_is_refused(address: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        WatchedController(address)


def test_a_controller_without_a_record_is_refused() -> None:
    with arena(world_port=0) as place:
        assert place.server.world_address is not None
        with pytest.raises(UsageError, match="keeps no record"):
            WatchedController(place.server.world_address)
