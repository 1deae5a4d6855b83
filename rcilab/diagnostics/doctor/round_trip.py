"""How long a packet takes to the robot and back: ICMP echoes of the size of a state, at a tenth of its rate.

An echo is answered by the other end's kernel. Nothing is sent to a real robot's program, so this does not disturb
its client, and it does not measure how quick that program is. A virtual controller on this machine is connected to: it
refuses a second client.
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
_PATIENCE = 1.0  # [s] for an answer
_MOST_LOST_IN_A_ROW = 3  # A host that answers nothing at all is given up after so many.
_ECHO, _ANSWER = 8, 0  # RFC 792.
_LONGEST = 5e-4  # [s] Half a cycle for the network leaves the other half for state, callback and command.

Echo = Callable[[int], float | None]
"""Sends echo number k and returns the time until its answer, [s], or None when none came."""


def check_round_trip(host: str) -> Finding:
    """Does a packet get to the robot and back in a small part of a cycle?"""
    name = "round trip"
    try:
        link = _open_socket()
    except OSError as error:
        advice = "sudo sysctl -w net.ipv4.ping_group_range='0 2147483647' permits it"
        return Finding(name, "note", f"not measured: this user may not send echoes ({error.strerror})", advice)
    with link:
        try:
            link.connect((host, 0))
            times = measure_round_trips(lambda number: _echo(link, number))
        except OSError as error:
            return Finding(name, "bad", f"{host}: {error.strerror or error}", "check the cable and the address")
    return evaluate_round_trips(host, times)


def check_controller(place: tuple[str, int], *, is_here: bool) -> Finding:
    """Does a controller listen there?

    Args:
        place: Address and TCP port.
        is_here: Whether it is a virtual one on this machine; another one is not connected to.
    """
    name, (host, port) = "controller", place
    if not is_here:
        return Finding(
            name, "ok", f"not connected to: that could disturb the client of {host}; rcilab run and connect() report it"
        )
    try:
        socket.create_connection(place, timeout=_PATIENCE).close()
    except OSError as error:
        advice = f"start one: rcilab controller --model NAME --host {host} --port {port}"
        return Finding(name, "bad", f"no answer from {host}:{port}: {error.strerror or error}", advice)
    return Finding(name, "ok", f"listens at {host}:{port}")


def measure_round_trips(echo: Echo, *, interval: float = _INTERVAL, count: int = ECHOES) -> list[float | None]:
    """Returns the time of each echo, [s], None for a lost one; stops early where nothing at all is answered."""
    times: list[float | None] = []
    for number in range(count):
        times.append(echo(number))
        if len(times) == _MOST_LOST_IN_A_ROW and not any(times):
            break
        time.sleep(interval)
    return times


def evaluate_round_trips(host: str, times: Sequence[float | None]) -> Finding:
    """Returns what measured times, [s], None for a lost echo, mean for a control loop."""
    name, answered = "round trip", np.array([t for t in times if t is not None])
    if not len(answered):
        advice = "is it switched on, and is this its address? Some hosts do not answer to ping"
        return Finding(name, "note", f"{host} did not answer {len(times)} echoes", advice)
    lost = len(times) - len(answered)
    median, p99, worst = (1e3 * float(np.percentile(answered, part)) for part in (50, 99, 100))
    figures = {"median_ms": median, "p99_ms": p99, "max_ms": worst, "lost": float(lost), "count": float(len(times))}
    found = f"median {median:.3f} ms, p99 {p99:.3f} ms, longest {worst:.3f} ms; {lost} of {len(times)} lost"
    if lost or 1e-3 * p99 > _LONGEST:
        advice = (
            f"a cable from this computer to the robot's direct port needs no more than {1e3 * _LONGEST:g} ms and loses "
            "none (RCI manual 2.5); take switches, routers and power saving of the network card out of the way: "
            "sudo ethtool -C INTERFACE rx-usecs 0"
        )
        return Finding(name, "note", found, advice, figures)
    return Finding(name, "ok", found, figures=figures)


def _open_socket() -> socket.socket:
    """Returns a socket for echoes: the kind for everybody where the system permits it, else the one for root."""
    try:
        link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM, socket.IPPROTO_ICMP)
    except PermissionError:
        link = socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP)
    return link


def _echo(link: socket.socket, number: int) -> float | None:
    packet = build_echo(os.getpid() & 0xFFFF, number)
    start = time.monotonic()
    link.send(packet)
    while (left := start + _PATIENCE - time.monotonic()) > 0.0:
        link.settimeout(left)
        try:
            answer = link.recv(4096)
        except TimeoutError:
            return None
        spent = time.monotonic() - start
        if link.type == socket.SOCK_RAW:
            answer = answer[4 * (answer[0] & 0x0F) :]  # RFC 791: a raw socket hands over the IP header too.
        # The kernel gives echoes of the other kind an identifier of its own: only the payload identifies ours.
        if answer[:1] == bytes([_ANSWER]) and answer[6:] == packet[6:]:
            return spent
    return None


def build_echo(identifier: int, number: int) -> bytes:
    """Returns an ICMP echo request (RFC 792) whose payload names the process and the echo."""
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
