"""Ranges and initial values of the settings of a client."""

from __future__ import annotations

from typing import Final

CLIENT_PORT: Final = 8080
"""TCP port that clients use unless they are given another one."""
PUSH_PORT: Final = 8089
"""UDP port of a client that states are pushed to, unless it names another one."""
PUSH_PERIOD: Final = 5
"""Unit of the period of pushed states, [ms]."""
DEGREES_PER_TURN: Final = 360.0
SECONDS_PER_MINUTE: Final = 60.0
LARGEST_JOINT_ACCELERATION: Final = 500_000
"""Of set_joint_max_acc, [0.001 RPM/s]."""
LARGEST_JOINT_SPEED: Final = 100_000
"""Of set_joint_max_speed, [0.001 RPM]; rcilab's own bound, the maker names none."""
ANGLE_STEP: Final = 0.001  # [deg] Resolution of joint angles on the wire.
LINE_SPEED: Final = 0.25  # [m/s] After set_arm_init, as the three below.
LINE_ACCELERATION: Final = 1.6  # [m/s^2]
ANGULAR_SPEED: Final = 0.6  # [rad/s]
ANGULAR_ACCELERATION: Final = 4.0  # [rad/s^2]
LARGEST_STREAM_STEP: Final = 10.0
"""Largest distance of a joint from one streamed command to the next, [deg]; the maker's page on movej_canfd."""
SPEED_ALLOWANCE: Final = 1.15
"""Factor on the largest speed of a joint, beyond which it is too fast, and on speeds and accelerations of the tool in a
stream; rcilab's own.

Streamed angles that arrive irregularly are followed up to a tenth faster."""
LONGEST_TOOL: Final = 1.0  # [m] Distance of a tool frame, or of a centre of mass, from the flange; rcilab's own bound.
HEAVIEST_LOAD: Final = 10.0  # [kg] rcilab's own bound; the rated payload is 5 kg.
FIRST_WORK_FRAME: Final = "World"
"""Work frame of a new controller."""
FIRST_TOOL_FRAME: Final = "Arm_Tip"
"""Tool frame of a new controller."""
MOST_SENSITIVE: Final = 8
"""Collision stage; 0 is off."""
FASTEST_TOOL: Final = 10.0  # [m/s], [rad/s] Largest values of set_arm_max_line_speed and _angular_speed; rcilab's own.
STRONGEST_TOOL: Final = 100.0  # [m/s^2], [rad/s^2] The same for accelerations.
OUTPUTS: Final = ("DO1", "DO2", "DO3", "DO4")
INPUTS: Final = ("DI1", "DI2", "DI3", "DI4")
"""Digital signals of the controller."""
