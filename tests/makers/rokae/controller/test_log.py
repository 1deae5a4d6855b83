"""The log of a controller, by which an engineer can follow a program: on real sockets, with a vendor-like peer."""

from __future__ import annotations

import json
import re
import socket
import struct
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from rcilab.core.clock import CYCLE_TIME
from rcilab.makers.rokae import wire as rci
from rcilab.sim import local_delivery
from rcilab.sim.log_entry import LogEntry
from rcilab.sim.log_lines import KINDS
from tests.makers.rokae.controller.test_server import MODEL, MOTION, Peer, Running, bind_udp, running
from tests.waiting import wait_for


def kinds(found: Running) -> list[str]:
    return [entry.kind for entry in found.entries]


def wait_for_kind(found: Running, kind: str) -> LogEntry:
    wait_for(lambda: kind in kinds(found), 30.0, f"an entry of kind {kind}")
    return next(entry for entry in found.entries if entry.kind == kind)


def leave(peer: Peer, how: str) -> None:
    """Ends the connection as a program that has ended does: closed, or reset because an answer was not read."""
    if how == "reset":
        peer.tcp.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    peer.tcp.close()


@pytest.mark.parametrize("how", ["close", "reset"])
def test_a_program_that_ends_right_after_its_stop_move_ended_well(how: str) -> None:
    """The vendor's client closes the connection while the arm plays the queued commands, without reading the answer."""
    with running(lockstep=True, prefill=50) as found, Peer(found) as peer:
        state = peer.start()
        for row in MOTION.q:
            peer.send(state.message_id, row)
            answered = state.message_id
            while state.message_id == answered:
                state = peer.receive_state()
        peer.tcp.sendall(rci.encode_request(rci.StopMove(), 99))
        leave(peer, how)
        ended = wait_for_kind(found, "motion_ended")
        wait_for(lambda: {"disconnected", "client_dropped"} & {*kinds(found)}, 30.0, "the end of the connection")
        assert np.array_equal(found.server.controller.arm.commanded.q, MOTION.goal)  # All that was queued was played.
    assert "client_lost" not in kinds(found)
    assert not any("during a motion" in entry.text for entry in found.entries)
    assert ended.text.startswith("motion ended after ")
    assert ended.facts["is_fault"] is False


@pytest.mark.parametrize("how", ["close", "reset"])
def test_a_client_that_vanishes_while_the_arm_moves_is_reported(how: str) -> None:
    with running(lockstep=True) as found, Peer(found) as peer:
        peer.run(MOTION.q[:150])
        leave(peer, how)
        lost = wait_for_kind(found, "client_lost")
        assert lost.text.startswith("client 127.0.0.1 ")
        assert lost.text.endswith(" during a motion: the arm stops")
        assert lost.facts["phase"] == "moving"
        wait_for_kind(found, "motion_ended")


def test_the_advice_after_missing_commands_names_the_pauses_that_a_prefill_absorbs() -> None:
    """At the fault it is not known how long the client will pause."""
    with running() as found, Peer(found) as peer:
        peer.send(peer.start().message_id, MODEL.home)
        advice = wait_for_kind(found, "advice")
        assert advice.text.startswith("--prefill N absorbs pauses of the client of N ms, 100 at most; ")


def test_in_lock_step_the_advice_after_missing_commands_is_on_its_patience() -> None:
    with running(lockstep=True, patience=0.05) as found, Peer(found) as peer:
        peer.run(MOTION.q[:150])
        advice = wait_for_kind(found, "advice")
        assert advice.text.startswith("lock-step waits 0.05 s for a command; a longer --patience is for a client")


def test_after_an_emergency_stop_there_is_no_advice_on_missing_commands() -> None:
    with running(lockstep=True, patience=0.05) as found, Peer(found) as peer:
        peer.run(MOTION.q[:150])
        wait_for(lambda: found.server.controller.playout.lost > 0, 30.0, "a cycle without a command")
        found.server.controller.press_button("estop")
        wait_for_kind(found, "motion_ended")
    assert found.server.controller.faults
    assert "advice" not in kinds(found)


def test_a_long_wait_of_lock_step_names_the_state_whose_answer_is_missing() -> None:
    with running(lockstep=True) as found, Peer(found) as peer:
        state = peer.run(MOTION.q[:50])
        waiting = wait_for_kind(found, "waiting")
        number = state.message_id
        assert waiting.text == f"lock-step has waited 1 s for the command that answers state {number}; none came"
        assert waiting.facts == {"state": number, "late": 0}


def test_a_program_can_be_followed_by_its_log() -> None:
    with running(lockstep=True) as found, Peer(found) as peer:
        peer.run(MOTION.q)
        assert peer.ask(rci.StopMove()) == 0
        state = peer.start()
        peer.send(state.message_id, MODEL.home - 0.5)
        while not state.faults:
            state = peer.receive_state()
        assert peer.ask(rci.StopMove()) == 0
        assert peer.ask(rci.StartMove(0, 1)) is rci.StartStatus.REFLEX
        assert peer.ask(rci.AutomaticErrorRecovery()) == 0
        found.server.controller.press_button("gstop")
        found.server.controller.press_button("none")
        assert peer.ask(rci.SetMotorPower(1)) == 0
        assert peer.ask(rci.StartDrag(1, 2)) == 0
        assert peer.ask(rci.StopDrag()) == 0
        assert peer.ask(rci.SetMotorPower(0)) == 0
        peer.tcp.close()
        wait_for_kind(found, "disconnected")
    assert kinds(found) == [
        "connected", "power_on", "motion_started", "motion_ended", "motion_started", "fault", "motion_ended", "refused",
        "recovered", "safety_stop", "safety_release", "power_on", "guiding_started", "guiding_ended", "power_off",
        "disconnected",
    ]  # fmt: skip
    started, ended = found.entries[2:4]
    assert started.text == "motion started: joint position"
    cycles = len(MOTION.q)
    assert ended.facts["without_command"] == ended.facts["late"] == 0
    assert ended.facts["cycles"] == cycles
    assert ended.facts["duration"] == pytest.approx((cycles - 1) * CYCLE_TIME)
    assert ended.cycle - started.cycle >= ended.facts["cycles"], "the state before the first command, and the end"
    fault, stopped, refused = found.entries[5:8]
    assert "kCommandJointVelocityLimitsViolation" in fault.text
    assert "kCommandJointVelocityLimitsViolation" in fault.facts["faults"]
    assert re.search(r"; and \d+ more violations; the arm stops$", fault.text)
    assert "joint 7: commanded jerk" in fault.facts["reason"], "every violation is in the facts"
    assert stopped.text.startswith("motion stopped after ")
    assert refused.facts == {"request": "StartMove", "status": "REFLEX", "phase": "reflex"}
    assert found.entries[8].text.startswith("faults cleared: k")
    assert [entry.cycle for entry in found.entries] == sorted(entry.cycle for entry in found.entries)


def test_the_documentation_lists_every_kind_of_entry() -> None:
    page = (Path(__file__).parents[4] / "docs" / "controller.md").read_text(encoding="utf-8")
    table = page.partition("| kind | facts |")[2].partition("\n\n")[0]
    assert {kind for kind in KINDS if f"`{kind}`" not in table} == set()


def test_cycles_without_events_write_nothing() -> None:
    with running(lockstep=True) as found, Peer(found) as peer:
        peer.start()
        before = len(found.entries)
        for _ in range(200):
            peer.send(peer.seen[-1].message_id, MODEL.home)
            peer.receive_state()
        assert len(found.entries) == before
        assert peer.ask(rci.StopMove()) == 0


def test_an_entry_has_both_times_as_text_and_as_json() -> None:
    wall = datetime(2026, 1, 2, 19, 43, 14, 125000).astimezone()
    entry = LogEntry(
        kind="refused", text="refused StartMove (not possible): the motors are off", cycle=12345,
        wall=wall.timestamp(), facts={"request": "StartMove", "phase": "off"},
    )  # fmt: skip
    assert entry.as_text() == (
        "rcilab controller: 19:43:14.125 12.345 s refused StartMove (not possible): the motors are off"
    )
    content = json.loads(entry.as_json())
    assert datetime.fromisoformat(content.pop("time")) == wall
    assert content == {"t": 12.345, "kind": "refused", "text": entry.text, "request": "StartMove", "phase": "off"}
    assert re.search(r'"time": "2026-01-02T19:43:14\.125[+-]\d\d:\d\d"', entry.as_json())


def test_a_client_that_receives_the_states_at_another_address_of_its_machine_is_not_warned() -> None:
    """A vendor's client binds its port on every address; `--client` may be any of them, or a name for one."""
    with bind_udp(0) as udp:
        port = udp.getsockname()[1]
        with running(client_host="127.0.0.3", client_port=port, udp_port=0) as found:
            with socket.create_connection((found.host, found.port)):
                assert len(udp.recv(2000)) == rci.STATE_SIZE
                wait_for_kind(found, "connected")
            wait_for_kind(found, "disconnected")
    assert "states_elsewhere" not in kinds(found)


def test_a_client_whose_states_go_where_no_program_receives_them_is_warned() -> None:
    with bind_udp(0, "127.0.0.1") as udp:
        port = udp.getsockname()[1]
        with running(client_host="127.0.0.3", client_port=port, udp_port=0) as found:
            with socket.create_connection((found.host, found.port)):
                text = wait_for_kind(found, "states_elsewhere").text
    assert text == (
        f"127.0.0.1 connected, but states go to 127.0.0.3:{port}, because of --client: no program receives them there; "
        "start with --client 127.0.0.1, or without"
    )


def test_an_address_of_another_machine_may_be_the_client_s_second_one() -> None:
    with running(client_host="192.0.2.7", udp_port=0) as found, socket.create_connection((found.host, found.port)):
        text = wait_for_kind(found, "states_elsewhere").text
    assert "unless that is another address of its machine, it receives none" in text


def test_local_addresses_and_their_receivers_are_distinguished() -> None:
    assert local_delivery.is_local_address("127.0.0.3")
    assert not local_delivery.is_local_address("192.0.2.7")
    with bind_udp(0, "127.0.0.3") as udp:
        port = udp.getsockname()[1]
        assert local_delivery.is_received_locally("127.0.0.3", port)
        assert not local_delivery.is_received_locally("127.0.0.4", port)
        assert not local_delivery.is_received_locally("192.0.2.7", port)
