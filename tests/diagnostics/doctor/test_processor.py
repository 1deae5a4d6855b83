from __future__ import annotations

from pathlib import Path

import pytest

from rcilab.diagnostics.doctor import processor
from rcilab.diagnostics.doctor.system import System

CPU = "/sys/devices/system/cpu"
CLOCK = "/sys/devices/system/clocksource/clocksource0"
STAT = "cpu  {busy} 0 0 0 0 0 0 {steal} 0 0\ncpu0 1 2 3 4 5 6 7 8 9 10\n"


def test_one_core_is_noted() -> None:
    assert processor.check_cores(1).verdict == "note"
    assert processor.check_cores(2).verdict == "ok"


@pytest.mark.parametrize(
    ("isolated", "cores", "verdict", "said"),
    [
        ("3\n", 3, "ok", "taskset -c 3 "),
        ("2-3,5\n", 4, "ok", "taskset -c 2 "),
        ("\n", 2, "ok", "too few for one"),
        ("\n", 8, "note", "isolcpus=7"),
    ],
)
def test_a_core_can_be_given_away_where_there_are_enough(tree, isolated, cores, verdict, said) -> None:
    finding = processor.check_isolation(cores, tree({f"{CPU}/isolated": isolated}))
    assert finding.verdict == verdict
    assert said in f"{finding.value} {finding.advice}"


def test_one_slow_governor_is_enough_for_a_note(tree) -> None:
    finding = processor.check_governor(
        tree({f"{CPU}/cpu{n}/cpufreq/scaling_governor": name for n, name in enumerate(["performance", "powersave"])})
    )
    assert finding.verdict == "note"
    assert finding.value.startswith("powersave:")
    assert "echo performance | sudo tee" in finding.advice


def test_full_speed_is_good_and_so_is_no_governor_at_all(tree) -> None:
    assert processor.check_governor(tree({})).verdict == "ok"
    full = tree({f"{CPU}/cpu0/cpufreq/scaling_governor": "performance\n"})
    assert processor.check_governor(full).value == "performance"


@pytest.mark.parametrize(
    ("current", "available", "verdict", "said"),
    [
        ("tsc", "tsc hpet", "ok", "tsc"),
        ("arch_sys_counter", "arch_sys_counter", "ok", "arch_sys_counter"),
        ("hpet", "tsc hpet acpi_pm", "note", "clocksource=tsc"),
        ("acpi_pm", "acpi_pm", "note", "dmesg"),
    ],
)
def test_a_slow_clock_is_noted_with_the_better_one(tree, current, available, verdict, said) -> None:
    files = {f"{CLOCK}/current_clocksource": current, f"{CLOCK}/available_clocksource": available}
    finding = processor.check_clock(tree(files))
    assert finding.verdict == verdict
    assert said in f"{finding.value} {finding.advice}"


@pytest.mark.parametrize(
    ("flags", "steal", "verdict"),
    [("fpu sse2", 0, "ok"), ("fpu hypervisor sse2", 0, "note"), ("fpu", 25, "note")],
)
def test_borrowed_cores_are_noted_with_what_was_taken(tree, flags: str, steal: int, verdict: str) -> None:
    files = {"/proc/cpuinfo": f"processor : 0\nflags\t\t: {flags}\n", "/proc/stat": STAT.format(busy=75, steal=steal)}
    finding = processor.check_hypervisor(tree(files))
    assert finding.verdict == verdict
    if verdict == "note":
        assert finding.figures == {"stolen_percent": steal / (75 + steal) * 100.0}


@pytest.mark.parametrize("text", ["", "cpu 1 2 3", "cpu a b c d e f g h", "intr 1 2 3 4 5 6 7 8 9"])
def test_ticks_that_make_no_sense_are_unknown(tree, text: str) -> None:
    assert processor.read_ticks(tree({"/proc/stat": text})) is None


@pytest.mark.parametrize("root", [Path("/"), Path("/no/such/tree")])
def test_every_question_has_an_answer_here_and_where_nothing_can_be_read(root: Path) -> None:
    system = System(root)
    findings = [
        processor.check_isolation(8, system),
        processor.check_governor(system),
        processor.check_clock(system),
        processor.check_hypervisor(system),
    ]
    assert all(finding.value and "\n" not in str(finding) for finding in findings)


def test_a_kernel_without_a_hold_on_sleeping_cores_is_noted(tree) -> None:
    finding = processor.check_sleep(tree({}))
    assert finding.verdict == "note"
    assert "cpu_dma_latency" in finding.value


def test_here_cores_are_kept_awake_or_the_remedy_is_named() -> None:
    finding = processor.check_sleep(System())
    assert finding.verdict == "ok" or "sudo" in finding.advice or "idle=poll" in finding.advice
