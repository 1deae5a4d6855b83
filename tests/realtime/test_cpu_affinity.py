from __future__ import annotations

import os
import subprocess
import sys
import threading

from rcilab.realtime.cpu_affinity import one_core


def test_two_are_on_one_core_for_as_long_as_it_takes_and_then_where_they_may_be() -> None:
    wait = threading.Event()
    other = threading.Thread(target=wait.wait)
    other.start()
    try:
        partner = other.native_id
        assert partner is not None
        before = os.sched_getaffinity(0), os.sched_getaffinity(partner)
        with one_core(partner):
            assert len(os.sched_getaffinity(0)) == 1
            assert os.sched_getaffinity(partner) == os.sched_getaffinity(0) <= before[0]
        assert (os.sched_getaffinity(0), os.sched_getaffinity(partner)) == before
    finally:
        wait.set()
        other.join()


def test_a_partner_that_has_ended_or_is_none_changes_nothing() -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    before = os.sched_getaffinity(0)
    for partner in (gone.pid, None):
        with one_core(partner):
            assert os.sched_getaffinity(0) == before


def test_a_partner_may_end_meanwhile() -> None:
    other = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    before = os.sched_getaffinity(0)
    with one_core(other.pid):
        other.communicate()
    assert os.sched_getaffinity(0) == before
