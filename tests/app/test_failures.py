"""A loop that fails at the display's rate fills neither memory nor disk."""

from __future__ import annotations

from rcilab.app.failures import Failures


def test_a_failure_that_repeats_is_kept_a_hundred_times_and_printed_once_a_second(capsys) -> None:
    now = 0.0
    failures = Failures(clock=lambda: now)
    printed = 0
    for _ in range(3000):  # A hundred seconds at the display's rate.
        printed += failures.report(ValueError("again"))
        now += 1.0 / 30.0
    assert len(failures) == 100
    assert printed <= 101
    assert capsys.readouterr().err.count("ValueError: again") == printed
