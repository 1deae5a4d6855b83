from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from rcilab.diagnostics.doctor import kernel
from rcilab.diagnostics.doctor.finding import Finding
from rcilab.diagnostics.doctor.system import System

DYNAMIC = {
    "/proc/sys/kernel/osrelease": "6.18.44\n",
    "/proc/sys/kernel/version": "#1 SMP PREEMPT_DYNAMIC @0\n",
}
DEBUG_FILE = "/sys/kernel/debug/sched/preempt"
LIMITS = """\
Limit                     Soft Limit           Hard Limit           Units
Max locked memory         {memlock:<20} unlimited            bytes
Max realtime priority     {rtprio:<20} 0
"""


def is_judged(finding: Finding, verdict: str, *words: str) -> bool:
    return finding.verdict == verdict and all(word in f"{finding.value} {finding.advice}" for word in words)


@pytest.mark.parametrize(
    ("files", "verdict"),
    [
        ({**DYNAMIC, "/sys/kernel/realtime": "1\n"}, "note"),
        ({"/proc/sys/kernel/version": "#1 SMP PREEMPT_RT Debian 6.1.90-1"}, "ok"),
        ({"/proc/sys/kernel/version": "#1 SMP PREEMPT RT Fri Jan 5"}, "ok"),
        (DYNAMIC, "note"),
        ({}, "note"),
    ],
)
def test_a_kernel_is_real_time_by_its_own_word(tree, files, verdict) -> None:
    finding = kernel.check_kernel(tree(files))
    assert finding.verdict == verdict
    assert ("RCI manual 2.2" in finding.advice) is (verdict == "note")


@pytest.mark.parametrize(
    ("modes", "mode", "verdict"),
    [
        ("none voluntary (full) lazy", "full", "ok"),
        ("(none) voluntary full", "none", "note"),
        ("none (voluntary) full", "voluntary", "note"),
        ("full (lazy)", "lazy", "note"),
    ],
)
def test_the_mode_in_force_is_the_one_in_parentheses(tree, modes: str, mode: str, verdict: str) -> None:
    finding = kernel.check_preemption(tree({**DYNAMIC, DEBUG_FILE: modes, "/proc/cmdline": "preempt=none"}))
    assert is_judged(finding, verdict, f"preempt={mode}, now in force")
    assert ("echo full | sudo tee" in finding.advice) is (verdict == "note")


def test_without_the_debug_file_the_command_line_tells_the_mode(tree) -> None:
    finding = kernel.check_preemption(tree({**DYNAMIC, "/proc/cmdline": "quiet preempt=full nopreempt=none"}))
    assert is_judged(finding, "ok", "preempt=full, as booted", f"{DEBUG_FILE} does not exist")


@pytest.mark.parametrize(
    ("option", "mode"),
    [("PREEMPT_NONE", "none"), ("PREEMPT_VOLUNTARY", "voluntary"), ("PREEMPT", "full"), ("PREEMPT_LAZY", "lazy")],
)
def test_without_either_the_way_the_kernel_was_built_tells_it(tree, tmp_path: Path, option: str, mode: str) -> None:
    system = tree({**DYNAMIC, "/proc/cmdline": "quiet"})
    options = f"CONFIG_PREEMPT_BUILD=y\nCONFIG_{option}=y\nCONFIG_PREEMPT_DYNAMIC=y\n".encode()
    (tmp_path / "proc/config.gz").write_bytes(gzip.compress(options))
    assert f"preempt={mode}, as built" in kernel.check_preemption(system).value


def test_the_configuration_beside_the_kernel_will_do_too(tree) -> None:
    finding = kernel.check_preemption(tree({**DYNAMIC, "/boot/config-6.18.44": "CONFIG_PREEMPT_VOLUNTARY=y\n"}))
    assert is_judged(finding, "note", "preempt=voluntary, as built")


@pytest.mark.parametrize("spoiled", [b"", b"no gzip at all", gzip.compress(b"CONFIG_PREEMPT_NONE=y\n", mtime=0)[:-12]])
def test_an_unknown_mode_is_a_sentence(tree, tmp_path: Path, spoiled: bytes) -> None:
    system = tree(DYNAMIC)
    (tmp_path / DEBUG_FILE.lstrip("/")).mkdir(parents=True)  # Something that exists and cannot be read.
    (tmp_path / "proc/config.gz").write_bytes(spoiled)
    finding = kernel.check_preemption(system)
    assert is_judged(finding, "note", "unknown mode", f"{DEBUG_FILE} cannot be read (Is a directory)")


@pytest.mark.parametrize(
    ("version", "verdict"), [("#1 SMP PREEMPT Debian", "ok"), ("#1 SMP Debian", "note"), ("#1 PREEMPT_RT", "ok")]
)
def test_a_mode_that_was_built_in_is_told_by_the_version(tree, version: str, verdict: str) -> None:
    assert kernel.check_preemption(tree({"/proc/sys/kernel/version": version})).verdict == verdict


@pytest.mark.parametrize(
    ("rtprio", "words"),
    [
        ("0", ("limit is 0", "limits.conf", "--cap-add SYS_NICE")),
        ("40", ("limit is 40", "rtprio 99")),
        ("unlimited", ("although", "--cap-add SYS_NICE")),
    ],
)
def test_a_refused_policy_names_the_limit_and_the_remedy(tree, rtprio: str, words: tuple[str, ...]) -> None:
    system = tree({"/proc/self/limits": LIMITS.format(rtprio=rtprio, memlock=1)})
    assert is_judged(kernel.check_fifo(False, system), "note", *words)


@pytest.mark.parametrize(("memlock", "said"), [("8388608", "8388608 bytes"), ("unlimited", "unlimited)")])
def test_refused_memory_names_the_limit_and_the_remedy(tree, memlock: str, said: str) -> None:
    system = tree({"/proc/self/limits": LIMITS.format(rtprio=0, memlock=memlock)})
    assert is_judged(kernel.check_memory_lock(False, system), "note", said, "memlock unlimited")


def test_what_was_granted_needs_no_advice(tree) -> None:
    for finding in (kernel.check_fifo(True, tree({})), kernel.check_memory_lock(True, tree({}))):
        assert (finding.verdict, finding.advice) == ("ok", "")


@pytest.mark.parametrize(
    ("runtime", "verdict", "said"),
    [
        ("950000", "ok", "95% of a core, then pause for up to 50 ms"),
        ("1000000", "ok", "not throttled"),
        ("-1", "ok", "not throttled"),
        ("100000", "note", "10%"),
        ("x", "note", "unknown"),
    ],
)
def test_a_small_real_time_share_is_noted(tree, runtime: str, verdict: str, said: str) -> None:
    files = {
        "/proc/sys/kernel/sched_rt_runtime_us": f"{runtime}\n",
        "/proc/sys/kernel/sched_rt_period_us": "1000000\n",
    }
    finding = kernel.check_throttling(tree(files))
    assert is_judged(finding, verdict, said)
    assert ("kernel.sched_rt_runtime_us=-1" in finding.advice) is (runtime == "950000")


@pytest.mark.parametrize("root", [Path("/"), Path("/no/such/tree")])
def test_every_question_has_an_answer_here_and_where_nothing_can_be_read(root: Path) -> None:
    system = System(root)
    findings = [
        kernel.check_kernel(system),
        kernel.check_preemption(system),
        kernel.check_fifo(False, system),
        kernel.check_memory_lock(False, system),
        kernel.check_throttling(system),
    ]
    for finding in findings:
        assert finding.value
        assert "\n" not in str(finding)
        assert finding.advice or finding.verdict == "ok" or "unknown" in finding.value


@pytest.mark.parametrize(
    ("files", "fifo", "verdict", "said"),
    [
        ({"/sys/kernel/realtime": "1\n"}, True, "ok", "requirements are met"),
        ({"/sys/kernel/realtime": "1\n"}, False, "note", "rtprio 99"),
        ({"/sys/kernel/realtime": "0\n"}, True, "note", "unshare"),
        ({}, True, "note", "enforce_realtime = false"),
    ],
)
def test_what_the_vendors_library_asks_for_is_looked_at(tree, files, fifo: bool, verdict: str, said: str) -> None:
    assert is_judged(kernel.check_vendor_library(fifo, tree(files)), verdict, said)
