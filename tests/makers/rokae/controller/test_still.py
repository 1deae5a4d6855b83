"""An arm at rest repeats its state instead of computing it anew: byte for byte the same, whatever comes and goes."""

from __future__ import annotations

import math
from collections.abc import Callable
from random import Random

import numpy as np
import pytest

from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.makers.rokae.controller.state_machine import Event, Phase
from rcilab.makers.rokae.faults import Fault
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

Act = Callable[[RciController, Random], None]

_POSE = (1.0, 0.0, 0.0, 0.02, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.1, 0.0, 0.0, 0.0, 1.0)
_MODES = ((0, 1), (1, 2), (2, 1), (3, 2), (4, 1))


def start(cycle: RciController, random: Random) -> None:
    cycle.handle(rci.SetMotorPower(1))
    cycle.handle(rci.StartMove(*random.choice(_MODES)))


def set_something(cycle: RciController, random: Random) -> None:
    requests = (
        rci.SetCoor(_POSE),
        rci.SetLoad(random.uniform(0.1, 1.0), (0.0, 0.01, 0.05), (0.001, 0, 0, 0, 0.001, 0, 0, 0, 0.001)),
        rci.SetFcCoor(_POSE, random.choice(tuple(rci.ForceFrame))),
        rci.SetTorqueFilterCutOffFrequency(random.choice((0.5, 20.0, 1000.0))),
        rci.SetDO(random.randrange(4), bool(random.getrandbits(1))),
        rci.SetCartImpDesiredTau((0.0, 0.0, 3.0, 0.0, 0.0, 0.0)),
        rci.GetMotorState(),
    )
    cycle.handle(random.choice(requests))


def press_on_the_arm(cycle: RciController, random: Random) -> None:
    wrench = [random.uniform(-20.0, 20.0) for _ in range(3)] + [0.0] * 3
    cycle.plant.push(wrench, random.choice((None, 3, 5)))


def press_a_button(cycle: RciController, random: Random) -> None:
    kind = random.choice((rci.SafetyStop.ESTOP, rci.SafetyStop.GSTOP, rci.SafetyStop.NONE))
    cycle.press_safety_stop(kind)
    if kind is not rci.SafetyStop.NONE and random.random() < 0.7:
        cycle.press_safety_stop(rci.SafetyStop.NONE)


def put_elsewhere(cycle: RciController, random: Random) -> None:
    if cycle.is_settled and not cycle.is_moving:
        cycle.reset(cycle.model.home + random.uniform(-0.1, 0.1))


def mount(cycle: RciController, random: Random) -> None:
    kilos = random.uniform(0.1, 1.0)
    load = Payload(mass=kilos, center_of_mass=np.array((0.0, 0.0, 0.05)), inertia=1e-3 * np.eye(3))
    cycle.plant.mount(random.choice((None, load)))


ACTS: tuple[Act, ...] = (
    start,
    start,
    set_something,
    set_something,
    press_on_the_arm,
    lambda cycle, _: cycle.plant.push(np.zeros(6)),
    press_a_button,
    put_elsewhere,
    mount,
    lambda cycle, _: cycle.handle(rci.StopMove()),
    lambda cycle, random: cycle.handle(rci.SetMotorPower(random.randrange(2))),
    lambda cycle, _: cycle.handle(rci.StartDrag(0, 0)),
    lambda cycle, _: cycle.handle(rci.StopDrag()),
    lambda cycle, _: cycle.handle(rci.AutomaticErrorRecovery()),
    lambda cycle, _: cycle.handle(rci.RebootRobot()),
    lambda cycle, random: cycle.set_input(random.randrange(4), True),
    lambda cycle, _: cycle.on_event(Event.CLIENT_LOST),
    lambda cycle, _: cycle.on_event(Event.FAULT, Fault.COLLISION),
    lambda cycle, _: setattr(cycle, "loop_back", not cycle.loop_back),
    lambda cycle, _: cycle.receive(rci.CommandPacket(cycle.state.message_id)),
)


def lead(cycle: RciController, count: int, random: Random) -> None:
    """Sends what a client would send in this cycle of its motion; one of forty is missing."""
    if cycle.phase is not Phase.MOVING or random.random() < 0.025:
        return
    state = cycle.state
    q, T = state.q_c.copy(), state.T_base_tool_c.matrix
    if count > 20:  # The play-out is filled by a standing arm.
        q[random.randrange(2)] += 2e-5 * math.sin(0.01 * count)
        T[2, 3] += 1e-6 * math.sin(0.01 * count)
    tau = (0.02 * math.sin(0.01 * count),) * len(q)
    cycle.receive(rci.CommandPacket(state.message_id, tuple(q), tuple(T.ravel().tolist()), tau_c=tau))


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize("name", ["xMatePro7", "xMate3"])
def test_whatever_happens_the_datagrams_are_those_of_a_controller_that_computes_each(name: str, plant: str):
    model = load_model(name)
    quick, thorough = (
        RciController(VirtualArm(model, build_plant(plant, model), prefill=2), mode_delay=5) for _ in range(2)
    )
    seed = len(name) + len(plant)
    random = Random(seed)
    still = 0
    for number in range(60):
        act, fate, rest = random.choice(ACTS), random.random(), random.choice((1, 5, 60, 400, 700))
        for cycle in (quick, thorough):
            act(cycle, Random(fate))
        for count in range(rest):
            is_sent = random.random() < 0.98
            for cycle in (quick, thorough):
                lead(cycle, count, Random(fate + count))
            thorough._is_still = False
            before = quick._is_still
            state, computed = quick.step(is_sent=is_sent), thorough.step(is_sent=is_sent)
            still += before and quick._is_still
            expected = rci.encode_state(computed)
            said = f"seed {seed}, act {number} {act}, {count} cycles later"
            assert rci.encode_state(state) == expected, said
            if is_sent:  # Nobody may look for a while: then there is nothing to renumber.
                assert quick.datagram == expected, said
    assert 3000 < still < 0.9 * quick.state.message_id, "the arm should have stood still, and not only that"


def test_a_request_a_push_and_a_stop_end_the_stillness(hand):
    hand.step(400)
    still = hand.state
    assert hand.step().q is still.q
    hand.cycle.plant.push((0.0, 0.0, -10.0, 0.0, 0.0, 0.0))
    assert hand.step().tau is not still.tau
    hand.cycle.plant.push(np.zeros(6))
    hand.step(800)
    assert hand.state.T_base_tool.matrix.tobytes() == still.T_base_tool.matrix.tobytes()
    assert hand.ask(rci.SetMotorPower(1)) == 0
    assert hand.step().robot_mode is not still.robot_mode
