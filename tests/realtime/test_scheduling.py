from __future__ import annotations

import subprocess
import sys

_PROGRAM = """
import gc, os, resource
from rcilab.realtime.scheduling import enter_realtime, leave_realtime
{before}
scheduling = enter_realtime(50)
is_fifo = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO
assert is_fifo == (scheduling.policy == "SCHED_FIFO"), scheduling
assert scheduling.priority == (50 if is_fifo else 0)
assert not gc.isenabled()
assert (scheduling.warning is None) == (is_fifo and scheduling.memory_locked)
leave_realtime()
assert os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_OTHER
assert gc.isenabled()
print(scheduling.warning)
"""

# An ordinary user without any allowance, whoever runs the tests.
_AS_NOBODY = """
resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
resource.setrlimit(resource.RLIMIT_MEMLOCK, (65536, 65536))
if os.geteuid() == 0:
    os.setuid(65534)
"""


def run(before: str) -> str:
    program = _PROGRAM.format(before=before)
    return subprocess.run([sys.executable, "-c", program], check=True, stdout=subprocess.PIPE, text=True).stdout


def test_what_is_granted_is_in_force_and_given_back() -> None:
    assert run("")


def test_without_permission_one_line_says_how_to_grant_it() -> None:
    warning = run(_AS_NOBODY)
    assert warning.startswith("SCHED_FIFO and locked memory not granted")
    assert "limits.conf" in warning
    assert warning.count("\n") == 1
