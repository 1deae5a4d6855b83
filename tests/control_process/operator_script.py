"""Stands for a workbench: starts a supervisor on a controller of somebody else's, begins a motion and waits."""

from __future__ import annotations

import sys
import time

import numpy as np

from rcilab.conformance.check import check
from rcilab.control_process import Supervisor
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint


def main(address: str, *goal: str) -> None:
    model = load_model("xMatePro7")
    supervisor = Supervisor(model, address)
    supervisor.start()
    supervisor.power_on().wait(10.0)
    motion = plan_joint(model, supervisor.status().q_c, np.array([float(angle) for angle in goal]), speed=0.1)
    request = supervisor.execute(motion, check(motion, model).certificate)
    while not (supervisor.status().motion_time or 0.0) > 0.3:
        if request.done:
            request.wait(0.0)  # Raises why the motion did not begin.
            raise AssertionError("the motion ended too early")
        time.sleep(0.01)
    print(supervisor.status().worker_pid, flush=True)
    time.sleep(60.0)


if __name__ == "__main__":
    main(*sys.argv[1:])
