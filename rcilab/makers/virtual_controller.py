"""Creates the virtual controller of any arm: its maker is that of the model's name."""

from __future__ import annotations

from collections.abc import Callable

from rcilab.makers.maker import maker_of, require_simulator
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.sim.arm_server import ArmServer
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.friction_watch import FrictionWatch
from rcilab.sim.log_entry import LogEntry
from rcilab.sim.plant import Plant
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm


def build_virtual_controller(
    config: ControllerConfig, *, plant: Plant | None = None, log: Callable[[LogEntry], None] | None = None
) -> ArmServer:
    """Returns a virtual controller with its sockets open; `run` makes it serve.

    Args:
        config: Its configuration.
        plant: The plant; None: that of the configuration.
        log: Takes the entries of its log, and must not wait; None: a thread writes them to stderr.

    Raises:
        InvalidValueError: The configuration of the arm is not valid.
        ModelError: The configuration names no known arm, or one without a virtual controller.
        UsageError: An address or port cannot be used.
    """
    model = require_simulator(load_model(config.model))
    maker = maker_of(model)
    assert maker is not None  # A simulated arm has one.
    options = maker.capabilities.options
    config.require_options(options)
    arm = VirtualArm(
        model,
        build_plant(config.plant, model, config.realism, config.cell) if plant is None else plant,
        prefill=config.prefill_cycles,
        torque_prefill=config.torque_prefill_cycles,
        skips_torques=not config.lockstep,
        lost_limit=config.lost_limit,
        on_loss="hold" if config.on_loss is None else config.on_loss,
        friction_watch=_friction_watch(model) if config.realism == "real" else None,
    )
    server = maker.build_server(arm, config)
    if config.loop_back:
        server.controller.loop_back = True
    setup = config.setup(model)
    if setup is not None:
        server.controller.set_up(setup)
    for signal in config.inputs:
        server.controller.set_input(signal, True)
    return ArmServer(server, config, options=options, log=log)


def _friction_watch(model: RobotModel) -> FrictionWatch | None:
    joints = model.description.imperfections
    return None if joints is None else FrictionWatch([joint.friction for joint in joints])
