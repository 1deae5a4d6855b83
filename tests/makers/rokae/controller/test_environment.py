"""World requests in any order on a controller without sockets: each is done or refused, and the robot goes on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.model.robot_model import load_model
from rcilab.sim import api as world
from rcilab.sim.api import NetworkFaults, WorldStatus
from rcilab.sim.channels import TcpChannel, UdpChannel
from rcilab.sim.clock_stalls import StallSchedule
from rcilab.sim.endpoint import Endpoint
from rcilab.sim.environment import Environment, ServerCounters
from rcilab.sim.faulty_network import FaultyNetwork
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm
from tests.manual_clock import ManualClock
from tests.sim.api.test_world_lines import REQUESTS

MODEL = load_model("xMatePro7")


class Place:
    """A powered controller with its surroundings, stepped by hand."""

    def __init__(self, kind: str) -> None:
        self.clock = ManualClock()
        self.cycle = RciController(VirtualArm(MODEL, build_plant(kind, MODEL)))
        self.cycle.handle(rci.SetMotorPower(1))
        self.endpoint = Endpoint("127.0.0.2", [TcpChannel(protocol="RCI", port=0), UdpChannel()])
        network = FaultyNetwork(self.endpoint, self.clock, NetworkFaults(), NetworkFaults())
        self.stalls = StallSchedule()
        self.surroundings = Environment(self.cycle, network, self.stalls, self.clock, lambda: ServerCounters(3, 4, 5))
        self.handle = self.surroundings.handle

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.cycle.step()
            self.surroundings.step()

    @property
    def status(self) -> WorldStatus:
        status = self.handle(world.GetStatus())
        assert isinstance(status, WorldStatus)
        return status


@pytest.fixture(params=["ideal", "mujoco"])
def place(request):
    place = Place(request.param)
    yield place
    place.endpoint.close()


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(REQUESTS, max_size=12))
def test_whatever_is_asked_for_is_done_or_refused_and_the_robot_goes_on(place, requests) -> None:
    for request in requests:
        answer = place.handle(request)
        assert isinstance(answer, world.Done | world.Refused | WorldStatus)
        place.step(3)
        assert np.isfinite(place.cycle.state.q).all()
        line = world.encode_world_answer(place.status, 1)
        assert world.decode_world_answer(line) == (1, place.status)
    for request in (world.Press("none"), world.Release(), world.Mount(), world.Floor(False)):
        assert place.handle(request) == world.Done()
    assert not place.status.pushed


def test_a_push_ends_after_its_time_and_a_new_one_replaces_it(place) -> None:
    place.handle(world.Push((0.0, 0.0, -20.0, 0.0, 0.0, 0.0), duration=0.01))
    place.step(9)
    assert place.status.pushed
    place.step()
    assert not place.status.pushed
    place.handle(world.Push((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), duration=0.005))
    place.handle(world.Push((1.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    place.step(100)
    assert place.status.pushed


def test_an_arm_without_buttons_for_guiding_refuses_them(place) -> None:
    answer = place.handle(world.Guide(True))
    assert isinstance(answer, world.Refused)
    assert "StartDrag" in answer.reason


def test_the_status_has_what_was_chosen_and_counted(place) -> None:
    assert place.handle(world.Limits("sdk")) == world.Done()
    assert place.handle(world.Limits("none")) == world.Refused("limit table: 'none' is unknown; known: manual, sdk")
    assert place.handle(world.OnLoss("bridge")) == world.Done()
    assert place.handle(world.OnLoss("panic")) == world.Refused("on_loss: 'panic' is unknown; known: hold, bridge")
    assert place.handle(world.AutoLimit(True)) == world.Done()
    assert place.handle(world.SetInput(2, True)) == world.Done()
    assert isinstance(place.handle(world.SetInput(6, True)), world.Refused)
    assert place.cycle.limit_table == "sdk"
    assert place.cycle.arm.on_loss == "bridge"
    assert place.cycle.auto_limit
    assert place.status.auto_limit
    assert place.cycle.settings.inputs == (False, False, True, False, False, False)
    assert (place.status.missed, place.status.bad_datagrams, place.status.unknown_senders) == (3, 4, 5)
    assert place.status.phase == "idle"
    no_switch = "button: 'switch' does not exist on this arm; known: estop, gstop"
    assert place.handle(world.Press("switch")) == world.Refused(no_switch)
    place.handle(world.Press("gstop"))
    place.step()
    assert (place.status.button, place.status.phase) == ("gstop", "user_stopped")


def test_a_stall_counts_from_when_it_is_asked_for_and_can_be_taken_back(place) -> None:
    place.clock.advance(100.0)
    place.handle(world.StallClock(0.5, 2.0, 1.0))
    assert [place.stalls.pop(now) for now in (100.0, 101.9, 102.0, 102.9, 103.0)] == [0.0, 0.0, 0.5, 0.0, 0.5]
    place.handle(world.StallClock(0.0))
    assert place.stalls.pop(1e6) == 0.0


def test_walls_are_refused_where_nothing_touches_also_before_there_is_a_box(place) -> None:
    is_solid = place.cycle.arm.plant.kind == "mujoco"
    assert (place.handle(world.Walls(True)) == world.Done()) is is_solid
    assert place.handle(world.SetBox((1.9, 1.9, 1.9), (0.0, 0.0, 0.5))) == world.Done()
    place.step(3)
    assert np.isfinite(place.cycle.state.q).all()
