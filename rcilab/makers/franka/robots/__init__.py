"""The Franka arms, one data file each."""

ROBOTS = {"Panda": "panda", "FR3": "fr3"}
"""The data file in this folder by the name of the arm."""
