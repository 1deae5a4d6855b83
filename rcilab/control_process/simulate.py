"""`simulate`: a session as with `connect`, on a private virtual controller."""

from __future__ import annotations

import weakref
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rcilab.cell.cell import Cell, require_cell
from rcilab.cell.convex_parts import prepare_meshes
from rcilab.cell.tool import Tool
from rcilab.control_process.launch import VirtualController, start_controller
from rcilab.core.errors import ModelError
from rcilab.execution.connect import open_session
from rcilab.execution.session import RobotSession
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.configuration import RobotConfiguration, SoftJointLimits
from rcilab.makers.maker import capabilities_of, find_missing_feature, require_simulator
from rcilab.model.dynamics.payload import NO_LOAD
from rcilab.model.robot_model import RobotModel, load_model, require_model
from rcilab.sim.controller_config import ControllerConfig, require_option, require_plant
from rcilab.sim.streamed_motion import require_loss_behaviour

ANSWER_TIMEOUT = 10.0  # [s] The controller is on this machine: if it is slow, the machine is busy.
STATE_TIMEOUT_IN_LOCKSTEP = 5.0  # [s] A busy machine may pause a controller without deadlines for seconds.


def simulate(
    model: RobotModel,
    *,
    plant: str = "ideal",
    lockstep: bool | None = None,
    record_all: bool = False,
    realism: str = "off",
    on_loss: str | None = None,
    prefill: int | None = None,
    cell: Cell | None = None,
) -> RobotSession:
    """Returns a session with a simulated arm; the simulation ends when the session is closed or garbage-collected.

    Args:
        model: The arm, with its tool, load and soft limits; the virtual controller receives all three.
        plant: "ideal" (the arm follows the command exactly) or "mujoco".
        lockstep: True: each simulated millisecond waits for its command, so that a run has the same result to the last
            bit on any machine. False: the controller runs freely, like a real one. None: True where the interface can,
            that of ROKAE and Franka.
        record_all: Whether runs store every field of the state, three times as much; see `Run.cycles`.
        realism: "real": the joints of the MuJoCo plant have the friction and torque sensors of real ones; or "off".
        on_loss: What the arm does while commands are missing: "hold" the last one, or "bridge" the gap; None: as the
            maker's arms, "hold" for an xMate.
        prefill: Cycles by which commands are played later; None: none in lock-step, else 10; torques 2 in both.
        cell: The cell of the arm, see `RobotSession.set_cell`; its tool and load are those of the arm, and its floor
            and obstacles are solid with the plant "mujoco".

    Raises:
        InvalidValueError: `model` is not a robot model, or another value is unknown, or the arm has no lock-step.
        ModelError: The arm has no virtual controller.
        ConnectionLostError: The virtual controller did not start; the message contains its output.
    """
    if find_missing_feature(require_simulator(require_model(model)), "driving") is not None:
        raise ModelError(
            f"{model.name} has no driver in rcilab: run rcilab controller --model {model.name}, and a program with its "
            "maker's client library"
        ).coded("no_driver", model=model.name)
    require_plant(plant, realism)
    own = model
    if cell is not None:
        model = require_cell(cell).applied_to(own)
    capable = capabilities_of(model).options
    if lockstep:
        require_option("lockstep", lockstep, capable, model.name)
    lockstep = "lockstep" in capable if lockstep is None else lockstep
    options = ["--realism", realism]
    if on_loss is not None:
        options += ["--on-loss", require_loss_behaviour(on_loss)]
    if prefill is not None:
        options += ["--prefill", str(ControllerConfig(model=model.name, prefill=prefill).prefill)]
    controller = _start(own, plant, lockstep, options, cell)
    try:
        assert controller.address is not None  # Set by start_controller.
        session = open_session(
            controller.address,
            model,
            ANSWER_TIMEOUT,
            apply=cell is None,
            is_set_up=cell is not None,
            record_all=record_all,
            cell=cell,
            realtime=not lockstep,
            state_timeout=STATE_TIMEOUT_IN_LOCKSTEP if lockstep else None,
            on_close=controller.end,
            world=_world(controller.world_address),
            partner=controller.pid if lockstep else None,
        )
    except BaseException:
        controller.end()
        raise
    try:
        own, joint = load_model(model.name).limits.joint, model.limits.joint
        if not (np.array_equal(joint.lower, own.lower) and np.array_equal(joint.upper, own.upper)):
            soft = SoftJointLimits(lower=tuple(joint.lower.tolist()), upper=tuple(joint.upper.tolist()))
            session.configure(RobotConfiguration(joints=soft))
    except BaseException:
        session.close()
        raise
    weakref.finalize(session, controller.end)  # A notebook cell that runs again drops its earlier session.
    return session


def _start(model: RobotModel, plant: str, lockstep: bool, options: list[str], cell: Cell | None) -> VirtualController:
    """Returns a controller; one with a cell has its tool and load, or else those of the model, and the held part."""
    if cell is None:
        return start_controller(model.name, plant, lockstep, options)
    if plant == "mujoco":
        prepare_meshes(cell)  # Takes seconds once, for which its start does not wait.
    if cell.tool is None:
        load = model.load if cell.part is None else NO_LOAD  # That of the part alone, see `Cell.applied_to`.
        cell = replace(cell, tool=Tool(T_flange_tool=model.T_flange_tool, payload=load))
    with TemporaryDirectory(prefix="rcilab-") as folder:
        file = Path(folder) / "cell.zip"
        cell.save(file)
        return start_controller(model.name, plant, lockstep, [*options, "--cell", str(file)])


def _world(address: str | None) -> SimulationControl | None:
    if address is None:
        return None
    host, _, port = address.partition(":")
    return SimulationControl(host, int(port))
