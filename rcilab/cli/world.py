"""`rcilab world ADDRESS REQUEST [FIELD=VALUE ...]`: controls the simulated environment of a virtual robot."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rcilab.sim.api import WorldRequest

EPILOG = """examples, for a controller that has printed "world 127.0.0.2:40123":
  rcilab world 127.0.0.2:40123 push wrench=[0,0,-20,0,0,0] link=4 duration=1
  rcilab world 127.0.0.2:40123 place_box box=wall size=[0.1,1,1] position=[0.9,0,0.5]
  rcilab world 127.0.0.2:40123 press button=estop
  rcilab world 127.0.0.2:40123 press button=none
  rcilab world 127.0.0.2:40123 place_arm q=0,30,0,60,0,90,0deg
  rcilab world 127.0.0.2:40123 set_tool position=0,0,120mm
  rcilab world 127.0.0.2:40123 set_load mass=2 center_of_mass=[0,0,0.05]
  rcilab world 127.0.0.2:40123 status
Contact (place_box, floor, walls) needs a controller with --plant mujoco. place_arm, set_tool, set_load, set_box and
set_soft_limits act as the teach pendant: on a stationary arm, and kept by a reboot."""

_ANGLES = ("q", "lower", "upper")
_LENGTHS = ("position", "size", "center_of_mass", "point")
_MASS = "mass"
"""Fields whose text may have a unit, as on the command line of the controller."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command."""
    parser = subparsers.add_parser(
        "world",
        help="push or move a virtual robot, place an obstacle, press its emergency stop",
        description="Controls the simulated environment of a virtual robot through its simulation port.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("address", metavar="ADDRESS", help="simulation port, HOST:PORT, as the controller prints it")
    parser.add_argument("request", metavar="REQUEST", help="request, such as push, place_box, press or status")
    parser.add_argument(
        "fields", nargs="*", metavar="FIELD=VALUE", default=[], help="arguments; values are JSON or plain words"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Sends the request and prints the reply: a status as JSON, else "done"."""
    from rcilab.execution.simulation_control import SimulationControl, parse_simulation_port
    from rcilab.sim.api import WorldStatus, status_as_dict

    address = parse_simulation_port(args.address)
    request = _request(args.request, args.fields)
    with SimulationControl(*address) as world:
        answer = world.ask(request)
    print(json.dumps(status_as_dict(answer), indent=1) if isinstance(answer, WorldStatus) else "done")
    return 0


def _request(name: str, texts: list[str]) -> WorldRequest:
    from rcilab.core.errors import InvalidValueError, UsageError
    from rcilab.sim.api import Refused, decode_world_request

    content: dict[str, Any] = {"request": name}
    for text in texts:
        field, equals, value = text.partition("=")
        if not equals or not field:
            raise InvalidValueError("field", text, "needs FIELD=VALUE, such as duration=1")
        try:
            content[field] = json.loads(value)
        except (ValueError, RecursionError):
            content[field] = _read(field, value)
    _, request = decode_world_request(json.dumps(content).encode())
    if isinstance(request, Refused):
        raise UsageError(request.reason)
    return request


def _read(field: str, text: str) -> object:
    """Returns a value that is not JSON: numbers with a unit where the field may have one, else the text."""
    from rcilab.cli.arm_options import parse_angles, parse_lengths, parse_mass

    if field in _ANGLES:
        return parse_angles(text, field)
    if field in _LENGTHS:
        return parse_lengths(text, field)
    return parse_mass(text, field) if field == _MASS else text
