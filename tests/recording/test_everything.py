"""What a recording holds of the state: the usual things, everything on request, and what older files lack."""

import io
from dataclasses import fields

import numpy as np
import pytest

import rcilab
from rcilab.core.cycle_log import OTHER_STATE_FIELDS, STATE_FIELDS, cycle_columns, cycle_dtype
from rcilab.core.state import RobotState
from rcilab.recording.run import decode_run, load_run
from rcilab.recording.run_file import RunWriter
from tests.recording.runs import MODEL, PLAN, some_cycles, some_run

MODELS = [pytest.param("xMatePro7", id="7 axes"), pytest.param("xMate3", id="6 axes")]


def pressed(robot, states, seconds=0.15):
    """Holds the arm, yielding, while something presses; keeps every state that was answered."""
    T = robot.state.T_base_tool_c

    def callback(state, t):
        states.append(state)
        if len(states) == 20:
            robot.world.push([3.0, -5.0, 8.0, 0.0, 0.0, 0.1])
        return rcilab.CartesianPosition(T, finished=t >= seconds)

    return robot.control(callback, "cartesian_impedance")


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("record_all", [False, True])
def test_a_run_holds_what_the_states_told(name, record_all, tmp_path):
    model, states = rcilab.load_model(name), []
    with rcilab.simulate(model, plant="mujoco", record_all=record_all) as robot:
        robot.power_on()
        run = pressed(robot, states)
    wanted = STATE_FIELDS + (OTHER_STATE_FIELDS if record_all else ())
    assert (run.cycles.dtype.names or ())[-len(wanted) :] == wanted
    assert np.abs(run.tau_ext_in_base[-1] - [3.0, -5.0, 8.0, 0.0, 0.0, 0.1]).max() < 0.5
    for row, state in enumerate(states):
        for field in wanted:
            assert np.array_equal(run.cycles[field][row], np.asarray(getattr(state, field))), (row, field)
    run.save(tmp_path / "a.rcirun")
    back = load_run(tmp_path / "a.rcirun")
    assert back.cycles.dtype == run.cycles.dtype
    assert back.cycles.tobytes() == run.cycles.tobytes()


def test_every_field_of_the_state_can_be_recorded_under_its_name():
    recorded = {"faults", "success_rate", "motion_generator_mode", "controller_mode", "robot_mode", "message_id"}
    names = {field.name for field in fields(RobotState)}
    assert names == recorded | {"q", "q_c", "dq", "tau"} | {*STATE_FIELDS} | {*OTHER_STATE_FIELDS}
    assert names <= {*(cycle_dtype(7, complete=True).names or ())}


def test_columns_of_forces_and_poses_have_the_unit_of_each_number():
    units = {column.name: column.unit for column in cycle_columns(np.zeros(1, cycle_dtype(6, complete=True)))}
    assert [units[f"tau_ext_in_base[{i}]"] for i in range(1, 7)] == ["N"] * 3 + ["N m"] * 3
    assert [units[f"tool_velocity_c[{i}]"] for i in (1, 6)] == ["m/s", "rad/s"]
    assert [units[f"T_base_tool[{i},4]"] for i in range(1, 5)] == ["m", "m", "m", ""]
    assert units["T_base_tool[1,1]"] == units["command_pose[3,3]"] == ""
    assert (units["theta[6]"], units["psi_c"], units["dtau_c[1]"]) == ("rad", "rad", "N m/s")
    assert "theta[7]" not in units


def test_a_file_from_before_more_of_the_state_was_recorded_is_read():
    ours, cycles = cycle_dtype(7), some_cycles()
    kept = [(name, field[0].base, field[0].shape) for name, field in ours.fields.items() if name not in STATE_FIELDS]
    older = np.zeros(len(cycles), np.dtype(kept))
    for name, *_ in kept:
        older[name] = cycles[name]
    stream = io.BytesIO()
    writer = RunWriter(stream, older.dtype, plan=PLAN, model=MODEL)
    writer.add(older)
    writer.finish()
    back = decode_run(stream.getvalue())
    assert back.cycles.dtype == ours
    for name, *_ in kept:
        assert np.array_equal(back.cycles[name], cycles[name], equal_nan=True), name
    assert np.isnan(back.theta).all()
    assert np.isnan(back.T_base_tool).all()
    assert back.tracking.joint_max == pytest.approx(some_run().tracking.joint_max)
