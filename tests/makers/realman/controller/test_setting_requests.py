"""Digital ports of controller and tool, and power outputs: what is set is read back, what makes no sense is refused."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.model.dynamics.payload import Payload
from rcilab.sim.arm_setup import ArmSetup
from tests.makers.realman.controller.bench import Bench


def test_a_port_has_the_mode_that_was_set_and_only_an_output_is_set():
    bench = Bench()
    assert bench.ask("get_IO_state", IO_Num=3) == {"state": "IO_state", "IO_Num": 3, "IO_Mode": 1, "IO_state": 0}
    bench.ask("set_DO_state", IO_Num=3, state=1)
    assert bench.ask("get_IO_state", IO_Num=3)["IO_state"] == 1
    assert bench.ask("set_IO_mode", IO_Num=3, IO_mode=2)["set_state"] is True
    assert bench.ask("get_IO_state", IO_Num=3) == {"state": "IO_state", "IO_Num": 3, "IO_Mode": 2, "IO_state": 0}
    bench.controller.set_input(2, True)
    assert bench.ask("get_IO_state", IO_Num=3)["IO_state"] == 1
    assert bench.ask("set_DO_state", IO_Num=3, state=0)["set_state"] is False
    assert "set_IO_mode" in bench.logged[-1][1]


def test_a_port_that_changes_the_speed_keeps_speed_and_trigger():
    bench = Bench()
    assert bench.ask("set_IO_mode", IO_Num=1, IO_mode=14)["set_state"] is False
    speed = {"speed": 50, "mode": 1}
    assert bench.ask("set_IO_mode", IO_Num=1, IO_mode=14, realtime_speed=speed)["set_state"] is True
    assert bench.ask("get_IO_state", IO_Num=1)["realtime_speed"] == speed
    assert bench.ask("set_IO_mode", IO_Num=1, IO_mode=15)["set_state"] is False


def test_a_port_of_the_tool_is_input_or_output():
    bench = Bench()
    assert bench.ask("set_tool_DO_state", IO_Num=2, state=1)["set_state"] is False
    assert bench.ask("set_tool_IO_mode", IO_Num=2, state=1)["set_state"] is True
    assert bench.ask("set_tool_DO_state", IO_Num=2, state=1)["set_state"] is True
    assert bench.ask("get_tool_IO_state") == {"state": "tool_IO_state", "IO_Mode": [0, 1], "IO_State": [0, 1]}
    assert bench.ask("set_tool_IO_mode", IO_Num=3, state=1)["set_state"] is False


@pytest.mark.parametrize(("kind", "refused"), [("voltage", 1), ("tool_voltage", 4)])
def test_a_voltage_is_read_back(kind: str, refused: int):
    bench = Bench()
    assert bench.ask(f"set_{kind}", voltage_type=3)["state"] is True
    assert bench.ask(f"set_{kind}", voltage_type=refused)["state"] is False
    assert bench.ask(f"get_{kind}") == {"state": f"{kind}_state", "voltage_type": 3}


def test_streamed_velocities_are_in_the_axes_that_were_set():
    bench = Bench("RM75")
    for frame, moves_down in ((1, False), (0, True)):  # Work frame, tool: its z axis points down.
        fields = {"avoid_singularity_flag": 0, "frame_type": frame, "dt": 10}
        assert bench.ask("set_movev_canfd_init", **fields)["movev_canfd_init_state"] is True
        before = bench.pose[2]
        for _ in range(20):
            bench.send("movev_canfd", cartesian_velocity=[0, 0, 50000, 0, 0, 0])
            bench.run(10)
        assert (bench.pose[2] < before) is moves_down
        bench.run(500)
    assert bench.ask("set_movev_canfd_init", frame_type=2)["movev_canfd_init_state"] is False


def test_the_geometry_is_that_of_the_arm():
    bench = Bench("RM75")
    rows = {name: row for name, row in bench.ask("get_DH_data").items() if name != "command"}
    assert bench.ask("set_DH_data", **rows)["set_state"] is True
    assert bench.ask("set_DH_data", **{**rows, "joint_1": [-90000, 0, 250000, 0]})["set_state"] is False
    assert bench.ask("set_DH_data_default")["set_state"] is True


@pytest.mark.parametrize(("model", "rated"), [("RM65", 5000), ("RML63-III", 3000)])
def test_a_tool_heavier_than_the_rated_payload_is_refused(model: str, rated: int):
    bench = Bench(model)
    tool = {"tool_name": "grip", "tool_pose": [0, 0, 100000, 0, 0, 0], "position": [0, 0, 50000]}
    assert bench.ask("set_manual_tool_frame", **tool, payload=rated + 1)["manual_tool_frame"] is False
    assert "rated payload" in bench.logged[-1][1]
    assert bench.ask("set_manual_tool_frame", **tool, payload=rated)["manual_tool_frame"] is True
    assert bench.ask("set_change_tool_frame", tool_name="grip")["change_tool_frame"] is True
    assert bench.ask("update_tool_frame", **tool, payload=rated + 1)["update_state"] is False
    bench.run(2)
    assert bench.controller.model.load.mass == rated / 1000
    assert bench.ask("get_current_tool_frame")["payload"] == rated


def test_a_load_that_the_arm_cannot_bear_changes_nothing():
    bench = Bench()
    heavy = Payload(mass=5.5, center_of_mass=np.zeros(3))
    with pytest.raises(InvalidValueError):
        bench.controller.set_up(ArmSetup(load=heavy))
    bench.ask("set_arm_max_line_speed", arm_line_speed=100)  # The arm is configured again.
    bench.run(2)
    assert bench.ask("get_current_tool_frame")["payload"] == 0


def test_a_mode_that_does_not_exist_is_refused():
    bench = Bench()
    assert bench.ask("set_arm_run_mode", mode=5)["mode"] is False
    assert bench.ask("get_arm_run_mode")["mode"] == 1
