"""Ranges of the settings of a client, and what the controller starts with."""

from __future__ import annotations

from math import pi
from typing import Final

CLIENT_PORT: Final = 502
"""TCP port that every client connects to."""
SINGLE_PRECISION: Final = 3e-7  # [rad] or [m] Half a unit in the last place of a float below 4 is at most 2.4e-7.
"""Rounding of angles and lengths on the wire."""
SERVO_PERIOD: Final = 0.004  # [s] User manual, mode 1: at most 250 Hz.
SERVO_STEP: Final = 0.010  # [m] User manual, mode 1: largest distance between two targets.
SERVO_SPEED_FACTOR: Final = 1.2
"""How far joint targets of servo mode may exceed the tool's largest speed; default of `set_linear_spd_limit_factor`."""

JOINT_VELOCITY: Final = pi  # [rad/s] User manual, 10: 180 deg/s.
JOINT_ACCELERATION: Final = 20.0  # [rad/s^2] User manual, 10: 1146 deg/s^2; the client library has the round number.
JOINT_JERK: Final = 500.0  # [rad/s^3] User manual, 10: 28647 deg/s^3.
TOOL_ACCELERATION: Final = 50.0  # [m/s^2] User manual, 10.
TOOL_JERK: Final = 100.0  # [m/s^3] User manual, 10.
TOOL_ROTATION: Final = pi  # [rad/s] Protocol manual, 4: speeds of pure rotations are 0 to 180 deg/s.

DEFAULT_JOINT_JERK: Final = 200.0  # [rad/s^3] User manual, 6.4.3 (11459 deg/s^3), as the next.
DEFAULT_TOOL_JERK: Final = 7.0  # [m/s^3]
COLLISION_SENSITIVITIES: Final = (0, 5)
TEACH_SENSITIVITIES: Final = (1, 5)  # Client library, set_teach_sensitivity.
SENSITIVITY_STEP: Final = 0.2
"""By which each step of the collision sensitivity lowers the thresholds, from the largest torques of the joints at 1 to
a fifth at 5; rcilab's own values: the maker publishes no forces."""
DEFAULT_SENSITIVITY: Final = 3  # Of both; rcilab's own value, the maker's is that of the last `save_conf`.

LONGEST_TOOL: Final = 2.0  # [m] Distance of a frame, or of a centre of mass, from the flange; rcilab's own bound.
FARTHEST_FRAME: Final = 100.0  # [m] Distance of the user frame from the base; rcilab's own bound.

REPORT_PERIOD: Final = 0.005  # [s] Of the reports in real time, each of which a motion answers with a target.
OUTPUTS: Final = (*(f"CO{k}" for k in range(8)), *(f"DO{k}" for k in range(8)))
"""Digital outputs of the control box, by number."""
INPUTS: Final = (*(f"CI{k}" for k in range(8)), *(f"DI{k}" for k in range(8)))
"""Its digital inputs."""
