"""The Franka arms, one data file each."""

ROBOTS = {"Panda": "panda"}
"""The data file in this folder by the name of the arm."""
