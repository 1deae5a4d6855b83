"""`rcilab doctor`: is this machine fit to plan, to simulate, and to stream at 1 kHz? One line a question."""

from __future__ import annotations

import argparse
import os
import re
import socket
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

from rcilab.bench.browser import BROWSERS, find_browser
from rcilab.bench.machine import ask_realtime

OLDEST_PYTHON = (3, 11)
CONTROLLER_ADDRESS = "127.0.0.2"  # Where `rcilab controller` listens unless told otherwise.
CONTROLLER_PORT = 1337
FEWEST_CORES = 2
"""One for the 1 kHz loops, one for the page and the browser."""

_REAL_TIME_LIMITS = (
    "add '@realtime - rtprio 80' and '@realtime - memlock unlimited' to /etc/security/limits.conf, join that group"
)


@dataclass(frozen=True, slots=True)
class Finding:
    """The answer to one question about this machine."""

    name: str
    verdict: Literal["ok", "note", "bad"]
    """`note`: works, with a drawback; `bad`: a part of rcilab does not work."""
    value: str
    """What was found."""
    advice: str = ""
    """What to do about it; empty when all is well."""

    def __str__(self) -> str:
        return f"{self.verdict:4}  {self.name:20}  {self.value}" + (f"; {self.advice}" if self.advice else "")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds `rcilab doctor`."""
    parser = subparsers.add_parser("doctor", help="say what this machine lacks for planning, simulating and streaming")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Prints every finding; returns 1 when something does not work, else 0."""
    findings = examine()
    print("\n".join(map(str, findings)))
    bad = [finding.name for finding in findings if finding.verdict == "bad"]
    print(f"\n{len(bad)} to mend: {', '.join(bad)}" if bad else "\nready: nothing is in the way")
    return 1 if bad else 0


def examine() -> list[Finding]:
    """Returns every finding about this machine, most basic first."""
    return [
        check_python(sys.version_info[:3]),
        *check_packages("rcilab"),
        *check_realtime(*ask_realtime()),
        check_address(CONTROLLER_ADDRESS),
        check_port(CONTROLLER_ADDRESS, CONTROLLER_PORT),
        check_cores(len(os.sched_getaffinity(0))),
        check_kernel(Path("/sys/kernel/realtime")),
        check_browser(BROWSERS),
    ]


def check_python(version: tuple[int, ...]) -> Finding:
    """Is this Python new enough?"""
    found = ".".join(map(str, version))
    if version < OLDEST_PYTHON:
        return Finding("Python", "bad", found, f"needs {'.'.join(map(str, OLDEST_PYTHON))} or newer")
    return Finding("Python", "ok", found)


def check_packages(distribution: str) -> list[Finding]:
    """Is every package that `distribution` asks for here, and in the versions it was made for?

    Packages of the extra `lab` are good to have; those of other extras are not looked at.
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
    """Is one package here, inside its bounds such as `>=1.1,<1.2`?"""
    missing = Finding(name, "note", "not installed", "the notebooks need it: pip install -e '.[lab]'")
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return missing if optional else Finding(name, "bad", "not installed", "pip install -e .")
    for operator, bound in re.findall(r"(>=|<)\s*([0-9.]+)", bounds):
        if (_numbers(version) >= _numbers(bound)) != (operator == ">="):
            return Finding(name, "bad", version, f"needs {bounds}: pip install '{name}{bounds}'")
    return Finding(name, "ok", version)


def check_realtime(fifo: bool, locked: bool) -> list[Finding]:
    """Does a loop of ours run ahead of everything else on a core, and is its memory never paged out?"""
    refused = "not permitted, so cycles can be late on a busy machine"
    return [
        Finding("SCHED_FIFO", "ok", "permitted") if fifo else Finding("SCHED_FIFO", "note", refused, _REAL_TIME_LIMITS),
        Finding("locked memory", "ok", "permitted")
        if locked
        else Finding("locked memory", "note", refused, _REAL_TIME_LIMITS),
    ]


def check_address(address: str) -> Finding:
    """Can the virtual controller have an address of its own on this machine?"""
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
                if kind == socket.SOCK_STREAM:  # A connection closed a minute ago is no reason to worry anybody.
                    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((address, port))
        except OSError as error:
            advice = "another controller runs; use it, or start `rcilab controller --port 0` (any free port)"
            return Finding(name, "note", f"{label} is taken at {address} ({error.strerror})", advice)
    return Finding(name, "ok", f"free at {address}, TCP and UDP")


def check_cores(cores: int) -> Finding:
    """Are there enough cores for a loop and a page at a time?"""
    if cores < FEWEST_CORES:
        return Finding("cores", "note", str(cores), f"{FEWEST_CORES} keep the page out of the 1 kHz loop's way")
    return Finding("cores", "ok", str(cores))


def check_kernel(flag: Path) -> Finding:
    """Is this a PREEMPT_RT kernel?"""
    kernel = f"Linux {os.uname().release}"
    if flag.exists() and flag.read_text(encoding="ascii").strip() == "1":
        return Finding("kernel", "ok", f"{kernel}, PREEMPT_RT")
    return Finding(
        "kernel",
        "note",
        f"{kernel}, not PREEMPT_RT",
        "good for the virtual controller; install an RT kernel for a real arm",
    )


def check_browser(names: tuple[str, ...]) -> Finding:
    """Is there a browser to open the page in?"""
    path = find_browser(names)
    if path is not None:
        return Finding("browser", "ok", path)
    return Finding("browser", "note", "none found", "install one (Debian: apt-get install chromium)")


def _numbers(version: str) -> tuple[int, ...]:
    """Returns the first four numbers of a version, which is what a bound compares: 4.6rc1 gives (4, 6, 0, 0)."""
    numbers = re.findall(r"\d+", re.split(r"[^0-9.]", version, maxsplit=1)[0])
    return tuple(int(number) for number in [*numbers, 0, 0, 0, 0][:4])
