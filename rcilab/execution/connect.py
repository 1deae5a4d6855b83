"""Opening a session: `connect`, and `open_session` with further options for a simulation."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from rcilab.cell.cell import Cell, require_cell
from rcilab.core.errors import InvalidValueError
from rcilab.execution.control_loop import LOCAL_STATE_TIMEOUT, STATE_TIMEOUT
from rcilab.execution.load_comparison import describe_other_load
from rcilab.execution.motion_runner import MotionRunner
from rcilab.execution.session import RobotSession
from rcilab.execution.session_lock import SessionLock
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import ConfiguredArm, ExpectedArm, StreamingDriver, open_driver, require_timeout
from rcilab.makers.maker import require_driver
from rcilab.model.robot_model import load_model, require_model

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel


def connect(
    address: str,
    model: RobotModel | None = None,
    timeout: float = 3.0,
    *,
    apply: bool = False,
    record_all: bool = False,
    cell: Cell | None = None,
) -> RobotSession:
    """Returns a session with the robot at an address. Nothing moves and no motor is switched.

    Tool and load are settings of the controller, which change what the arm does: they are sent only with `apply`.
    Without it a warning reports in one sentence what differs from the model. The tool is known from the state. Where
    the load is not (RCI), it is compared by the torques at standstill, which show 2 kg in most poses and may not show
    0.5 kg; if they cannot show the model's load, the warning reports that.

    Args:
        address: `rci://HOST:PORT`; `?udp_port=N` if the robot receives commands at another UDP port,
            `?client_port=M` if it sends states to another port; `?world_port=W` for `simulation`. `fci://HOST` for a
            Franka arm, `xarm://HOST` for one of UFACTORY, `realman://HOST:PORT` for one of RealMan.
        model: The arm, with its tool and load; None uses the arm that the controller reports. Without `apply`, the
            session's model has the controller's tool.
        timeout: Timeout of the connection, of the first state, and of every response, [s].
        apply: Whether the model's tool and load are sent to the controller.
        record_all: Whether runs store every field of the state, three times as much; see `Run.cycles`.
        cell: The cell of the arm, see `RobotSession.set_cell`; its tool and load count as those of the model.

    Raises:
        ConnectionLostError: The robot does not respond, or states do not arrive; the message says what to check.
        ModelError: The model differs from the controller's arm, or that arm is not known.
        InvalidValueError: The address, the model or the timeout is not valid.
        MissingExtraError: The maker's client library is not installed.
    """
    return open_session(address, model, timeout, apply=apply, record_all=record_all, cell=cell)


def open_session(
    address: str,
    model: RobotModel | None,
    timeout: float,
    *,
    apply: bool = False,
    record_all: bool = False,
    cell: Cell | None = None,
    is_set_up: bool = False,
    realtime: bool = True,
    state_timeout: float | None = None,
    on_close: Callable[[], None] = lambda: None,
    world: SimulationControl | None = None,
    partner: int | None = None,
) -> RobotSession:
    """Returns a session as `connect` does, with further options for a simulation.

    Args:
        address: See `connect`, also for the next three.
        model: The arm.
        timeout: [s].
        apply: As for `connect`.
        record_all: As for `connect`.
        cell: As for `connect`.
        is_set_up: Whether the controller was started with the tool and the load of the model.
        realtime: False for a controller in lock-step, which has no timing.
        state_timeout: Time without a state, while moving, that counts as a lost connection, [s]; None is
            `STATE_TIMEOUT`, or `LOCAL_STATE_TIMEOUT` for a controller on this machine, which pauses when the machine
            is busy.
        on_close: Called once when the session is closed, for example to end a private controller.
        world: The simulation control of a virtual robot; None without one.
        partner: Process id of a controller on this machine that is in lock-step with us; None: it is not.
    """
    require_timeout(timeout)
    if cell is not None:
        model = require_cell(cell).applied_to(load_model(cell.model) if model is None else model)
    if model is not None:
        require_driver(require_model(model))
    elif apply:
        raise InvalidValueError("apply", apply, "needs a model with the tool and the load to send")
    driver = open_driver(address, timeout, None if model is None else ExpectedArm.of(model))
    try:
        if model is None:
            model = load_model(driver.arm_name)
        if not (apply or is_set_up):
            model = driver.with_tool(model)
            if not driver.reports_load:
                _warn_of_other_load(driver, model)
        if world is None and driver.simulation_address is not None:
            world = SimulationControl(*driver.simulation_address)
        exit_stack = ExitStack()
        exit_stack.callback(on_close)
        if world is not None:
            exit_stack.callback(world.close)
        exit_stack.callback(driver.close)
        lock = SessionLock(exit_stack.close)
        if state_timeout is None:
            state_timeout = LOCAL_STATE_TIMEOUT if driver.is_local else STATE_TIMEOUT
        arm = ConfiguredArm(model=model)
        runner = MotionRunner(
            driver, lock, arm, realtime=realtime, state_timeout=state_timeout, partner=partner, record_all=record_all
        )
        session = RobotSession(driver, arm, lock, runner, world)
        if apply:
            session.configure(RobotConfiguration(tool=model.T_flange_tool, load=model.load))
        session.set_cell(cell)
        return session
    except BaseException:
        driver.close()
        raise


def _warn_of_other_load(driver: StreamingDriver, model: RobotModel) -> None:
    if driver.latest is None:
        return
    sentence = describe_other_load(model, driver.latest, driver.name)
    if sentence:
        warnings.warn(sentence, stacklevel=4)
