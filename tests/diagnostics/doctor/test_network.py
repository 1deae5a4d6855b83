from __future__ import annotations

from pathlib import Path

import pytest

from rcilab.diagnostics.doctor import network
from rcilab.diagnostics.doctor.network import NetworkRoute
from rcilab.diagnostics.doctor.system import System
from rcilab.makers.driver import parse_address
from rcilab.makers.network import RECEIVE_BUFFER, HostRoute

ROUTES = """\
Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask\t\tMTU\tWindow\tIRTT
eth0\t00000000\t0101A8C0\t0003\t0\t0\t0\t00000000\t0\t0\t0
eth0\t0001A8C0\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0
wlan0\t0000A8C0\t00000000\t0001\t0\t0\t600\t00FFFFFF\t0\t0\t0
eth1\t0000A8C0\t00000000\t0001\t0\t0\t100\t00FFFFFF\t0\t0\t0
a line that is none
"""


def stat(name: str, policy: int) -> str:
    """A line of /proc/PID/stat, with the policy where proc_pid_stat(5) puts it: field 41."""
    return f"14 ({name}) S " + " ".join(["0"] * 37) + f" {policy} 0 0"


@pytest.mark.parametrize(
    ("most", "verdict"), [(RECEIVE_BUFFER, "ok"), (212992, "note"), (4 * RECEIVE_BUFFER, "ok"), ("x", "note")]
)
def test_buffers_hold_what_the_client_asks_for(tree, most, verdict: str) -> None:
    finding = network.check_buffers(tree({"/proc/sys/net/core/rmem_max": f"{most}\n"}))
    assert finding.verdict == verdict
    assert (f"rmem_max={RECEIVE_BUFFER}" in finding.advice) is (most == 212992)


@pytest.mark.parametrize(
    ("policies", "verdict", "said"),
    [([0, 0], "note", "SCHED_OTHER"), ([1, 1], "ok", "SCHED_FIFO"), ([1, 0], "note", "SCHED_FIFO and SCHED_OTHER")],
)
def test_network_threads_are_known_by_their_policy(tree, policies: list[int], verdict: str, said: str) -> None:
    files = {f"/proc/{14 + n}/stat": stat(f"ksoftirqd/{n}", policy) for n, policy in enumerate(policies)}
    finding = network.check_softirq(tree({**files, "/proc/99/stat": stat("a) (ksoft", 5), "/proc/7/stat": ""}))
    assert finding.verdict == verdict
    assert said in finding.value
    assert ("chrt -f" in finding.advice) is (verdict == "note")


def test_this_machine_tells_the_policy_of_a_process_where_we_look_for_it() -> None:
    fields = Path("/proc/self/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    import os

    assert int(fields[network._POLICY_FIELD]) == os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK


@pytest.mark.parametrize(
    ("host", "way"),
    [
        ("192.168.1.7", NetworkRoute("eth0", None)),
        ("192.168.0.160", NetworkRoute("eth1", None)),
        ("10.0.0.1", NetworkRoute("eth0", "192.168.1.1")),
    ],
)
def test_the_longest_mask_leads_then_the_lowest_metric(tree, host: str, way: NetworkRoute) -> None:
    assert network.find_network_route(host, tree({"/proc/net/route": ROUTES})) == way


def test_a_virtual_robot_needs_no_cable() -> None:
    finding, route = network.check_route(parse_address("rci://127.0.0.2:1337"), System())
    assert finding.verdict == "ok"
    assert "on this machine" in finding.value
    assert route is not None
    assert network.is_here(route)


def test_an_unknown_robot_is_bad_in_one_line() -> None:
    finding, route = network.check_route(parse_address("rci://no-such-robot.invalid:1337"), System())
    assert route is None
    assert finding.verdict == "bad"
    assert "RCI manual 2.5" in finding.advice
    assert "\n" not in str(finding)


FAR = parse_address("rci://192.0.2.77:1337")  # Reserved for documentation: no machine has it.


@pytest.mark.parametrize(
    ("routes", "extra", "verdict", "said"),
    [
        ("eth1 000200C0 00000000 1 0 0 0 00FFFFFF", {"/sys/class/net/eth1/speed": "1000\n"}, "ok", "1000 Mbit/s"),
        ("eth1 000200C0 00000000 1 0 0 0 00FFFFFF", {"/sys/class/net/eth1/speed": "-1\n"}, "ok", "by eth1"),
        ("eth1 00000000 0101A8C0 3 0 0 0 00000000", {}, "note", "gateway 192.168.1.1"),
        ("wlan0 000200C0 00000000 1 0 0 0 00FFFFFF", {"/sys/class/net/wlan0/wireless/x": ""}, "bad", "wireless"),
        ("", {}, "note", "does not name"),
    ],
)
def test_a_way_without_detours_is_good(tree, monkeypatch, routes, extra, verdict, said) -> None:
    ends = HostRoute("192.0.2.77", "192.0.2.22")
    monkeypatch.setattr(network, "find_route", lambda address: ends)
    finding, route = network.check_route(FAR, tree({"/proc/net/route": f"Iface ...\n{routes}\n", **extra}))
    assert route == ends
    assert finding.verdict == verdict
    assert said in finding.value


def test_every_question_has_an_answer_where_nothing_can_be_read() -> None:
    nowhere = System(Path("/no/such/tree"))
    for finding in (network.check_buffers(nowhere), network.check_softirq(nowhere)):
        assert finding.verdict == "note"
        assert "\n" not in str(finding)
