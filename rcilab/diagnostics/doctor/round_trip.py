"""Round-trip time to the robot, by ICMP echoes of the size of a state at a tenth of its rate.

The kernel of the other machine answers an echo. The controller of a real robot receives nothing, so that its client is
not disturbed, and its response time is not measured. A virtual controller on this machine is connected to; it refuses a
second client.
"""

from __future__ import annotations

import os
import socket
import struct
import time
from collections.abc import Callable, Sequence

import numpy as np

from rcilab.diagnostics.doctor.finding import Finding

ECHOES = 100
_INTERVAL = 0.01  # [s]
_PAYLOAD = 1247  # [bytes] As a state.
_TIMEOUT = 1.0  # [s] For a reply.
_MAX_LOST_AT_START = 3  # The measurement ends after this number of echoes without any reply.
_ECHO, _REPLY = 8, 0  # RFC 792.
_MAX_ROUND_TRIP = 5e-4  # [s] Half a cycle, so that the other half is left for state, callback and command.

Echo = Callable[[int], float | None]
"""Sends echo number k and returns the time until its reply, [s], or None without a reply."""


def check_round_trip(host: str) -> Finding:
    """Is the round-trip time to the robot a small part of a cycle?"""
    name = "round trip"
    try:
        link = _open_socket()
    except OSError as error:
        advice = "sudo sysctl -w net.ipv4.ping_group_range='0 2147483647' permits it"
        return Finding(name, "note", f"not measured: no permission to send echoes ({error.strerror})", advice)
    with link:
        try:
            link.connect((host, 0))
            times = measure_round_trips(lambda number: _echo(link, number))
        except OSError as error:
            return Finding(name, "bad", f"{host}: {error.strerror or error}", "check the cable and the address")
    return evaluate_round_trips(host, times)


def check_controller(address: tuple[str, int], *, is_here: bool) -> Finding:
    """Does a controller listen at an address?

    Args:
        address: Host and TCP port.
        is_here: Whether it is a virtual controller on this machine; others are not connected to.
    """
    name, (host, port) = "controller", address
    if not is_here:
        return Finding(
            name, "ok", f"not connected to: that could disturb the client of {host}; rcilab run and connect() report it"
        )
    try:
        socket.create_connection(address, timeout=_TIMEOUT).close()
    except OSError as error:
        advice = f"start one: rcilab controller --model NAME --host {host} --port {port}"
        return Finding(name, "bad", f"no answer from {host}:{port}: {error.strerror or error}", advice)
    return Finding(name, "ok", f"listens at {host}:{port}")


def measure_round_trips(echo: Echo, *, interval: float = _INTERVAL, count: int = ECHOES) -> list[float | None]:
    """Returns the time of each echo, [s], None for a lost one; ends early if there is no reply at all."""
    times: list[float | None] = []
    for number in range(count):
        times.append(echo(number))
        if len(times) == _MAX_LOST_AT_START and not any(times):
            break
        time.sleep(interval)
    return times


def evaluate_round_trips(host: str, times: Sequence[float | None]) -> Finding:
    """Evaluates round-trip times, [s], None for a lost echo, for a control loop."""
    name, answered = "round trip", np.array([t for t in times if t is not None])
    if not len(answered):
        advice = "check its power and its address; some hosts do not reply to ping"
        return Finding(name, "note", f"{host} did not answer {len(times)} echoes", advice)
    lost = len(times) - len(answered)
    median, p99, worst = (1e3 * float(np.percentile(answered, part)) for part in (50, 99, 100))
    figures = {"median_ms": median, "p99_ms": p99, "max_ms": worst, "lost": float(lost), "count": float(len(times))}
    found = f"median {median:.3f} ms, p99 {p99:.3f} ms, longest {worst:.3f} ms; {lost} of {len(times)} lost"
    if lost or 1e-3 * p99 > _MAX_ROUND_TRIP:
        advice = (
            f"a cable from this computer to the robot's direct port takes at most {1e3 * _MAX_ROUND_TRIP:g} ms without "
            "losses (RCI manual 2.5); remove switches and routers, and disable interrupt coalescing of the network "
            "card: sudo ethtool -C INTERFACE rx-usecs 0"
        )
        return Finding(name, "note", found, advice, figures)
    return Finding(name, "ok", found, figures=figures)


def _open_socket() -> socket.socket:
    """Returns a socket for echoes: an unprivileged one if the system permits it, else a raw socket."""
    try:
        link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_ICMP)
    except PermissionError:
        link = socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP)
    return link


def _echo(link: socket.socket, number: int) -> float | None:
    packet = build_echo(os.getpid() & 0xFFFF, number)
    start = time.monotonic()
    link.send(packet)
    while (left := start + _TIMEOUT - time.monotonic()) > 0.0:
        link.settimeout(left)
        try:
            reply = link.recv(4096)
        except TimeoutError:
            return None
        spent = time.monotonic() - start
        if link.type == socket.SOCK_RAW:
            reply = reply[4 * (reply[0] & 0x0F) :]  # RFC 791: a raw socket also returns the IP header.
        # For unprivileged sockets the kernel sets its own identifier: only the payload identifies the echo.
        if reply[:1] == bytes([_REPLY]) and reply[6:] == packet[6:]:
            return spent
    return None


def build_echo(identifier: int, number: int) -> bytes:
    """Returns an ICMP echo request (RFC 792) with process id and number in the payload."""
    payload = struct.pack("!IH", os.getpid(), number).ljust(_PAYLOAD, b"\0")
    header = struct.pack("!BBHHH", _ECHO, 0, 0, identifier, number)
    return header[:2] + struct.pack("!H", _checksum(header + payload)) + header[4:] + payload


def _checksum(data: bytes) -> int:
    """Returns the Internet checksum (RFC 1071)."""
    words = struct.unpack(f"!{(len(data) + 1) // 2}H", data + b"\0" * (len(data) % 2))
    total = sum(words)
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF
