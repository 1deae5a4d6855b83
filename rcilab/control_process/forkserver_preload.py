"""The preload module of the fork server: forked processes inherit the loaded libraries.

It has side effects on import, because an import is the only hook of multiprocessing's fork server. No other module
imports it.
"""

from __future__ import annotations

import gc
import os
import signal
from contextlib import suppress

# The user's process handles an interrupt: it stops the arm before its child processes end. A separate session keeps
# Ctrl-C in the terminal away; VS Code sends SIGINT to every process below the kernel. Forked processes inherit both.
signal.signal(signal.SIGINT, signal.SIG_IGN)
signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # `fork_server.py` has blocked it.
with suppress(PermissionError):  # It is a session leader already.
    os.setsid()

for _library in ("OPENBLAS", "OMP"):  # A process that forks must be single-threaded.
    os.environ[f"{_library}_NUM_THREADS"] = "1"

with suppress(Exception):  # An error recurs, and is reported, in the process that needs the module.
    import rcilab.control_process.managed_process
    import rcilab.control_process.worker  # noqa: F401
    from rcilab.model.robot_model import load_model
    from rcilab.motion import plan_stop

    _model = load_model("xMatePro7")
    _model.rigid_body.gravity(_model.home)  # The first call loads the library.
    _zero = _model.home * 0.0
    plan_stop(_model.limits.joint, _zero, _zero + 0.1, _zero)  # The first call loads the planner.

gc.collect()
gc.freeze()  # Forked processes do not scan these objects, so their memory stays shared for longer.
