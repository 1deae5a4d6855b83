"""Checks of the network: socket buffers, the kernel's network threads, the route to the robot."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass

from rcilab.core.errors import ConnectionLostError
from rcilab.diagnostics.doctor.finding import Finding
from rcilab.diagnostics.doctor.system import System
from rcilab.makers.driver import RobotAddress
from rcilab.makers.network import RECEIVE_BUFFER, HostRoute, find_route
from rcilab.realtime.scheduling import PRIORITY

_POLICIES = {"0": "SCHED_OTHER", "1": "SCHED_FIFO", "2": "SCHED_RR", "3": "SCHED_BATCH", "5": "SCHED_IDLE"}
_REALTIME_POLICIES = ("1", "2")
_POLICY_FIELD = 38  # proc_pid_stat(5): field 41, counted from 0 after pid and (comm).
_FASTER = PRIORITY + 1  # Packets for the control process are delivered before it continues to compute.
_OWN_ADDRESS = "192.168.0.22/24"  # RCI manual 2.5, its example for a computer wired to the robot directly.


@dataclass(frozen=True, slots=True)
class NetworkRoute:
    """The interface and the gateway, if any, of the route to an address."""

    interface: str
    gateway: str | None


def check_buffers(system: System) -> Finding:
    """Can a socket buffer hold the states of a pause of the client?"""
    name, most = "socket buffers", system.read("/proc/sys/net/core/rmem_max")
    if most.text is None or not most.text.isdecimal():
        return Finding(name, "note", f"unknown: {most.problem or f'rmem_max is {most.text!r}'}")
    found = f"up to {most.text} bytes for receiving"
    if int(most.text) >= RECEIVE_BUFFER:
        return Finding(name, "ok", found)
    advice = (
        f"echo net.core.rmem_max={RECEIVE_BUFFER} | sudo tee /etc/sysctl.d/60-rcilab.conf, then sudo sysctl --system"
    )
    return Finding(name, "note", f"{found}, {RECEIVE_BUFFER} needed: states are lost after a shorter pause", advice)


def check_softirq(system: System) -> Finding:
    """Do the kernel's network threads have a higher priority than a control loop?"""
    name, policies = "ksoftirqd", set[str]()
    for path in system.find("/proc", "[0-9]*/stat"):
        process, closed, rest = (system.read(path).text or "").rpartition(")")  # None if the process has ended.
        fields = rest.split()
        if closed and "(ksoftirqd/" in process and len(fields) > _POLICY_FIELD:
            policies.add(fields[_POLICY_FIELD])
    if not policies:
        return Finding(name, "note", "not visible, as in a container", "check it on the host")
    found = " and ".join(sorted(_POLICIES.get(policy, f"policy {policy}") for policy in policies))
    if policies <= set(_REALTIME_POLICIES):
        return Finding(name, "ok", found)
    advice = f"for a real arm, after every boot: for p in $(pgrep ksoftirqd/); do sudo chrt -f -p {_FASTER} $p; done"
    return Finding(name, "note", f"{found}: packets can wait behind SCHED_FIFO loops", advice)


def check_route(address: RobotAddress, system: System) -> tuple[Finding, HostRoute | None]:
    """Is this machine connected to the robot directly by cable? Also returns the route."""
    name = "route"
    try:
        route = find_route(address)
    except ConnectionLostError as error:
        advice = f"give this computer an address in its network: sudo ip addr add {_OWN_ADDRESS} dev INTERFACE"
        return Finding(name, "bad", str(error), f"{advice} (RCI manual 2.5)"), None
    host, local = route.host, route.local
    if is_here(route):
        return Finding(name, "ok", f"{local} to {host}, on this machine"), route
    link = find_network_route(host, system)
    if link is None:
        return Finding(name, "note", f"{local} to {host} by an interface that /proc/net/route does not name"), route
    found = f"{local} to {host} by {link.interface}"
    if system.has(f"/sys/class/net/{link.interface}/wireless"):
        advice = "connect a cable to the robot's direct port (RCI manual 2.5)"
        return Finding(name, "bad", f"{found}, which is wireless: packets are late and lost", advice), route
    if link.gateway is not None:
        advice = (
            f"connect this computer to the robot's direct port, and give it an address in the robot's network, such as "
            f"sudo ip addr add {_OWN_ADDRESS} dev {link.interface} (RCI manual 2.5)"
        )
        return Finding(name, "note", f"{found} and gateway {link.gateway}", advice), route
    speed = system.read(f"/sys/class/net/{link.interface}/speed").text or ""
    return Finding(name, "ok", found + (f", {speed} Mbit/s" if speed.isdecimal() else "")), route


def is_here(route: HostRoute) -> bool:
    """Returns whether the robot is a virtual one on this machine."""
    return ipaddress.ip_address(route.host).is_loopback or route.host == route.local


def find_network_route(host: str, system: System) -> NetworkRoute | None:
    """Returns the route to an IPv4 address from the kernel's routing table; None without an entry."""
    target = int(ipaddress.IPv4Address(host))
    best: tuple[int, int] | None = None
    route: NetworkRoute | None = None
    for line in (system.read("/proc/net/route").text or "").splitlines()[1:]:
        words = line.split()
        try:
            interface, metric = words[0], int(words[6])
            destination, gateway, mask = (_address(words[column]) for column in (1, 2, 7))
        except (IndexError, ValueError):
            continue
        rank = (mask, -metric)  # The longest mask wins, then the lowest metric.
        if target & mask == destination and (best is None or rank > best):
            best, route = rank, NetworkRoute(interface, str(ipaddress.IPv4Address(gateway)) if gateway else None)
    return route


def _address(text: str) -> int:
    """Returns an IPv4 address as a number. The table has the bytes of the network order as read by the host.

    All supported machines are little-endian.
    """
    return int.from_bytes(bytes.fromhex(text), "little")
