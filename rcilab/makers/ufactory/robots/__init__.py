"""The UFACTORY arms, one data file each."""

ROBOTS = {"xArm5": "xarm5", "xArm6": "xarm6", "xArm7": "xarm7", "Lite6": "lite6", "850": "uf850"}
"""The data file in this folder by the name of the arm."""
