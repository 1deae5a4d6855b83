"""`rcilab bench`: how fast this machine is, beside what we promise."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
from collections.abc import Callable
from contextlib import redirect_stdout
from typing import TYPE_CHECKING, Any

from rcilab.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rcilab.bench.compare.peer import Absent
    from rcilab.bench.measure import Measurement

BENCHES = (
    *("forward", "inverse", "inverse_batch", "feasible_arcs", "plan_joint", "program"),
    *("check", "check_full", "check_joint_rows"),
    *("controller_ideal", "controller_mujoco", "controller_cartesian", "controller_impedance", "client_answer"),
    *("jog", "plan_line", "plan_arc", "replan"),
    *("drag", "mirror", "scrub", "page_ready", "page_drag", "lab_slider", "lab_shown"),
    *("import", "start", "state_period", "control_loop"),
)
"""In the order they run; the slow ones last."""
COMPARE = "compare"
"""Runs only when it is named: what it measures are others' packages."""

_STREAMING = 30.0  # [s]


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds `rcilab bench`."""
    parser = subparsers.add_parser("bench", help="measure this machine beside what we promise")
    known = f"one or more of: {', '.join(BENCHES)} (default: all of these); or {COMPARE}: us beside others' packages"
    parser.add_argument("names", nargs="*", metavar="NAME", help=known)
    parser.add_argument("--json", action="store_true", help="print one JSON list instead of a table")
    parser.add_argument(
        "--seconds", type=float, default=_STREAMING, help="how long control_loop streams, [s] (default: %(default)s)"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Measures and prints, the machine first; returns 1 when a promise is not kept, else 0.

    Raises:
        UsageError: A bench is unknown, or the time is no time.
    """
    names = _chosen(args.names)
    if not 0.5 <= args.seconds <= 600.0:
        raise UsageError(f"--seconds {args.seconds:g} is not from 0.5 to 600 s")
    from rcilab.bench.machine import describe_machine

    machine = describe_machine()
    if not args.json:
        _print_machine(machine)
    found: list[Measurement | Absent] = []
    out = sys.stdout
    for name in names:
        if not args.json and sys.stderr.isatty():
            print(f"{name} ...", end="\r", file=sys.stderr, flush=True)
        with redirect_stdout(sys.stderr):  # What libraries have to say is no part of the list.
            for measurement in _measured(name, args.seconds):
                found.append(measurement)
                if not args.json:
                    print(_row(measurement), file=out, flush=True)
    if args.json:
        print(json.dumps([machine, *(measurement.as_json() for measurement in found)], indent=1))
    return 1 if any(measurement.ok is False for measurement in found) else 0


def _chosen(names: list[str]) -> list[str]:
    known = (*BENCHES, COMPARE)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise UsageError(f"unknown bench {unknown[0]!r}; known: {', '.join(known)}")
    return [name for name in known if name in (names or BENCHES)]


def _measured(name: str, seconds: float) -> Iterable[Measurement | Absent]:
    """Returns the rows of one name; most have a single one."""
    if name == COMPARE:
        from rcilab.bench.compare.comparison import compare

        return compare()
    return (_bench(name, seconds)(),)


def _bench(name: str, seconds: float) -> Callable[[], Measurement]:
    """Returns a bench by name; what it needs is loaded now, so that it is not part of what the next one measures."""
    if name == "client_answer":
        from rcilab.bench.client import bench_client_answer

        return bench_client_answer
    if name.startswith("controller_") or name == "state_period":
        from rcilab.bench import controller

        return {
            "controller_ideal": lambda: controller.bench_controller("ideal"),
            "controller_mujoco": lambda: controller.bench_controller("mujoco"),
            "controller_cartesian": controller.bench_controller_cartesian,
            "controller_impedance": controller.bench_controller_impedance,
            "state_period": controller.bench_state_period,
        }[name]
    if name in ("import", "start"):
        from rcilab.bench import start

        return {"import": start.bench_import, "start": start.bench_start}[name]
    if name.startswith("lab_"):
        from rcilab.bench import notebook

        return notebook.bench_lab_shown if name == "lab_shown" else notebook.bench_lab_slider
    if name in ("drag", "control_loop"):
        from rcilab.bench import page

        return page.bench_drag if name == "drag" else lambda: page.bench_control_loop(seconds)
    if name in ("mirror", "scrub", "page_ready", "page_drag"):
        from rcilab.bench import page_speed

        return {
            "mirror": page_speed.bench_mirror,
            "scrub": page_speed.bench_scrub,
            "page_ready": page_speed.bench_page_ready,
            "page_drag": page_speed.bench_page_drag,
        }[name]
    if name in ("plan_line", "plan_arc", "replan"):
        from rcilab.bench import paths

        return {
            "plan_line": paths.bench_plan_line,
            "plan_arc": paths.bench_plan_arc,
            "replan": paths.bench_replan,
        }[name]
    from rcilab.bench import compute

    return {
        "forward": compute.bench_forward,
        "inverse": compute.bench_inverse,
        "inverse_batch": compute.bench_inverse_batch,
        "feasible_arcs": compute.bench_feasible_arcs,
        "plan_joint": compute.bench_plan_joint,
        "program": compute.bench_program,
        "check": compute.bench_check,
        "check_full": compute.bench_check_full,
        "check_joint_rows": compute.bench_check_joint_rows,
        "jog": compute.bench_jog,
    }[name]


def _print_machine(machine: dict[str, Any]) -> None:
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    fifo = "in force" if machine["sched_fifo"] else "NOT permitted"
    print(f"{machine['cpu']}, {machine['cores']} cores, load {machine['load']}; {machine['kernel']}; SCHED_FIFO {fifo}")
    print(f"Python {machine['python']}, {versions}")
    print(f"\n{'':4} {'bench':20} {'median':>10} {'p99':>10} {'target':>10}")


def _row(found: Measurement | Absent) -> str:
    from rcilab.bench.compare.peer import Absent
    from rcilab.bench.measure import plain

    verdict = {True: "ok", False: "SLOW", None: "-"}[found.ok]
    if isinstance(found, Absent):
        numbers = f"{verdict:4} {found.name:20} {'-':>10} {'-':>10} {'-':>10}"
    else:
        target = "-" if found.target is None else f"{found.target:g}"
        median, p99 = plain(found.median), plain(found.p99)
        numbers = f"{verdict:4} {found.name:20} {median:>10} {p99:>10} {target:>10} {found.unit}"
    return numbers + "\n" + textwrap.fill(found.note, 110, initial_indent=" " * 7, subsequent_indent=" " * 7)
