"""Checks of the software: Python, packages, browser, loopback address and port."""

from __future__ import annotations

import re
import socket
from importlib import metadata

from rcilab.diagnostics.doctor.finding import Finding
from rcilab.diagnostics.host import find_browser

OLDEST_PYTHON = (3, 11)
CONTROLLER_ADDRESS = "127.0.0.2"  # Default address of `rcilab controller`.
CONTROLLER_PORT = 1337


def check_python(version: tuple[int, ...]) -> Finding:
    """Is this Python version supported?"""
    found = ".".join(map(str, version))
    if version < OLDEST_PYTHON:
        return Finding("Python", "bad", found, f"needs {'.'.join(map(str, OLDEST_PYTHON))} or newer")
    return Finding("Python", "ok", found)


def check_packages(distribution: str) -> list[Finding]:
    """Are the packages that `distribution` requires installed, in supported versions?

    Packages of the extra `lab` are optional; those of other extras are not checked.
    """
    findings: list[Finding] = []
    for requirement in metadata.requires(distribution) or []:
        specification, _, marker = requirement.partition(";")
        optional = "extra" in marker
        match = re.match(r"\s*([A-Za-z0-9._-]+)(?:\[.*\])?\s*(.*)", specification)
        if match and (not optional or re.search(r"extra\s*==\s*['\"]lab['\"]", marker)):
            findings.append(check_package(match[1], match[2].strip(), optional=optional))
    return findings


def check_package(name: str, bounds: str, *, optional: bool = False) -> Finding:
    """Is a package installed, with a version inside its bounds such as `>=1.1,<1.2`?"""
    missing = Finding(name, "note", "not installed", "the notebooks need it: pip install -e '.[lab]'")
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return missing if optional else Finding(name, "bad", "not installed", "pip install -e .")
    for operator, bound in re.findall(r"(>=|<)\s*([0-9.]+)", bounds):
        if (_numbers(version) >= _numbers(bound)) != (operator == ">="):
            return Finding(name, "bad", version, f"needs {bounds}: pip install '{name}{bounds}'")
    return Finding(name, "ok", version)


def check_address(address: str) -> Finding:
    """Can the virtual controller use its own loopback address?"""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.bind((address, 0))
    except OSError as error:
        advice = (
            f"bring it up, such as `ip addr add {address}/8 dev lo`, or pass --host 127.0.0.1 --client 127.0.0.1:PORT"
        )
        return Finding(f"loopback {address}", "bad", f"cannot be bound ({error.strerror})", advice)
    return Finding(f"loopback {address}", "ok", "can be bound")


def check_port(address: str, port: int) -> Finding:
    """Is the port of `rcilab controller` free, for TCP and for UDP?"""
    name = f"port {port}"
    for kind, label in ((socket.SOCK_STREAM, "TCP"), (socket.SOCK_DGRAM, "UDP")):
        try:
            with socket.socket(socket.AF_INET, kind) as probe:
                if kind == socket.SOCK_STREAM:  # A connection closed recently does not block the port.
                    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((address, port))
        except OSError as error:
            advice = "another controller is running; use it, or start `rcilab controller --port 0` (any free port)"
            return Finding(name, "note", f"{label} is in use at {address} ({error.strerror})", advice)
    return Finding(name, "ok", f"free at {address}, TCP and UDP")


def check_browser(names: tuple[str, ...]) -> Finding:
    """Is a browser installed?"""
    path = find_browser(names)
    if path is not None:
        return Finding("browser", "ok", path)
    return Finding("browser", "note", "none found", "install one (Debian: apt-get install chromium)")


def _numbers(version: str) -> tuple[int, ...]:
    """Returns the first four numbers of a version, for comparison with a bound: 4.6rc1 gives (4, 6, 0, 0)."""
    numbers = re.findall(r"\d+", re.split(r"[^0-9.]", version, maxsplit=1)[0])
    return tuple(int(number) for number in [*numbers, 0, 0, 0, 0][:4])
