"""The script of a program: Python that plans the same motion, prints its report and optionally saves it."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.motion.program import Program
    from rcilab.motion.waypoint import Waypoint

_HEAD = '''"""Plans a program of rcilab and prints the report; `python SCRIPT OUT.npz` also saves the motion."""

import sys

import rcilab
from rcilab import Program, Waypoint

program = Program(
'''

_TAIL = """
model = rcilab.load_model(program.model)
motion = rcilab.plan_program(model, program, law="torque_rate_limited")

if __name__ == "__main__":
    report = rcilab.check(motion, model)
    print(report)
    if len(sys.argv) > 1:
        motion.save(sys.argv[1])
    sys.exit(0 if report.ok else 1)
"""


def program_script(program: Program) -> str:
    """Returns the script; numbers are exact, and text of the program appears only in string literals."""
    head = [("name", program.name), ("model", program.model), ("tool", program.tool), ("start", program.start)]
    lines = [f"    {key}={value!a},\n" for key, value in head if value not in (None, "")]
    waypoints = "".join(f"        {_call(waypoint)},\n" for waypoint in program.waypoints)
    return _HEAD + "".join(lines) + f"    waypoints=(\n{waypoints}    ),\n)\n" + _TAIL


def _call(waypoint: Waypoint) -> str:
    given = [(field.name, getattr(waypoint, field.name), field.default) for field in fields(waypoint)]
    return "Waypoint(" + ", ".join(f"{key}={value!r}" for key, value, default in given if value != default) + ")"
