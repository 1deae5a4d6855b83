"""What the fork server loads once, so that every process forked from it has it.

Importing this module has effects, on purpose: multiprocessing's fork server offers nothing but an import to prepare
itself. Nothing else imports it.
"""

from __future__ import annotations

import gc
import os
import signal
from contextlib import suppress

# The user's process handles an interrupt: it stops the arm before its processes end. A session of its own keeps Ctrl-C
# in the terminal away; VS Code sends SIGINT to every process below the kernel. Forked processes inherit both.
signal.signal(signal.SIGINT, signal.SIG_IGN)
signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # Blocked by `fork_server.py` until here.
with suppress(PermissionError):  # It leads a session already.
    os.setsid()

for _library in ("OPENBLAS", "OMP"):  # A process that forks must have one thread.
    os.environ[f"{_library}_NUM_THREADS"] = "1"

with suppress(Exception):  # What fails here fails again, and is reported, in the process that needs it.
    import rcilab.control_process.managed_process
    import rcilab.control_process.worker  # noqa: F401
    from rcilab.model.robot_model import load_model
    from rcilab.motion import plan_stop

    _model = load_model("xMatePro7")
    _model.rigid_body.gravity(_model.home)  # The first call loads the library.
    _zero = _model.home * 0.0
    plan_stop(_model.limits.joint, _zero, _zero + 0.1, _zero)  # The first call loads the planner.

gc.collect()
gc.freeze()  # Forked processes do not scan it, and so share its memory for longer.
