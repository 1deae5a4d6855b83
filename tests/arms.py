"""Groups of arms for tests over all of them."""

from __future__ import annotations

from rcilab.robots import ROBOT_NAMES, describe_robot

ANY_POSE = tuple(name for name in ROBOT_NAMES if describe_robot(name).n >= 6)
"""The arms whose tool can have any pose in reach; one with 5 axes turns its tool only in the plane of the arm."""
