"""Jobs beside the dispatcher's thread."""

from __future__ import annotations

import threading

import pytest

from rcilab.core.background_job import BackgroundJob
from rcilab.core.errors import PlanningError
from tests.waiting import wait_for


@pytest.fixture
def jobs() -> BackgroundJob[str, int]:
    return BackgroundJob("test")


def finished(jobs: BackgroundJob[str, int]) -> tuple[str, object]:
    wait_for(lambda: jobs.is_done, 20.0, "the job")
    return jobs.pop_result()


def test_a_result_comes_back_once_with_what_it_is_about(jobs):
    assert (jobs.progress, jobs.is_done) == (None, False)
    jobs.start("sum", lambda tell: 1 + 2)
    assert finished(jobs) == ("sum", 3)
    assert (jobs.progress, jobs.is_done) == (None, False)


def test_a_job_tells_how_much_is_done(jobs):
    told, going = threading.Event(), threading.Event()

    def run(tell) -> int:
        tell(0.25)
        told.set()
        going.wait(20.0)
        return 0

    jobs.start("slow", run)
    assert told.wait(20.0)
    assert (jobs.progress, jobs.is_done) == (0.25, False)
    going.set()
    finished(jobs)


@pytest.mark.parametrize("drop", [BackgroundJob.cancel, lambda jobs: jobs.start("next", lambda tell: 7)])
def test_a_job_that_is_dropped_is_gone_at_once_and_its_thread_ends(jobs, drop):
    going, ended = threading.Event(), threading.Event()

    def run(tell) -> int:
        going.wait(20.0)
        try:
            tell(0.9)
        except Exception:
            ended.set()
            raise
        return 0

    jobs.start("first", run)
    drop(jobs)
    going.set()
    assert ended.wait(20.0)
    if jobs.progress is not None:
        assert finished(jobs) == ("next", 7)
    assert not jobs.is_done


def test_an_error_of_the_library_is_a_result_and_a_bug_is_raised(jobs):
    def fail(error: Exception) -> int:
        raise error

    refused = PlanningError("no way")
    jobs.start("plan", lambda tell: fail(refused))
    assert finished(jobs) == ("plan", refused)
    jobs.start("bug", lambda tell: fail(ZeroDivisionError()))
    with pytest.raises(ZeroDivisionError):
        finished(jobs)
    assert jobs.progress is None
