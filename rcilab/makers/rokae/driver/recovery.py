"""Out of a fault: asks the controller to clear it, and looks until it is gone."""

from __future__ import annotations

import time

from rcilab.core.errors import DeadlineError
from rcilab.core.fault import name_faults
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.makers.rokae.driver.connection import RciConnection

RECOVERY_TIMEOUT = 3.0  # [s] for the error bits to go after the controller has agreed to clear them.
_FRESH = 0.1  # [s] Longest wait for one state while faults are expected to go.


def recover(commands: RciCommands, link: RciConnection) -> None:
    """Clears the controller's faults and returns once no state shows them any more; see `RobotSession.recover`."""
    commands.automatic_error_recovery()
    deadline = time.monotonic() + RECOVERY_TIMEOUT
    faults = link.latest.faults if link.latest is not None else ()
    while time.monotonic() < deadline:
        states = link.poll(_FRESH)
        link.on_states(states)
        if states:
            faults = states[-1].faults
            if not faults:
                return
    names = name_faults(faults)
    raise DeadlineError(
        f"{link.name}: {names or 'the faults'} did not clear within {RECOVERY_TIMEOUT:g} s; remove the cause first"
        + (f": {faults[0].remedy}" if faults else "")
    ).coded("not_cleared", faults=names, seconds=f"{RECOVERY_TIMEOUT:g}")
