from __future__ import annotations

import json

import pytest

from rcilab.cli import main
from rcilab.diagnostics.doctor.finding import Finding, summary

KEYS = {"name", "verdict", "value", "advice", "figures"}
QUESTIONS = {
    "Python", "numpy", "browser", "port 1337", "kernel", "preemption", "SCHED_FIFO", "locked memory", "real-time share",
    "cores", "isolated cores", "CPU governor", "clock source", "hypervisor", "socket buffers", "ksoftirqd",
}  # fmt: skip


def test_the_exit_code_says_whether_something_is_bad(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["doctor", "--seconds", "0"])
    *lines, empty, last = capsys.readouterr().out.splitlines()
    assert code == (1 if any(line.startswith("bad") for line in lines) else 0)
    assert all(line.split()[0] in ("ok", "note", "bad") for line in lines)
    assert (empty, last.startswith("ready")) == ("", code == 0)


def test_json_is_one_list_of_every_question(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["doctor", "--json", "--seconds", "0.2", "--robot", "rci://127.0.0.2:1337"])
    said = capsys.readouterr()
    findings = {finding["name"]: finding for finding in json.loads(said.out)}
    assert findings.keys() >= QUESTIONS | {"route", "round trip", "jitter"}
    assert all(finding.keys() == KEYS for finding in findings.values())
    assert findings["jitter"]["figures"]["seconds"] == pytest.approx(0.2)
    assert "measuring jitter: 0 of 0.2 s" in said.err
    assert code == (1 if any(finding["verdict"] == "bad" for finding in findings.values()) else 0)


def test_nobody_is_looked_for_and_nothing_measured_unasked(capsys: pytest.CaptureFixture[str]) -> None:
    main(["doctor", "--json", "--seconds", "0"])
    said = capsys.readouterr()
    assert not {"route", "round trip", "jitter"} & {finding["name"] for finding in json.loads(said.out)}
    assert said.err == ""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--seconds", "-1"], "0 to 3600 s"),
        (["--seconds", "nan"], "0 to 3600 s"),
        (["--robot", "tcp://192.168.0.160"], "needs fci:// (Franka), "),
    ],
)
def test_a_question_that_is_none_is_refused_before_anything_is_asked(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", *arguments]) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.out == ""


def test_a_finding_is_one_line_and_the_bad_ones_are_named_at_the_end() -> None:
    findings = [Finding("one", "ok", "fine"), Finding("two", "bad", "broken", "mend it")]
    assert str(findings[1]).split() == ["bad", "two", "broken;", "mend", "it"]
    assert summary(findings) == "1 to fix: two"
    assert summary(findings[:1]) == "ready: no problem found"
